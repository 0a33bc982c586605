//! A multigrid V-cycle for the weighted screened Poisson operator: the preconditioner of conjugate gradients.
//!
//! Each level joins 2×2 pixels; a coarse edge weighs half the sum of the fine edges that it stands for, which is what constant
//! interpolation over twice the distance calls for. Smoothing is damped Jacobi, as often before as after the coarse step, so the cycle is symmetric.
//!
//! # Source
//! Trottenberg, Oosterlee and Schüller, "Multigrid", 2001, sections 2 and 7; aggregation scaling by Braess, Computing 55, 1995.

use super::solver::Stencil;

/// Levels from fine to coarse, with scratch.
pub(super) struct Hierarchy {
    levels: Vec<Level>,
}

struct Level {
    stencil: Stencil,
    inverse_diagonal: Vec<f32>,
    x: Vec<f32>,
    b: Vec<f32>,
    r: Vec<f32>,
}

/// Jacobi sweeps before and after the coarse step.
const SWEEPS: usize = 2;
/// Damping of Jacobi: 4/5 smooths best for five points.
const DAMPING: f32 = 0.8;
/// Sweeps on the coarsest level, which has at most a few pixels.
const COARSEST_SWEEPS: usize = 24;

impl Hierarchy {
    pub(super) fn new(stencil: &Stencil) -> Self {
        let mut levels = vec![Level::new(stencil.clone())];
        while let Some(last) = levels.last()
            && last.stencil.width * last.stencil.height > 4
        {
            let coarse = coarsen(&last.stencil);
            levels.push(Level::new(coarse));
        }
        Self { levels }
    }

    /// z ≈ A⁻¹ r.
    pub(super) fn precondition(&mut self, r: &[f32], z: &mut [f32]) {
        self.levels[0].b.copy_from_slice(r);
        self.cycle(0);
        z.copy_from_slice(&self.levels[0].x);
    }

    fn cycle(&mut self, k: usize) {
        let (fine, coarse) = self.levels.split_at_mut(k + 1);
        let level = &mut fine[k];
        level.x.fill(0.0);
        let Some(next) = coarse.first_mut() else {
            (0..COARSEST_SWEEPS).for_each(|_| level.smooth());
            return;
        };
        (0..SWEEPS).for_each(|_| level.smooth());
        level.stencil.apply(&level.x, &mut level.r);
        for (r, b) in level.r.iter_mut().zip(&level.b) {
            *r = b - *r;
        }
        let (w, h) = (level.stencil.width, level.stencil.height);
        next.b.fill(0.0);
        for y in 0..h {
            for x in 0..w {
                next.b[(y / 2) * next.stencil.width + x / 2] += level.r[y * w + x];
            }
        }
        self.cycle(k + 1);
        let (fine, coarse) = self.levels.split_at_mut(k + 1);
        let (level, next) = (&mut fine[k], &coarse[0]);
        for y in 0..h {
            for x in 0..w {
                level.x[y * w + x] += next.x[(y / 2) * next.stencil.width + x / 2];
            }
        }
        (0..SWEEPS).for_each(|_| level.smooth());
    }
}

impl Level {
    fn new(stencil: Stencil) -> Self {
        let n = stencil.width * stencil.height;
        let inverse_diagonal = (0..n).map(|i| 1.0 / stencil.diagonal(i % stencil.width, i / stencil.width)).collect();
        Self { stencil, inverse_diagonal, x: vec![0.0; n], b: vec![0.0; n], r: vec![0.0; n] }
    }

    fn smooth(&mut self) {
        self.stencil.apply(&self.x, &mut self.r);
        for i in 0..self.x.len() {
            self.x[i] += DAMPING * self.inverse_diagonal[i] * (self.b[i] - self.r[i]);
        }
    }
}

fn coarsen(fine: &Stencil) -> Stencil {
    let (w, h) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let mut coarse = Stencil { width: w, height: h, screen: vec![0.0; w * h], wx: vec![0.0; w * h], wy: vec![0.0; w * h] };
    for y in 0..fine.height {
        for x in 0..fine.width {
            let (i, j) = (y * fine.width + x, (y / 2) * w + x / 2);
            coarse.screen[j] += fine.screen[i];
            if x % 2 == 1 {
                coarse.wx[j] += 0.5 * fine.wx[i];
            }
            if y % 2 == 1 {
                coarse.wy[j] += 0.5 * fine.wy[i];
            }
        }
    }
    coarse
}
