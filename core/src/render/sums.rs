//! Sums of one pixel over the samples of a unit, in f64, and the planes that they fill.

use super::outcome::finite;
use crate::film::{Counter, FilmBlock, PlaneKind, Statistics};
use crate::lattice::{Half, Offset, Tile};
use crate::path::Subpath;
use crate::plan::WorkUnit;
use crate::spectrum::Spectrum;

/// Everything that is summed for a pixel.
#[derive(Default)]
pub(super) struct PixelSums {
    pub(super) halves: [HalfSums; 2],
    pub(super) albedo: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) depth: [f64; 3],
    /// Displacement to where the pixel's surface was before, and 1 where it was seen there.
    pub(super) motion: [f64; 3],
    /// One entry a link, by slot.
    pub(super) links: Vec<LinkSums>,
}

/// What is summed along one link.
#[derive(Default)]
pub(super) struct LinkSums {
    /// To the linked pixel, from this one (columns, rows).
    pub(super) to: [i64; 2],
    /// Sum of `to` over samples.
    displacement: [f64; 3],
    /// By half.
    gradient: [[f64; 3]; 2],
    /// By half.
    gradient_squared: [[f64; 3]; 2],
}

impl LinkSums {
    /// A link to the pixel that lies so many columns and rows on.
    pub(super) fn new(to: [i64; 2]) -> Self {
        Self { to, ..Self::default() }
    }

    /// Counts a sample.
    pub(super) fn see(&mut self) {
        for (sum, d) in self.displacement.iter_mut().zip(self.to) {
            *sum += d as f64;
        }
    }

    /// Adds a sample's difference.
    pub(super) fn add_gradient(&mut self, half: Half, difference: Spectrum) {
        add(&mut self.gradient[half.index()], difference);
        self.gradient_squared[half.index()][0] += square_sum(difference);
    }

    /// The sums behind a plane of links.
    fn of(&self, kind: PlaneKind) -> &[f64; 3] {
        match kind {
            PlaneKind::LinkGradient(h, _) => &self.gradient[h.index()],
            PlaneKind::LinkGradientSquared(h, _) => &self.gradient_squared[h.index()],
            _ => &self.displacement,
        }
    }
}

/// Sum of the squares of the channels, in f64: the square of a radiance may lie beyond f32.
fn square_sum(value: Spectrum) -> f64 {
    value.to_rgb().into_iter().map(|v| f64::from(v) * f64::from(v)).sum()
}

/// What an empty slot sums up to.
const NOTHING: [f64; 3] = [0.0; 3];

/// What each half of the film has of its own.
#[derive(Default)]
pub(super) struct HalfSums {
    pub(super) count: [f64; 3],
    pub(super) primal: [f64; 3],
    pub(super) primal_squared: [f64; 3],
    pub(super) direct: [f64; 3],
    pub(super) gradient: [[f64; 3]; 4],
    pub(super) gradient_squared: [[f64; 3]; 4],
}

impl PixelSums {
    /// Counts a sample and adds what the camera sees of its base path: what gives light by itself, and the features of what stands there.
    pub(super) fn see(&mut self, half: Half, base: &Subpath, weight: f32, statistics: &mut Statistics) {
        let sums = &mut self.halves[half.index()];
        sums.count[0] += 1.0;
        add(&mut sums.direct, finite(base.direct * weight, Counter::NotFiniteDirect, statistics));
        // Features only guide, and go without the pixel filter's weight: they would gain noise from negative lobes.
        if let Some(first) = base.first {
            add(&mut self.albedo, first.albedo);
            for (sum, n) in self.normal.iter_mut().zip(first.normal.to_array()) {
                *sum += f64::from(n);
            }
            self.depth[0] += f64::from(first.depth);
        }
    }

    /// Counts where the pixel's surface was before, as the pixel that saw it there.
    pub(super) fn follow(&mut self, place: [u32; 2], partner: [u32; 2]) {
        let by = |axis: usize| f64::from(partner[axis]) - f64::from(place[axis]);
        self.motion.iter_mut().zip([by(0), by(1), 1.0]).for_each(|(sum, v)| *sum += v);
    }

    /// The sums behind a plane, and how many of the three are used.
    pub(super) fn of(&self, kind: PlaneKind) -> (&[f64; 3], usize) {
        let sums = match kind {
            PlaneKind::Primal(h) => &self.halves[h.index()].primal,
            PlaneKind::PrimalSquared(h) => &self.halves[h.index()].primal_squared,
            PlaneKind::Direct(h) => &self.halves[h.index()].direct,
            PlaneKind::Gradient(h, o) => &self.halves[h.index()].gradient[o.index()],
            PlaneKind::GradientSquared(h, o) => &self.halves[h.index()].gradient_squared[o.index()],
            PlaneKind::Albedo => &self.albedo,
            PlaneKind::Normal => &self.normal,
            PlaneKind::Depth => &self.depth,
            PlaneKind::Motion => &self.motion,
            PlaneKind::Count(h) => &self.halves[h.index()].count,
            PlaneKind::Link(slot) | PlaneKind::LinkGradient(_, slot) | PlaneKind::LinkGradientSquared(_, slot) => {
                self.links.get(usize::from(slot)).map_or(&NOTHING, |link| link.of(kind))
            }
        };
        (sums, kind.channels())
    }
}

impl HalfSums {
    /// Adds a sample's estimate.
    #[inline]
    pub(super) fn add_primal(&mut self, primal: Spectrum) {
        add(&mut self.primal, primal);
        // In f64: the square of a radiance may lie beyond f32.
        for (sum, v) in self.primal_squared.iter_mut().zip(primal.to_rgb()) {
            *sum += f64::from(v) * f64::from(v);
        }
    }

    /// Adds a sample's estimate of the difference across a step.
    #[inline]
    pub(super) fn add_gradient(&mut self, step: Offset, difference: Spectrum) {
        add(&mut self.gradient[step.index()], difference);
        self.gradient_squared[step.index()][0] += square_sum(difference);
    }
}

/// The planes of a block, while its pixels come in.
pub(super) struct Planes {
    tile: Tile,
    planes: Vec<(PlaneKind, Vec<f32>)>,
}

impl Planes {
    /// All zero.
    pub(super) fn new(tile: Tile, layout: &[PlaneKind]) -> Self {
        Self { tile, planes: layout.iter().map(|kind| (*kind, vec![0.0; tile.pixels() * kind.channels()])).collect() }
    }

    /// Writes the sums of the tile's pixel of this index.
    pub(super) fn write(&mut self, index: usize, sums: &PixelSums) {
        let pixels = self.tile.pixels();
        for (kind, values) in &mut self.planes {
            let (sum, channels) = sums.of(*kind);
            for channel in 0..channels {
                // A sum beyond f32 (of squares, before all) becomes the largest number there is: a block holds none that is not finite.
                values[channel * pixels + index] = sum[channel].clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
            }
        }
    }

    pub(super) fn into_block(self, unit: &WorkUnit, statistics: Statistics) -> FilmBlock {
        FilmBlock { tile: self.tile, samples: unit.samples, planes: self.planes, statistics }
    }
}

/// Adds a colour.
#[inline]
fn add(sum: &mut [f64; 3], value: Spectrum) {
    for (sum, v) in sum.iter_mut().zip(value.to_rgb()) {
        *sum += f64::from(v);
    }
}
