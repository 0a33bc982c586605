//! A multigrid V-cycle for the weighted screened Poisson operator: the preconditioner of conjugate gradients.
//!
//! Each level joins 2×2 pixels; a coarse edge weighs half the sum of the fine edges that it stands for, which is what constant
//! interpolation over twice the distance calls for. Smoothing is one damped Jacobi sweep before and one after the coarse step, so the cycle is symmetric.
//! Both sweeps start from values that follow from the right-hand side alone, so each level is walked through twice and keeps nothing else.
//!
//! # Source
//! Trottenberg, Oosterlee and Schüller, "Multigrid", 2001, sections 2 and 7; aggregation scaling by Braess, Computing 55, 1995.

use super::field::{Field, Row, dot};
use super::solver::Precondition;
use super::stencil::Stencil;
use rayon::prelude::*;

/// Levels from fine to coarse, with scratch. The finest level's operator is the caller's.
pub(super) struct Hierarchy {
    levels: Vec<Level>,
}

#[derive(Default)]
struct Level {
    /// Empty on the finest level.
    stencil: Stencil,
    /// Damping over the diagonal.
    step: Vec<f32>,
    /// Right-hand side and answer of this level; empty on the finest one.
    b: Field,
    z: Field,
}

/// Damping of Jacobi: 4/5 smooths best for five points.
const DAMPING: f32 = 0.8;
/// Sweeps on the coarsest level, which has at most a few pixels.
const COARSEST_SWEEPS: usize = 24;
/// Pixels of the coarsest level at most.
const COARSEST: usize = 4;

impl Hierarchy {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let mut levels = vec![Level { step: vec![0.0; width * height], ..Level::default() }];
        let (mut w, mut h) = (width, height);
        while w * h > COARSEST {
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
            let field = || Field::new(w, h);
            levels.push(Level { stencil: Stencil::new(w, h), step: vec![0.0; w * h], b: field(), z: field() });
        }
        Self { levels }
    }

    /// Takes the weights of an operator of the same size.
    pub(super) fn adapt(&mut self, stencil: &Stencil) {
        let mut finer = stencil;
        let mut levels = self.levels.iter_mut();
        if let Some(first) = levels.next() {
            set_steps(stencil, &mut first.step);
        }
        for level in levels {
            coarsen(finer, &mut level.stencil);
            set_steps(&level.stencil, &mut level.step);
            finer = &level.stencil;
        }
    }
}

/// A cycle over an operator and the hierarchy that was adapted to it.
pub(super) struct Cycle<'a> {
    pub(super) stencil: &'a Stencil,
    pub(super) hierarchy: &'a mut Hierarchy,
}

impl Precondition for Cycle<'_> {
    fn precondition(&mut self, r: &Field, z: &mut Field) -> [f64; 3] {
        cycle(self.stencil, &mut self.hierarchy.levels, r, z)
    }
}

/// z ≈ A⁻¹ b; returns ⟨b, z⟩ by channel.
fn cycle(stencil: &Stencil, levels: &mut [Level], b: &Field, z: &mut Field) -> [f64; 3] {
    let Some((level, coarser)) = levels.split_first_mut() else { return [0.0; 3] };
    let step = &level.step;
    let Some(next) = coarser.first_mut() else {
        return coarsest(stencil, step, b, z);
    };
    let next_stencil = std::mem::take(&mut next.stencil);
    let (mut next_b, mut next_z) = (std::mem::take(&mut next.b), std::mem::take(&mut next.z));
    restrict(stencil, step, b, &mut next_b);
    cycle(&next_stencil, coarser, &next_b, &mut next_z);
    let product = correct(stencil, step, b, &next_z, z);
    if let Some(next) = coarser.first_mut() {
        (next.stencil, next.b, next.z) = (next_stencil, next_b, next_z);
    }
    product
}

