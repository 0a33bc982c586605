//! A multigrid V-cycle for the weighted screened Poisson operator: the preconditioner of conjugate gradients.
//!
//! Each level joins 2×2 pixels; a coarse edge weighs half the sum of the fine edges that it stands for, which is what constant
//! interpolation over twice the distance calls for. Smoothing is one damped Jacobi sweep before and one after the coarse step, so the cycle is symmetric.
//!
//! # Source
//! Trottenberg, Oosterlee and Schüller, "Multigrid", 2001, sections 2 and 7; aggregation scaling by Braess, Computing 55, 1995.

use super::field::{Field, Row};
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
    x: Field,
    /// Right-hand side and answer of this level; empty on the finest one.
    b: Field,
    z: Field,
}

/// Damping of Jacobi: 4/5 smooths best for five points.
const DAMPING: f32 = 0.8;
/// Pairs of sweeps on the coarsest level, which has at most a few pixels.
const COARSEST_SWEEPS: usize = 12;
/// Pixels of the coarsest level at most.
const COARSEST: usize = 4;

impl Hierarchy {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let mut levels = vec![Level { x: Field::new(width, height), step: vec![0.0; width * height], ..Level::default() }];
        let (mut w, mut h) = (width, height);
        while w * h > COARSEST {
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
            let field = || Field::new(w, h);
            levels.push(Level { stencil: Stencil::new(w, h), step: vec![0.0; w * h], x: field(), b: field(), z: field() });
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
    fn precondition(&mut self, r: &Field, z: &mut Field) {
        cycle(self.stencil, &mut self.hierarchy.levels, r, z);
    }
}

fn cycle(stencil: &Stencil, levels: &mut [Level], b: &Field, z: &mut Field) {
    let Some((level, coarser)) = levels.split_first_mut() else { return };
    let width = stencil.width;
    // From zero, one sweep is a division by the diagonal.
    let (x, step) = (&mut level.x, &level.step);
    x.each_row(|Row { y, channel, values }| {
        let (b, step) = (b.row(y, channel), &step[y * width..(y + 1) * width]);
        for (x, (b, step)) in values.iter_mut().zip(b.iter().zip(step)) {
            *x = step * b;
        }
    });
    let Some(next) = coarser.first_mut() else {
        for _ in 0..COARSEST_SWEEPS {
            smooth(stencil, step, b, x, z);
            smooth(stencil, step, b, z, x);
        }
        smooth(stencil, step, b, x, z);
        return;
    };
    let next_stencil = std::mem::take(&mut next.stencil);
    let (mut next_b, mut next_z) = (std::mem::take(&mut next.b), std::mem::take(&mut next.z));
    restrict(stencil, b, x, &mut next_b);
    cycle(&next_stencil, coarser, &next_b, &mut next_z);
    x.each_row(|Row { y, channel, values }| {
        let coarse = next_z.row(y / 2, channel);
        for (pair, correction) in values.chunks_mut(2).zip(coarse) {
            pair.iter_mut().for_each(|x| *x += correction);
        }
    });
    if let Some(next) = coarser.first_mut() {
        (next.stencil, next.b, next.z) = (next_stencil, next_b, next_z);
    }
    smooth(stencil, step, b, x, z);
}

/// out = x + ω D⁻¹ (b − A x).
fn smooth(stencil: &Stencil, step: &[f32], b: &Field, x: &Field, out: &mut Field) {
    out.each_row(|Row { y, channel, values }| {
        stencil.apply_row(x, y, channel, values);
        let (b, x, step) = (b.row(y, channel), x.row(y, channel), stencil.line(step, y));
        for i in 0..values.len() {
            values[i] = x[i] + step[i] * (b[i] - values[i]);
        }
    });
}

/// Sums the residual over 2×2 pixels.
fn restrict(stencil: &Stencil, b: &Field, x: &Field, coarse: &mut Field) {
    let (width, height) = (stencil.width, stencil.height);
    coarse.each_row(|Row { y, channel, values }| {
        let mut residual = vec![0.0; width];
        values.fill(0.0);
        for fine in 2 * y..(2 * y + 2).min(height) {
            stencil.apply_row(x, fine, channel, &mut residual);
            let b = b.row(fine, channel);
            for (sum, (b, ax)) in values.iter_mut().zip(b.chunks(2).zip(residual.chunks(2))) {
                *sum += b.iter().zip(ax).map(|(b, ax)| b - ax).sum::<f32>();
            }
        }
    });
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
