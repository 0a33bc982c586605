//! The two-dimensional cosine transform (DCT-II) and its inverse, by complex FFTs of the same length, two rows at a time.
//!
//! The FFT is rustfft's scalar one: no code path is chosen by the processor at run time, so the bits are the same everywhere.
//!
//! # Source
//! Makhoul, "A fast cosine transform in one and two dimensions", IEEE TASSP 28(1), 1980.

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};
use std::sync::Arc;

/// Transforms rows, transposes, transforms again.
pub(super) struct Dct2 {
    width: usize,
    height: usize,
    along_x: Dct,
    along_y: Dct,
}

impl Dct2 {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, along_x: Dct::new(width), along_y: Dct::new(height) }
    }

    /// In place; the result is transposed: `height` values for each column of the image. `spare` is room of any length, best kept from one
    /// transform to the next.
    pub(super) fn forward(&self, data: &mut Vec<f64>, spare: &mut Vec<f64>) {
        self.along_x.rows(data, Direction::Forward);
        transpose(data, spare, self.width, self.height);
        self.along_y.rows(data, Direction::Forward);
    }

    /// Undoes [`forward`](Self::forward), transposition included.
    pub(super) fn inverse(&self, data: &mut Vec<f64>, spare: &mut Vec<f64>) {
        self.along_y.rows(data, Direction::Inverse);
        transpose(data, spare, self.height, self.width);
        self.along_x.rows(data, Direction::Inverse);
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    Forward,
    Inverse,
}

/// One length.
struct Dct {
    length: usize,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// exp(−iπk / 2n).
    twiddles: Vec<Complex<f64>>,
}

impl Dct {
    fn new(length: usize) -> Self {
        let mut planner = FftPlannerScalar::new();
        let twiddles = (0..length)
            .map(|k| {
                let (s, c) = libm::sincos(std::f64::consts::PI * k as f64 / (2 * length) as f64);
                Complex::new(c, -s)
            })
            .collect();
        Self { length, forward: planner.plan_fft_forward(length), inverse: planner.plan_fft_inverse(length), twiddles }
    }

    /// Every row of `length` values. Rows go in pairs, as real and imaginary part of one complex sequence.
    fn rows(&self, data: &mut [f64], direction: Direction) {
        let n = self.length;
        data.par_chunks_mut(2 * n).for_each_init(
            || (vec![Complex::new(0.0, 0.0); n], vec![Complex::new(0.0, 0.0); n]),
            |(values, scratch), pair| {
                let (a, b) = pair.split_at_mut(n);
                match direction {
                    Direction::Forward => self.forward_pair(a, b, values, scratch),
                    Direction::Inverse => self.inverse_pair(a, b, values, scratch),
                }
            },
        );
    }

    fn forward_pair(&self, a: &mut [f64], b: &mut [f64], v: &mut [Complex<f64>], scratch: &mut Vec<Complex<f64>>) {
        let n = self.length;
        let at = |row: &[f64], k: usize| row.get(k).copied().unwrap_or(0.0);
        for k in 0..n {
            let source = even_odd(k, n);
            v[k] = Complex::new(a[source], at(b, source));
        }
        scratch.resize(self.forward.get_inplace_scratch_len().max(n), Complex::new(0.0, 0.0));
        self.forward.process_with_scratch(v, scratch);
        for k in 0..n {
            let (z, mirror) = (v[k], v[(n - k) % n].conj());
            // Spectra of the real and of the imaginary sequence.
            let (za, zb) = ((z + mirror) * 0.5, (z - mirror) * Complex::new(0.0, -0.5));
            a[k] = (za * self.twiddles[k]).re;
            if let Some(b) = b.get_mut(k) {
                *b = (zb * self.twiddles[k]).re;
            }
        }
    }

    fn inverse_pair(&self, a: &mut [f64], b: &mut [f64], v: &mut [Complex<f64>], scratch: &mut Vec<Complex<f64>>) {
        let n = self.length;
        let spectrum = |row: &[f64], k: usize| {
            let last = if k == 0 { 0.0 } else { row.get(n - k).copied().unwrap_or(0.0) };
            Complex::new(row.get(k).copied().unwrap_or(0.0), -last) * self.twiddles[k].conj()
        };
        for k in 0..n {
            v[k] = spectrum(a, k) + spectrum(b, k) * Complex::new(0.0, 1.0);
        }
        scratch.resize(self.inverse.get_inplace_scratch_len().max(n), Complex::new(0.0, 0.0));
        self.inverse.process_with_scratch(v, scratch);
        let scale = 1.0 / n as f64;
        for k in 0..n {
            let target = even_odd(k, n);
            a[target] = v[k].re * scale;
            if let Some(b) = b.get_mut(target) {
                *b = v[k].im * scale;
            }
        }
    }
}

/// Where element k of the reordered sequence comes from: even indices rising, then odd ones falling.
#[inline]
fn even_odd(k: usize, n: usize) -> usize {
    if k < n.div_ceil(2) { 2 * k } else { 2 * (n - 1 - k) + 1 }
}

/// Transposes `height` rows of `width` values, block by block, by way of `spare`, which then holds what `data` held.
fn transpose(data: &mut Vec<f64>, spare: &mut Vec<f64>, width: usize, height: usize) {
    const BLOCK: usize = 32;
    spare.resize(data.len(), 0.0);
    spare.par_chunks_mut(height * BLOCK).enumerate().for_each(|(strip, out)| {
        let columns = out.len() / height;
        for first in (0..height).step_by(BLOCK) {
            for y in first..(first + BLOCK).min(height) {
                for x in 0..columns {
                    out[x * height + y] = data[y * width + strip * BLOCK + x];
                }
            }
        }
    });
    std::mem::swap(data, spare);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_the_definition_and_inverts() {
        for (w, h) in [(1, 1), (1, 7), (5, 1), (8, 6), (13, 17), (33, 40)] {
            let data: Vec<f64> = (0..w * h).map(|k| ((k * 7919 + 13) % 101) as f64 - 50.0).collect();
            let mut out = data.clone();
            let dct = Dct2::new(w, h);
            let mut spare = Vec::new();
            dct.forward(&mut out, &mut spare);
            let pi = std::f64::consts::PI;
            for (i, j) in [(0, 0), (w - 1, 0), (0, h - 1), (w / 2, h / 3)] {
                let mut sum = 0.0;
                for y in 0..h {
                    for x in 0..w {
                        let cx = (pi * (x as f64 + 0.5) * i as f64 / w as f64).cos();
                        sum += data[y * w + x] * cx * (pi * (y as f64 + 0.5) * j as f64 / h as f64).cos();
                    }
                }
                assert!((out[i * h + j] - sum).abs() < 1e-9 * (w * h) as f64, "{w}×{h} at ({i}, {j}): {} against {sum}", out[i * h + j]);
            }
            dct.inverse(&mut out, &mut spare);
            assert!(out.iter().zip(&data).all(|(a, b)| (a - b).abs() < 1e-10));
        }
    }
}