/// Sweeps from zero on.
fn coarsest(stencil: &Stencil, step: &[f32], b: &Field, z: &mut Field) -> [f64; 3] {
    z.each_row(|row| row.values.fill(0.0));
    for _ in 0..COARSEST_SWEEPS {
        let x = z.clone();
        z.each_row(|Row { y, channel, values }| {
            stencil.apply_row(&x, y, channel, values);
            let (b, x, step) = (b.row(y, channel), x.row(y, channel), stencil.line(step, y));
            for i in 0..values.len() {
                values[i] = x[i] + step[i] * (b[i] - values[i]);
            }
        });
    }
    b.dot(z)
}

/// Sums the residual that the first sweep from zero leaves over 2×2 pixels.
///
/// That sweep gives x = S b with S = ω / D, and b − A x = (1 − ω) b + W x, where W are the weights to the neighbours.
fn restrict(stencil: &Stencil, step: &[f32], b: &Field, coarse: &mut Field) {
    let (width, height) = (stencil.width, stencil.height);
    let coarse_width = coarse.width;
    coarse.sum_bands(|first, band| {
        let mut sum = vec![0.0; width];
        for (line, values) in band.chunks_mut(coarse_width).enumerate() {
            let (y, channel) = (first + line / 3, line % 3);
            let rows = 2 * y..(2 * y + 2).min(height);
            for (k, fine) in rows.enumerate() {
                swept_residual(stencil, step, b, fine, channel, &mut sum, k > 0);
            }
            let pairs = sum.chunks_exact(2);
            let rest = pairs.remainder();
            for (value, pair) in values.iter_mut().zip(pairs) {
                *value = pair[0] + pair[1];
            }
            if let ([rest], Some(last)) = (rest, values.last_mut()) {
                *last = *rest;
            }
        }
        [0.0; 3]
    });
}

/// One row of the residual after the first sweep, added to what is there or in its place.
#[inline]
fn swept_residual(stencil: &Stencil, step: &[f32], b: &Field, y: usize, channel: usize, out: &mut [f32], add: bool) {
    let n = stencil.width;
    let (up, down) = (y.saturating_sub(1), (y + 1).min(stencil.height - 1));
    let (above, below) = (&stencil.line(&stencil.wy, y)[..n], &stencil.line(&stencil.wy, y + 1)[..n]);
    let wx = &stencil.line(&stencil.wx, y)[..n];
    let (here, step_here) = (&b.row(y, channel)[..n], &stencil.line(step, y)[..n]);
    let (b_up, step_up) = (&b.row(up, channel)[..n], &stencil.line(step, up)[..n]);
    let (b_down, step_down) = (&b.row(down, channel)[..n], &stencil.line(step, down)[..n]);
    let out = &mut out[..n];
    let column = |i: usize| (1.0 - DAMPING) * here[i] + above[i] * (step_up[i] * b_up[i]) + below[i] * (step_down[i] * b_down[i]);
    let right = |i: usize| wx[i] * (step_here[i + 1] * here[i + 1]);
    let left = |i: usize| wx[i - 1] * (step_here[i - 1] * here[i - 1]);
    let base = |out: f32| if add { out } else { 0.0 };
    if n == 1 {
        out[0] = base(out[0]) + column(0);
        return;
    }
    out[0] = base(out[0]) + column(0) + right(0);
    out[n - 1] = base(out[n - 1]) + column(n - 1) + left(n - 1);
    if add {
        for i in 1..n - 1 {
            out[i] += column(i) + (right(i) + left(i));
        }
    } else {
        for i in 1..n - 1 {
            out[i] = column(i) + (right(i) + left(i));
        }
    }
}

/// z = the first sweep from zero, the coarse level's correction and the last sweep; returns ⟨b, z⟩ by channel.
fn correct(stencil: &Stencil, step: &[f32], b: &Field, coarse: &Field, z: &mut Field) -> [f64; 3] {
    let (width, height) = (stencil.width, stencil.height);
    z.sum_bands(|first, band| {
        let rows = band.len() / (3 * width);
        // Rows of the image before the last sweep, by y mod 4.
        let mut ring: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; width]);
        let mut sums = [0.0; 3];
        for channel in 0..3 {
            for y in [first.saturating_sub(1), first] {
                swept_row(stencil, step, b, coarse, y, channel, &mut ring[y % 4]);
            }
            for line in 0..rows {
                let y = first + line;
                let (up, down) = (y.saturating_sub(1), (y + 1).min(height - 1));
                if down > y {
                    swept_row(stencil, step, b, coarse, down, channel, &mut ring[down % 4]);
                }
                let out = &mut band[(3 * line + channel) * width..][..width];
                last_sweep(stencil, step, b, [&ring[up % 4], &ring[y % 4], &ring[down % 4]], y, channel, out);
                sums[channel] += dot(out, b.row(y, channel));
            }
        }
        sums
    })
}

