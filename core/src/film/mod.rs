//! The film: what units of work measure, and how their sums become one frame.
//!
//! `plane` names the buffers, `block` is the result of one unit, `fold` adds blocks in a fixed order into a `Film`, `cut` takes pieces out of it, `graph`
//! joins what linked pixels measured, `gaps` continues it where nothing was measured, `noise` says how much a further sample of each pixel would help.
//! Nothing here knows how the values were estimated.

mod block;
mod cut;
mod fold;
mod gaps;
mod graph;
mod image;
mod noise;
mod plane;
mod statistics;

pub use block::{BlockError, FilmBlock};
pub use fold::{FoldError, FrameFold, TileFold};
pub use graph::{Graph, LinkError};
pub use image::Image;
pub use noise::Noise;
pub use plane::PlaneKind;
pub use statistics::{Counter, Statistics};

use crate::lattice::Extent;
use rayon::prelude::*;

/// Means of one frame, ready to be reconstructed.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Size [pixels].
    pub extent: Extent,
    /// The two independent halves, A and B.
    pub halves: [HalfFilm; 2],
    /// Samples of each pixel, both halves together, where pixels differ in that. One channel.
    pub counts: Option<Image>,
    /// Where each pixel's surface was in the moment before, where motion is followed: displacement (columns, rows) [pixels] to the pixel
    /// that saw it there, and 1 where there is one. Three channels.
    pub motion: Option<Image>,
    /// Features of the first surface.
    pub features: Features,
    /// Sum over all units.
    pub statistics: Statistics,
}

/// Means of one half. Variances are of the *mean*, estimated from the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfFilm {
    /// Samples per pixel in this half; their mean where pixels differ.
    pub samples: u32,
    /// Radiance without directly visible emission. RGB.
    pub primal: Image,
    /// Variance of `primal`. RGB.
    pub primal_variance: Image,
    /// Directly visible emission. RGB.
    pub direct: Image,
    /// Differences to the next pixel, where the technique measures them.
    pub gradients: Option<Gradients>,
    /// Differences along links between similar pixels, where the technique measures them.
    pub graph: Option<Graph>,
}

/// Forward differences: `dx(x, y)` estimates I(x+1, y) − I(x, y), `dy(x, y)` estimates I(x, y+1) − I(x, y). The last column of
/// `dx` and the last row of `dy` are zero: there is no such pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradients {
    /// Along columns. RGB.
    pub dx: Image,
    /// Along rows. RGB.
    pub dy: Image,
    /// Variance of `dx`, summed over RGB. One channel.
    pub dx_variance: Image,
    /// Variance of `dy`, summed over RGB. One channel.
    pub dy_variance: Image,
}

/// Features of the first surface, means over all samples of both halves.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    /// RGB.
    pub albedo: Image,
    /// World space, XYZ; not normalised.
    pub normal: Image,
    /// Distance along the ray. One channel.
    pub depth: Image,
}

impl Film {
    /// Means over both halves together, weighted by the samples that the plan gives each. Where pixels differ in their counts the weights
    /// stay the same for all: each half's counts depend on the other's values, and weights that did would bias the mean.
    pub fn combined(&self) -> HalfFilm {
        let [a, b] = &self.halves;
        let n = f64::from(a.samples) + f64::from(b.samples);
        let (wa, wb) = if n > 0.0 { (f64::from(a.samples) / n, f64::from(b.samples) / n) } else { (0.0, 0.0) };
        let mean = |x: &Image, y: &Image| blend(x, y, wa, wb);
        let variance = |x: &Image, y: &Image| blend(x, y, wa * wa, wb * wb);
        let gradients = match (&a.gradients, &b.gradients) {
            (Some(ga), Some(gb)) => Some(Gradients {
                dx: mean(&ga.dx, &gb.dx),
                dy: mean(&ga.dy, &gb.dy),
                dx_variance: variance(&ga.dx_variance, &gb.dx_variance),
                dy_variance: variance(&ga.dy_variance, &gb.dy_variance),
            }),
            _ => None,
        };
        HalfFilm {
            samples: a.samples + b.samples,
            primal: mean(&a.primal, &b.primal),
            primal_variance: variance(&a.primal_variance, &b.primal_variance),
            direct: mean(&a.direct, &b.direct),
            gradients,
            graph: a.graph.as_ref().zip(b.graph.as_ref()).map(|(x, y)| x.blend(y, wa, wb)),
        }
    }
}

/// `wx · x + wy · y`, in f64.
fn blend(x: &Image, y: &Image, wx: f64, wy: f64) -> Image {
    let mut out = x.clone();
    out.data_mut().par_iter_mut().zip(x.data().par_iter().zip(y.data())).for_each(|(o, (p, q))| {
        *o = (wx * f64::from(*p) + wy * f64::from(*q)) as f32;
    });
    out
}
