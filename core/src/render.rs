//! The pure function that the farm maps over units of work.

use crate::film::{Counter, FilmBlock, PlaneKind, Statistics};
use crate::gradient::difference;
use crate::integrator::PathIntegrator;
use crate::lattice::{Half, Offset};
use crate::path::{Integrator, OffsetEnd, OffsetSubpath, ShiftFailure, ShiftMap, Subpath};
use crate::plan::{Plan, WorkUnit};
use crate::sampling::{Dimension, SampleKey, SampleStream};
use crate::scene::Scene;
use crate::sensor::View;
use crate::shift::HybridShift;
use crate::spectrum::Spectrum;

/// Renders one unit: the samples `unit.samples` of each pixel of `unit.tile`.
///
/// Pure: the same scene, plan and unit give the same bits, so a retried unit is the same unit. The pixels of `unit.tile` must
/// lie on the plan's film. Values that are not finite are counted and replaced by zero.
pub fn render_unit(scene: &Scene, plan: &Plan, unit: &WorkUnit) -> FilmBlock {
    let renderer = Renderer::new(scene, plan, unit.frame);
    let layout = plan.layout();
    let mut planes: Vec<(PlaneKind, Vec<f32>)> =
        layout.iter().map(|kind| (*kind, vec![0.0; unit.tile.pixels() * kind.channels()])).collect();
    let mut statistics = Statistics::default();
    let mut scratch = Scratch::default();
    let pixels = unit.tile.pixels();
    for index in 0..pixels {
        let x = unit.tile.x + index as u32 % unit.tile.width;
        let y = unit.tile.y + index as u32 / unit.tile.width;
        let mut sums = PixelSums::default();
        for sample in unit.samples.first..unit.samples.end() {
            renderer.sample(x, y, sample, &mut scratch, &mut sums, &mut statistics);
        }
        for (kind, values) in &mut planes {
            let (sum, channels) = sums.of(*kind);
            for channel in 0..channels {
                values[channel * pixels + index] = sum[channel] as f32;
            }
        }
    }
    FilmBlock { tile: unit.tile, samples: unit.samples, planes, statistics }
}

/// What a thread reuses from sample to sample.
#[derive(Default)]
struct Scratch {
    base: Subpath,
    offset: OffsetSubpath,
}

/// Sums of one pixel over the samples of a unit, in f64.
#[derive(Default)]
struct PixelSums {
    halves: [HalfSums; 2],
    albedo: [f64; 3],
    normal: [f64; 3],
    depth: [f64; 3],
}

#[derive(Default)]
struct HalfSums {
    primal: [f64; 3],
    primal_squared: [f64; 3],
    direct: [f64; 3],
    gradient: [[f64; 3]; 4],
    gradient_squared: [[f64; 3]; 4],
}

impl PixelSums {
    /// The sums behind a plane, and how many of the three are used.
    fn of(&self, kind: PlaneKind) -> (&[f64; 3], usize) {
        let sums = match kind {
            PlaneKind::Primal(h) => &self.halves[h.index()].primal,
            PlaneKind::PrimalSquared(h) => &self.halves[h.index()].primal_squared,
            PlaneKind::Direct(h) => &self.halves[h.index()].direct,
            PlaneKind::Gradient(h, o) => &self.halves[h.index()].gradient[o.index()],
            PlaneKind::GradientSquared(h, o) => &self.halves[h.index()].gradient_squared[o.index()],
            PlaneKind::Albedo => &self.albedo,
            PlaneKind::Normal => &self.normal,
            PlaneKind::Depth => &self.depth,
        };
        (sums, kind.channels())
    }
}

/// Everything that stays the same over a unit.
struct Renderer<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    view: View,
    frame: u32,
    integrator: PathIntegrator,
    shift: HybridShift,
}

impl<'a> Renderer<'a> {
    fn new(scene: &'a Scene, plan: &'a Plan, frame: u32) -> Self {
        Self {
            scene,
            plan,
            view: scene.sensor.view(plan.extent),
            frame,
            integrator: PathIntegrator {
                max_depth: plan.max_depth,
                roulette_depth: plan.roulette_depth,
                shift_threshold: plan.shift_threshold,
            },
            shift: HybridShift { threshold: plan.shift_threshold },
        }
    }