/// One row of the image after the first sweep and the coarse correction.
#[inline]
fn swept_row(stencil: &Stencil, step: &[f32], b: &Field, coarse: &Field, y: usize, channel: usize, out: &mut [f32]) {
    let n = stencil.width;
    for (pair, correction) in out.chunks_mut(2).zip(coarse.row(y / 2, channel)) {
        pair.fill(*correction);
    }
    let (b, step, out) = (&b.row(y, channel)[..n], &stencil.line(step, y)[..n], &mut out[..n]);
    for i in 0..n {
        out[i] += step[i] * b[i];
    }
}

/// One row of x + S (b − A x) = (1 − ω) x + S (b + W x), given the rows of x above, here and below.
#[inline]
fn last_sweep(stencil: &Stencil, step: &[f32], b: &Field, [up, here, down]: [&[f32]; 3], y: usize, channel: usize, out: &mut [f32]) {
    let n = stencil.width;
    let (above, below) = (&stencil.line(&stencil.wy, y)[..n], &stencil.line(&stencil.wy, y + 1)[..n]);
    let wx = &stencil.line(&stencil.wx, y)[..n];
    let (b, step) = (&b.row(y, channel)[..n], &stencil.line(step, y)[..n]);
    let (up, here, down, out) = (&up[..n], &here[..n], &down[..n], &mut out[..n]);
    let column = |i: usize| b[i] + above[i] * up[i] + below[i] * down[i];
    let value = |i: usize, sum: f32| (1.0 - DAMPING) * here[i] + step[i] * sum;
    if n == 1 {
        out[0] = value(0, column(0));
        return;
    }
    out[0] = value(0, column(0) + wx[0] * here[1]);
    for i in 1..n - 1 {
        out[i] = value(i, column(i) + (wx[i] * here[i + 1] + wx[i - 1] * here[i - 1]));
    }
    out[n - 1] = value(n - 1, column(n - 1) + wx[n - 2] * here[n - 2]);
}

fn set_steps(stencil: &Stencil, steps: &mut [f32]) {
    steps.par_chunks_mut(stencil.width).enumerate().for_each(|(y, steps)| {
        stencil.diagonal(y, steps);
        steps.iter_mut().for_each(|v| *v = DAMPING / *v);
    });
}

fn coarsen(fine: &Stencil, coarse: &mut Stencil) {
    let (w, h) = (fine.width, fine.height);
    let width = coarse.width;
    coarse.screen.par_chunks_mut(width).zip(coarse.wx.par_chunks_mut(width)).enumerate().for_each(|(y, (screen, wx))| {
        screen.fill(0.0);
        wx.fill(0.0);
        for row in 2 * y..(2 * y + 2).min(h) {
            let (fine_screen, fine_wx) = (fine.line(&fine.screen, row), fine.line(&fine.wx, row));
            for x in 0..width {
                screen[x] += fine_screen[2 * x];
                if 2 * x + 1 < w {
                    screen[x] += fine_screen[2 * x + 1];
                    wx[x] += 0.5 * fine_wx[2 * x + 1];
                }
            }
        }
    });
    // Edges from above: those of the even rows, summed over two columns. The first and the last stay zero.
    let rows = coarse.height;
    for y in 1..rows {
        let fine_wy = fine.line(&fine.wy, 2 * y);
        for (x, weight) in coarse.wy[y * width..(y + 1) * width].iter_mut().enumerate() {
            *weight = 0.5 * (fine_wy[2 * x] + fine_wy.get(2 * x + 1).copied().unwrap_or(0.0));
        }
    }
}
