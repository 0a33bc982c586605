//! One sample of one pixel: its base path, and the difference to each neighbour.

use super::outcome::{finite, tell};
use super::roulette::ShiftRoulette;
use super::sums::PixelSums;
use crate::film::{Counter, Statistics};
use crate::gradient::difference;
use crate::integrator::PathIntegrator;
use crate::lattice::{Half, Moment, Offset};
use crate::path::{Integrator, OffsetSubpath, ShiftMap, Subpath};
use crate::plan::{Plan, Technique};
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::scene::Scene;
use crate::sensor::View;
use crate::shift;
use crate::spectrum::Spectrum;

/// What a thread reuses from sample to sample.
#[derive(Default)]
pub(super) struct Scratch {
    base: Subpath,
    offset: OffsetSubpath,
}

/// Where a sample lies, in its pixel and on the lens.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    film: [f32; 2],
    lens: [f32; 2],
    /// The pixel filter's.
    pub(super) weight: f32,
}

/// Everything that stays the same over a unit.
pub(super) struct PixelRenderer<'a> {
    pub(super) scene: &'a Scene,
    pub(super) plan: &'a Plan,
    view: View,
    moment: Moment,
    integrator: PathIntegrator,
    shift: Box<dyn ShiftMap>,
    roulette: ShiftRoulette,
}

impl<'a> PixelRenderer<'a> {
    pub(super) fn new(scene: &'a Scene, plan: &'a Plan, moment: Moment) -> Self {
        let view = scene.sensor.view(plan.extent);
        let integrator =
            PathIntegrator { max_depth: plan.max_depth, roulette_depth: plan.roulette_depth, shift_threshold: plan.shift_threshold };
        let roulette = ShiftRoulette::new(scene, plan, &view, &integrator);
        Self { scene, plan, view, moment, integrator, shift: shift::build(plan.shift, plan.shift_threshold), roulette }
    }

    /// Traces the base path of a sample with the numbers of pixel `key`; `index` is its index within the half.
    pub(super) fn trace(
        &self,
        [x, y]: [u32; 2],
        key: [u32; 2],
        (half, index): (Half, u32),
        base: &mut Subpath,
        statistics: &mut Statistics,
    ) -> Place {
        let frame = self.moment.key(half);
        let stream = SampleStream::open(SampleKey { seed: self.plan.seed, frame, x: key[0], y: key[1], index });
        // The neighbours' paths take the same place in their pixels, so its weight holds for them too.
        let ([u, v], weight) = self.scene.sensor.filter.place(stream.pair(Dimension::PIXEL));
        let lens = if self.view.has_lens() { stream.pair(Dimension::LENS) } else { [0.5; 2] };
        let place = Place { film: [x as f32 + u, y as f32 + v], lens, weight };
        self.integrator.generate(self.scene, &self.view.ray(place.film, lens), &stream, base);
        statistics.add(Counter::Samples, 1);
        statistics.add(Counter::Rays, u64::from(base.rays));
        statistics.add(Counter::Vertices, base.vertices.len() as u64);
        place
    }

    /// Shifts a base path to the same place in the pixel that lies `dx` columns and `dy` rows on.
    pub(super) fn shift(&self, base: &Subpath, place: &Place, [dx, dy]: [i64; 2], offset: &mut OffsetSubpath) {
        let camera = self.view.ray([place.film[0] + dx as f32, place.film[1] + dy as f32], place.lens);
        self.shift.shift(self.scene, base, &camera, offset);
    }

    /// The probability with which roulette lets a path be shifted that carries this radiance.
    pub(super) fn survival(&self, primal: Spectrum) -> f32 {
        self.roulette.survival(primal)
    }

    /// Adds one sample of a pixel to the sums of its half, with the numbers of pixel `key`; `index` is its index within the half.
    pub(super) fn sample(
        &self,
        [x, y]: [u32; 2],
        key: [u32; 2],
        (half, index): (Half, u32),
        scratch: &mut Scratch,
        sums: &mut PixelSums,
        statistics: &mut Statistics,
    ) {
        let base = &mut scratch.base;
        let place = self.trace([x, y], key, (half, index), base, statistics);
        let weight = place.weight;
        sums.see(half, base, weight, statistics);
        let sums_of_half = &mut sums.halves[half.index()];
        let primal = finite(base.primal() * weight, Counter::NotFinitePrimal, statistics);
        sums_of_half.add_primal(primal);
        if !self.plan.technique.measures_gradients() {
            return;
        }
        let survival = self.survival(primal);
        if self.plan.technique == Technique::Graph {
            for (slot, link) in sums.links.iter_mut().enumerate() {
                link.see();
                if let Some(difference) = self.towards(link.to, slot, &place, survival, scratch, statistics) {
                    link.add_gradient(half, difference);
                }
            }
            return;
        }
        for offset in Offset::IMAGE {
            let (dx, dy) = offset.displacement();
            if !self.plan.extent.contains(i64::from(x) + dx, i64::from(y) + dy) {
                statistics.add(Counter::ShiftOutsideFilm, 1);
                continue;
            }
            if let Some(difference) = self.towards([dx, dy], offset.index(), &place, survival, scratch, statistics) {
                // A backward step measures this − previous: the difference turns its sign.
                sums_of_half.add_gradient(offset, difference * f32::from(offset.step));
            }
        }
    }

    /// The weighted difference from this pixel to the one that lies `to` columns and rows on, by the base path at hand. `None` where
    /// there is nothing to shift or roulette leaves it; `neighbour` names the number that it draws.
    #[inline]
    fn towards(
        &self,
        to: [i64; 2],
        neighbour: usize,
        place: &Place,
        survival: f32,
        scratch: &mut Scratch,
        statistics: &mut Statistics,
    ) -> Option<Spectrum> {
        let Scratch { base, offset } = scratch;
        if base.vertices.is_empty() {
            // The camera saw no surface.
            return None;
        }
        if survival < 1.0 && base.stream.number(Dimension::shift(neighbour)) >= survival {
            statistics.add(Counter::ShiftSkipped, 1);
            return None;
        }
        self.shift(base, place, to, offset);
        let (difference, rays) = difference(self.scene, base, offset);
        statistics.add(Counter::Rays, u64::from(offset.rays + rays));
        tell(self.plan.shift, base, offset, statistics);
        Some(finite(difference * (place.weight / survival), Counter::NotFiniteGradient, statistics))
    }
}
