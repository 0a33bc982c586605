//! Variances of measurements made fit for weights: summed over channels, smoothed over pixels, kept above a floor.

use super::Variance;
use super::normal::Weights;
use super::smooth::smoothed;
use rayon::prelude::*;

/// Variances per pixel of the primal and of its differences to the next column and row, each with a floor already added.
pub(super) struct Variances {
    width: usize,
    primal: Vec<f32>,
    dx: Vec<f32>,
    dy: Vec<f32>,
    /// What weights are multiplied by so that they lie within (0, 1].
    pub(super) scale: f32,
    /// The floor of the variances of differences, mean of columns and rows.
    pub(super) floor: f64,
}

/// Pixels to each side that a variance is averaged over. Less follows the noise of the variances, more crosses the edges of what they differ
/// for: of 0 to 9, 1 to 5 were within a few percent of the least error on scenes of one to a thousand samples, and on either side it rose.
pub(super) const RADIUS: usize = 3;
/// The floor of the variances of one kind of measurements over the square of their mean standard deviation: pixels that look free of noise
/// count up to a few times as much as the average, not without limit. It scales with the noise, so neither exposure nor samples matter.
const FLOOR: f64 = 1.0;
/// The least floor over the largest one of the three kinds.
const LEAST: f64 = 1e-6;

impl Variances {
    /// Of one film. Where nothing at all varies, all weights are alike.
    pub(super) fn new(variance: &Variance) -> Self {
        let extent = variance.primal.extent();
        let (width, height) = (extent.width as usize, extent.height as usize);
        let (r, g, b) = (variance.primal.plane(0), variance.primal.plane(1), variance.primal.plane(2));
        let mut planes = [
            r.iter().zip(g.iter().zip(b)).map(|(r, (g, b))| r + g + b).collect(),
            variance.dx.plane(0).to_vec(),
            variance.dy.plane(0).to_vec(),
        ];
        let floors = planes.each_ref().map(|plane: &Vec<f32>| FLOOR * mean_deviation(plane).powi(2));
        let mut added = 0.0;
        let largest = floors.into_iter().fold(0.0, f64::max);
        for (k, (plane, floor)) in planes.iter_mut().zip(floors).enumerate() {
            *plane = smoothed(plane, width, height, RADIUS);
            let floor: f64 = if largest > 0.0 { floor.max(LEAST * largest).max(f64::from(f32::MIN_POSITIVE)) } else { 1.0 };
            added += if k > 0 { 0.5 * floor } else { 0.0 };
            plane.par_iter_mut().for_each(|v| *v = (f64::from(v.max(0.0)) + floor).min(f64::from(f32::MAX)) as f32);
        }
        let scale = planes.iter().flatten().fold(f32::INFINITY, |least, v| least.min(*v));
        let [primal, dx, dy] = planes;
        Self { width, primal, dx, dy, scale, floor: added }
    }

    /// Columns, and the variances of the primal, of dx and of dy.
    pub(super) fn into_planes(self) -> (usize, [Vec<f32>; 3]) {
        (self.width, [self.primal, self.dx, self.dy])
    }

    /// Weights of row y; the primal's times α².
    pub(super) fn weigh(&self, y: usize, alpha: f32, row: Weights) {
        let line = y * self.width..(y + 1) * self.width;
        let set = |out: &mut [f32], variances: &[f32], factor: f32| {
            for (out, v) in out.iter_mut().zip(variances) {
                *out = factor * (self.scale / v);
            }
        };
        set(row.screen, &self.primal[line.clone()], alpha * alpha);
        set(row.wx, &self.dx[line.clone()], 1.0);
        set(row.wy, &self.dy[line], 1.0);
    }
}

pub(super) fn mean_deviation(variances: &[f32]) -> f64 {
    variances.iter().map(|v| f64::from(v.max(0.0)).sqrt()).sum::<f64>() / variances.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Image;
    use crate::lattice::Extent;

    #[test]
    fn weights_do_not_depend_on_exposure_and_stay_in_bounds() {
        let extent = Extent { width: 9, height: 7 };
        let of = |exposure: f32| {
            let plane = |channels: usize, k: usize| {
                let values = (0..63 * channels).map(|i| exposure * exposure * ((i * k) % 17) as f32).collect();
                Image::from_planes(extent, channels, values).unwrap()
            };
            let (primal, dx, dy) = (plane(3, 5), plane(1, 7), plane(1, 11));
            let variances = Variances::new(&Variance { primal: &primal, dx: &dx, dy: &dy });
            let (mut screen, mut wx, mut wy) = (vec![0.0; 9], vec![0.0; 9], vec![0.0; 9]);
            variances.weigh(3, 1.0, Weights { screen: &mut screen, wx: &mut wx, wy: &mut wy });
            [screen, wx, wy].concat()
        };
        let usual = of(1.0);
        assert!(usual.iter().all(|w| *w > 0.0 && *w <= 1.0));
        for exposure in [1e-12f32, 1e-3, 1e6] {
            for (a, b) in of(exposure).iter().zip(&usual) {
                assert!((a - b).abs() <= 1e-4 * b, "{a} against {b} at exposure {exposure}");
            }
        }
        assert!(of(0.0).iter().all(|w| *w == 1.0));
    }
}
