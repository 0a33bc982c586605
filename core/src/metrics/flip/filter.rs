//! Filters of FLIP: the eye's contrast sensitivity as Gaussians, and its detectors of edges and points. All separable.

use rayon::prelude::*;

/// Pixels per degree of visual angle: 3840 pixels over 0.7 m, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;
/// Width of the detectors' features [degrees].
const FEATURE_WIDTH: f64 = 0.082;
/// The widest Gaussian there is sets the support of all, so that they are cut off alike.
const WIDEST: f64 = 0.04;

/// One plane of an image.
pub(super) struct Planes {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Planes {
    pub(super) fn map(&self, f: impl Fn(f32) -> f32) -> Planes {
        Planes { width: self.width, height: self.height, values: self.values.iter().map(|v| f(*v)).collect() }
    }
}

/// Contrast sensitivity of one opponent channel: a sum of Gaussians aₖ √(π / bₖ) exp(−π² d² / bₖ) over the distance d [degrees].
pub(super) struct ContrastSensitivity {
    terms: &'static [(f64, f64)],
}

impl ContrastSensitivity {
    pub(super) const ACHROMATIC: Self = Self { terms: &[(1.0, 0.0047)] };
    pub(super) const RED_GREEN: Self = Self { terms: &[(1.0, 0.0053)] };
    pub(super) const BLUE_YELLOW: Self = Self { terms: &[(34.1, 0.04), (13.5, 0.025)] };

    /// The plane as this channel of the eye passes it on.
    pub(super) fn filter(&self, plane: &Planes) -> Vec<f32> {
        let pi = std::f64::consts::PI;
        let radius = (3.0 * (WIDEST / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let kernels: Vec<(f64, Vec<f64>)> = self
            .terms
            .iter()
            .map(|(a, b)| {
                let gaussian = |d: i32| {
                    let d = f64::from(d) / PIXELS_PER_DEGREE;
                    libm::exp(-pi * pi * d * d / b)
                };
                (a * (pi / b).sqrt(), (-radius..=radius).map(gaussian).collect())
            })
            .collect();
        let total: f64 = kernels.iter().map(|(scale, k)| scale * k.iter().sum::<f64>() * k.iter().sum::<f64>()).sum();
        let mut out = vec![0.0; plane.values.len()];
        for (scale, kernel) in &kernels {
            let across: Vec<f32> = kernel.iter().map(|v| (v * scale / total) as f32).collect();
            let down: Vec<f32> = kernel.iter().map(|v| *v as f32).collect();
            let term = convolve(plane, &across, &down);
            out.iter_mut().zip(&term).for_each(|(o, t)| *o += t);
        }
        out
    }
}

/// How strongly each pixel is an edge, and a point.
pub(super) struct Detectors {
    pub(super) edge: Vec<f32>,
    pub(super) point: Vec<f32>,
}

impl Detectors {
    /// Of a grey plane in [0, 1].
    pub(super) fn of(grey: &Planes) -> Detectors {
        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation).ceil() as i32;
        let taps = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            let tap = |d: i32| f(f64::from(d), libm::exp(-f64::from(d * d) / (2.0 * deviation * deviation)));
            (-radius..=radius).map(tap).collect()
        };
        let gaussian = taps(&|_, g| g);
        let sum: f64 = gaussian.iter().sum();
        let gaussian: Vec<f32> = gaussian.iter().map(|v| (v / sum) as f32).collect();
        let first = balanced(&taps(&|d, g| -d * g));
        let second = balanced(&taps(&|d, g| (d * d / (deviation * deviation) - 1.0) * g));
        let strength = |derivative: &[f32]| -> Vec<f32> {
            let x = convolve(grey, derivative, &gaussian);
            let y = convolve(grey, &gaussian, derivative);
            x.iter().zip(&y).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        Detectors { edge: strength(&first), point: strength(&second) }
    }
}

/// Scales positive taps to a sum of 1 and negative ones to −1.
fn balanced(taps: &[f64]) -> Vec<f32> {
    let positive: f64 = taps.iter().filter(|v| **v > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|v| **v < 0.0).sum::<f64>();
    taps.iter().map(|v| (if *v > 0.0 { v / positive } else { v / negative }) as f32).collect()
}

/// Correlates with `across` along rows and then `down` along columns; beyond the border the last pixel repeats.
fn convolve(plane: &Planes, across: &[f32], down: &[f32]) -> Vec<f32> {
    let (w, h) = (plane.width, plane.height);
    let clamped = |i: usize, tap: usize, radius: usize, n: usize| (i + tap).saturating_sub(radius).min(n - 1);
    let mut rows = vec![0.0f32; w * h];
    rows.par_chunks_mut(w).zip(plane.values.par_chunks(w)).for_each(|(out, row)| {
        let radius = across.len() / 2;
        let padded: Vec<f32> = (0..w + 2 * radius).map(|i| row[clamped(i, 0, radius, w)]).collect();
        for (x, o) in out.iter_mut().enumerate() {
            *o = padded[x..x + across.len()].iter().zip(across).map(|(v, k)| v * k).sum();
        }
    });
    let mut out = vec![0.0f32; w * h];
    out.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        for (tap, k) in down.iter().enumerate() {
            let from = clamped(y, tap, down.len() / 2, h) * w;
            for (o, v) in out.iter_mut().zip(&rows[from..from + w]) {
                *o += k * v;
            }
        }
    });
    out
}
