//! The window's operator where it is alike in all pixels: diagonal by cosine transforms of each moment, then a tridiagonal system in time for
//! every mode of the lattice.
//!
//! With λ the eigenvalue of ∇ᵀ∇ in a mode, the coefficients of the moments are coupled by α² + λ on the diagonal and by w_t² + w_m² λ between
//! each moment and the next. That is the three-dimensional cosine transform where all pairs have the same weights, and takes others too.

use super::super::dct::Dct2;
use super::super::l2::eigenvalues;
use super::weights::TYPICAL;
use rayon::prelude::*;

/// The weights of a window that are alike in all pixels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Uniform {
    /// α².
    pub(super) screen: f64,
    /// Of each moment and the next: w_t² and w_m².
    pub(super) pairs: Vec<[f64; 2]>,
}

impl Uniform {
    /// Differences in time count as much as those in space.
    pub(super) fn typical(alpha: f32, pairs: usize) -> Self {
        Self { screen: f64::from(alpha) * f64::from(alpha), pairs: vec![[TYPICAL; 2]; pairs] }
    }
}

/// The inverse of that operator.
pub(super) struct Spectral {
    transform: Dct2,
    along_x: Vec<f64>,
    along_y: Vec<f64>,
    weights: Uniform,
}

impl Spectral {
    pub(super) fn new(width: usize, height: usize, weights: Uniform) -> Self {
        Self { transform: Dct2::new(width, height), along_x: eigenvalues(width), along_y: eigenvalues(height), weights }
    }

    /// Solves for one channel of all moments in place, row-major images. There is a pair fewer than there are moments.
    pub(super) fn solve(&self, moments: &mut [Vec<f64>]) {
        let mut spare = Vec::new();
        for moment in moments.iter_mut() {
            self.transform.forward(moment, &mut spare);
        }
        // Transposed: columns of the image are rows here.
        let height = self.along_y.len();
        let mut columns: Vec<_> = moments.iter_mut().map(|moment| moment.chunks_mut(height)).collect();
        let slices: Vec<Vec<&mut [f64]>> = self.along_x.iter().map(|_| columns.iter_mut().filter_map(Iterator::next).collect()).collect();
        slices.into_par_iter().zip(&self.along_x).for_each(|(mut slices, ex)| self.in_time(&mut slices, *ex));
        for moment in moments.iter_mut() {
            self.transform.inverse(moment, &mut spare);
        }
    }

    /// Elimination without pivots (the system is dominated by its diagonal) for the modes of one column.
    fn in_time(&self, moments: &mut [&mut [f64]], ex: f64) {
        let pairs = &self.weights.pairs;
        let link = |pair: Option<&[f64; 2]>, mode: f64| pair.map_or(0.0, |[value, slope]| value + slope * mode);
        let height = self.along_y.len();
        // For each moment and mode: what the next moment's value counts in it.
        let mut ratios = vec![0.0; moments.len() * height];
        for t in 0..moments.len() {
            let (done, rest) = moments.split_at_mut(t);
            let (ratios_before, ratios) = ratios.split_at_mut(t * height);
            let ratios_before = &ratios_before[t.saturating_sub(1) * height..];
            for (j, ey) in self.along_y.iter().enumerate() {
                let mode = ex + ey;
                let ahead = link(pairs.get(t), mode);
                let mut pivot = self.weights.screen + mode + ahead;
                let mut value = rest[0][j];
                if let Some(before) = done.last() {
                    let back = link(pairs.get(t - 1), mode);
                    pivot += back * (1.0 - ratios_before[j]);
                    value += back * before[j];
                }
                rest[0][j] = value / pivot;
                ratios[j] = ahead / pivot;
            }
        }
        for t in (1..moments.len()).rev() {
            let (done, rest) = moments.split_at_mut(t);
            for (j, here) in done[t - 1].iter_mut().enumerate() {
                *here += ratios[(t - 1) * height + j] * rest[0][j];
            }
        }
    }
}
