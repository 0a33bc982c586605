//! Films of test scenes, and whether estimates over seeds agree.

use crate::film::{Film, FrameFold, Image, TileFold};
use crate::lattice::Moment;
use crate::plan::{Plan, WorkUnit};
use crate::render::render_unit;
use crate::scene::{Instants, Scene};
use rayon::prelude::*;

/// Renders a frame in small tiles.
pub(crate) fn render(scene: &Scene, plan: &Plan) -> Film {
    render_moment(&scene.into(), plan, Moment::of(0))
}

/// Renders a moment in small tiles.
pub(crate) fn render_moment(scene: &Instants, plan: &Plan, moment: Moment) -> Film {
    let layout = plan.layout();
    let mut frame = FrameFold::new(plan.extent, &layout);
    let folds: Vec<TileFold> = plan
        .extent
        .tiles(plan.grain().max(2))
        .into_par_iter()
        .map(|tile| {
            let mut fold = TileFold::new(tile, &layout);
            for samples in plan.sample_ranges() {
                fold.add(&render_unit(scene.clone(), plan, &WorkUnit { moment, tile, samples })).unwrap();
            }
            fold
        })
        .collect();
    for fold in &folds {
        frame.place(fold).unwrap();
    }
    frame.finish().unwrap()
}

/// Means over independent seeds with the variance of that mean, per value.
pub(crate) struct Estimate {
    mean: Vec<f64>,
    variance: Vec<f64>,
}

impl Estimate {
    pub(crate) fn of(runs: &[Vec<f32>]) -> Self {
        let n = runs.len() as f64;
        let values = runs[0].len();
        let mean: Vec<f64> = (0..values).map(|k| runs.iter().map(|r| f64::from(r[k])).sum::<f64>() / n).collect();
        let variance =
            (0..values).map(|k| runs.iter().map(|r| (f64::from(r[k]) - mean[k]).powi(2)).sum::<f64>() / (n * (n - 1.0))).collect();
        Estimate { mean, variance }
    }
}

/// z-scores of the difference of two independent estimates, zero variances left out.
pub(crate) fn z_scores(a: &Estimate, b: &Estimate) -> Vec<f64> {
    (0..a.mean.len())
        .filter_map(|k| {
            let v = a.variance[k] + b.variance[k];
            (v > 0.0).then(|| (a.mean[k] - b.mean[k]) / v.sqrt())
        })
        .collect()
}

/// Holds two independent estimates of about 24 seeds against each other.
///
/// z is t-distributed with about 46 degrees: at a Šidák-corrected 10⁻³ over 20,000 values |z| stays below 5.9. Of 168 values, three channels
/// each go together, so that the mean square spreads by about √(2 / 56) = 0.2 around 1.04: 1.9 leaves it four times that.
pub(crate) fn agree(name: &str, a: &Estimate, b: &Estimate) {
    let z = z_scores(a, b);
    let worst = z.iter().fold(0.0f64, |w, z| w.max(z.abs()));
    let n = z.len() as f64;
    let mean = z.iter().sum::<f64>() / n;
    let spread = z.iter().map(|z| z * z).sum::<f64>() / n;
    eprintln!("{name}: worst |z| {worst:.2}, mean {mean:.3}, mean square {spread:.3} over {n}");
    assert!(worst < 5.9, "{name}: worst z {worst}");
    assert!(spread < 1.9, "{name}: mean square z {spread}");
}

/// The measured differences to the next column, or to the next row.
pub(crate) fn gradients(film: &Film, vertical: bool) -> Vec<f32> {
    let g = film.combined().gradients.unwrap();
    if vertical { g.dy.data().to_vec() } else { g.dx.data().to_vec() }
}

/// The same, taken from an image; zero where there is no next pixel.
pub(crate) fn finite_differences(image: &Image, vertical: bool) -> Vec<f32> {
    let extent = image.extent();
    let mut out = Vec::new();
    for c in 0..3 {
        for y in 0..extent.height {
            for x in 0..extent.width {
                let (nx, ny) = if vertical { (x, y + 1) } else { (x + 1, y) };
                let inside = nx < extent.width && ny < extent.height;
                out.push(if inside { image.at(nx, ny, c) - image.at(x, y, c) } else { 0.0 });
            }
        }
    }
    out
}