    fn sample(&self, x: u32, y: u32, sample: u32, scratch: &mut Scratch, sums: &mut PixelSums, statistics: &mut Statistics) {
        let half = Half::of_sample(sample);
        // Half B carries the next frame's key: neighbouring frames share the seeds of these halves.
        let frame = self.frame.wrapping_add(half.index() as u32);
        let stream = SampleStream::open(SampleKey { seed: self.plan.seed, frame, x, y, index: sample / 2 });
        // The neighbours' paths take the same place in their pixels, so its weight holds for them too. Albedo, normal and depth only
        // guide, and go without it: they would gain noise from negative lobes.
        let ([u, v], weight) = self.scene.sensor.filter.place(stream.pair(Dimension::PIXEL));
        let lens = if self.view.has_lens() { stream.pair(Dimension::LENS) } else { [0.5; 2] };
        let film = [x as f32 + u, y as f32 + v];
        let base = &mut scratch.base;
        self.integrator.generate(self.scene, &self.view.ray(film, lens), &stream, base);
        statistics.add(Counter::Samples, 1);
        statistics.add(Counter::Rays, u64::from(base.rays));
        statistics.add(Counter::Vertices, base.vertices.len() as u64);
        let sums_of_half = &mut sums.halves[half.index()];
        let primal = finite(base.primal() * weight, statistics);
        add(&mut sums_of_half.primal, primal);
        add(&mut sums_of_half.primal_squared, primal * primal);
        add(&mut sums_of_half.direct, finite(base.direct * weight, statistics));
        if let Some(first) = base.first {
            add(&mut sums.albedo, first.albedo);
            for (sum, n) in sums.normal.iter_mut().zip(first.normal.to_array()) {
                *sum += f64::from(n);
            }
            sums.depth[0] += f64::from(first.depth);
        }
        if !self.plan.technique.measures_gradients() {
            return;
        }
        for offset in Offset::IMAGE {
            let (dx, dy) = offset.displacement();
            if !self.plan.extent.contains(i64::from(x) + dx, i64::from(y) + dy) {
                statistics.add(Counter::ShiftOutsideFilm, 1);
                continue;
            }
            if base.vertices.is_empty() {
                // The camera saw no surface: there is nothing to shift.
                continue;
            }
            let camera = self.view.ray([film[0] + dx as f32, film[1] + dy as f32], lens);
            self.shift.shift(self.scene, base, &camera, &mut scratch.offset);
            let (difference, rays) = difference(self.scene, base, &scratch.offset);
            statistics.add(Counter::Rays, u64::from(scratch.offset.rays + rays));
            statistics.add(outcome(scratch.offset.end), 1);
            // A backward step measures this − previous: the difference turns its sign.
            let difference = finite(difference * weight, statistics) * f32::from(offset.step);
            add(&mut sums_of_half.gradient[offset.index()], difference);
            sums_of_half.gradient_squared[offset.index()][0] += f64::from(difference.square_sum());
        }
    }
}

fn outcome(end: OffsetEnd) -> Counter {
    match end {
        OffsetEnd::Rejoined { .. } => Counter::ShiftReconnected,
        OffsetEnd::Followed { .. } => Counter::ShiftFollowed,
        OffsetEnd::Failed { why, .. } => match why {
            ShiftFailure::Escaped => Counter::ShiftEscaped,
            ShiftFailure::Occluded => Counter::ShiftOccluded,
            ShiftFailure::LobeMismatch => Counter::ShiftLobeMismatch,
            ShiftFailure::TotalReflection => Counter::ShiftTotalReflection,
        },
    }
}

#[inline]
fn add(sum: &mut [f64; 3], value: Spectrum) {
    for (sum, v) in sum.iter_mut().zip(value.to_rgb()) {
        *sum += f64::from(v);
    }
}

/// The value, or zero and a count where it is not finite.
#[inline]
fn finite(value: Spectrum, statistics: &mut Statistics) -> Spectrum {
    if value.is_finite() {
        value
    } else {
        statistics.add(Counter::NotFinite, 1);
        Spectrum::BLACK
    }
}
