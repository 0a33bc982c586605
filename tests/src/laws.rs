//! Laws of shifts, counted over base paths: each shift can be undone, Jacobians there and back are reciprocal, and the weights of both
//! directions add up to one.

use gradfarm_core::gradient::Pair;
use gradfarm_core::integrator::PathIntegrator;
use gradfarm_core::lattice::{Extent, Offset};
use gradfarm_core::math::Ray;
use gradfarm_core::path::{Integrator, Leg, OffsetEnd, OffsetSubpath, ShiftMap, Step, Subpath};
use gradfarm_core::sampling::{Dimension, SampleKey, SampleStream};
use gradfarm_core::scene::Scene;
use gradfarm_core::shift::{ShiftKind, build};
use rayon::prelude::*;

/// How far products of Jacobians and sums of weights may be from 1: what rounding does to nearly all paths is far below.
const TOLERANCE: f64 = 1e-2;
/// How far a vertex may come back from its place, over the scene's radius [1]. Each glossy bounce off a curved thing multiplies the
/// rounding of the one before it by about ten, so that a few chains of eight such bounces come back farther.
const PLACE: f64 = 1e-3;

/// Which base paths are drawn.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Size of the film: large ones have near neighbours.
    pub extent: Extent,
    /// Base paths a pixel.
    pub samples: u32,
    /// Roughness at and above which a vertex is connectable.
    pub threshold: f32,
    /// Seed of all numbers.
    pub seed: u64,
}

/// What became of the shifts of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Base paths with a vertex.
    pub paths: usize,
    /// Shifts of them, four each.
    pub shifts: usize,
    /// Those that have an answer.
    pub there: usize,
    /// Of these, the ones whose shift back fails or takes another way.
    pub lost: usize,
    /// Those whose Jacobians there and back do not multiply to 1.
    pub apart: usize,
    /// Those whose weights in both directions do not add up to 1.
    pub uneven: usize,
    /// Those of which a vertex came back too far from its place.
    pub strayed: usize,
    /// Farthest that a vertex came back from its place, over the scene's radius [1].
    pub farthest: f64,
}

impl Tally {
    /// Both together.
    pub fn and(self, other: Tally) -> Tally {
        Tally {
            paths: self.paths + other.paths,
            shifts: self.shifts + other.shifts,
            there: self.there + other.there,
            lost: self.lost + other.lost,
            apart: self.apart + other.apart,
            uneven: self.uneven + other.uneven,
            strayed: self.strayed + other.strayed,
            farthest: self.farthest.max(other.farthest),
        }
    }

    /// Largest share of shifts that breaks a law [1].
    pub fn broken(&self) -> f64 {
        self.lost.max(self.apart).max(self.uneven).max(self.strayed) as f64 / self.there.max(1) as f64
    }
}

/// One tally for each shift, all of them over the same base paths.
pub type Tallies = [Tally; ShiftKind::ALL.len()];

/// Shifts there and back for every sample of a film, to all four neighbours, by every shift.
pub fn count(scene: &Scene, effort: &Effort) -> Tallies {
    let rows = (0..effort.extent.height).into_par_iter().map(|y| row(scene, effort, y));
    rows.reduce(Tallies::default, both)
}

/// Adds up, shift by shift.
pub fn both(a: Tallies, b: Tallies) -> Tallies {
    std::array::from_fn(|k| a[k].and(b[k]))
}

fn row(scene: &Scene, effort: &Effort, y: u32) -> Tallies {
    let view = scene.sensor.view(effort.extent);
    let integrator = PathIntegrator { max_depth: 8, roulette_depth: 4, shift_threshold: effort.threshold };
    let shifts = ShiftKind::ALL.map(|kind| build(kind, effort.threshold));
    let mut base = Subpath::default();
    let mut tallies = Tallies::default();
    for (x, index) in (0..effort.extent.width).flat_map(|x| (0..effort.samples).map(move |index| (x, index))) {
        let stream = SampleStream::open(SampleKey { seed: effort.seed, frame: 0, x, y, index });
        let [u, v] = stream.pair(Dimension::PIXEL);
        let lens = stream.pair(Dimension::LENS);
        let film = [x as f32 + u, y as f32 + v];
        let here = view.ray(film, lens);
        integrator.generate(scene, &here, &stream, &mut base);
        if base.vertices.is_empty() {
            continue;
        }
        for (shift, tally) in shifts.iter().zip(&mut tallies) {
            tally.paths += 1;
            for neighbour in Offset::IMAGE {
                let (dx, dy) = neighbour.displacement();
                let there = view.ray([film[0] + dx as f32, film[1] + dy as f32], lens);
                *tally = tally.and(there_and_back(scene, shift.as_ref(), &base, &here, &there));
            }
        }
    }
    tallies
}

fn there_and_back(scene: &Scene, shift: &dyn ShiftMap, base: &Subpath, here: &Ray, there: &Ray) -> Tally {
    let (mut offset, mut back) = (OffsetSubpath::default(), OffsetSubpath::default());
    shift.shift(scene, base, there, &mut offset);
    let mut tally = Tally { shifts: 1, ..Tally::default() };
    let Some(image) = image(scene, base, &offset) else { return tally };
    tally.there = 1;
    shift.shift(scene, &image, here, &mut back);
    if back.end != offset.end || back.vertices.len() != offset.vertices.len() {
        tally.lost = 1;
        return tally;
    }
    let apart = back.vertices.iter().zip(&base.vertices).map(|(a, b)| a.position.distance(b.position));
    tally.farthest = f64::from(apart.fold(0.0, f32::max) / scene.world.bounds().radius());
    tally.strayed = usize::from(tally.farthest > PLACE);
    let product: f64 = offset.steps.iter().chain(&back.steps).map(|step| step.jacobian).product();
    tally.apart = usize::from((product - 1.0).abs() > TOLERANCE);
    if let Some(again) = self::image(scene, &image, &back)
        && let (Some(to), Some(from)) = (ratio(base, &image, &offset), ratio(&image, &again, &back))
    {
        let weight = |ratio| Pair { ratio, ..Pair::START }.weight();
        tally.uneven = usize::from((weight(to) + weight(from) - 1.0).abs() > TOLERANCE);
    }
    tally
}

/// Density of the offset path times |T′| over the density of the base path; `None` where the offset path is never drawn.
fn ratio(base: &Subpath, image: &Subpath, offset: &OffsetSubpath) -> Option<f64> {
    let mut ratio: f64 = offset.steps.iter().map(|step| step.jacobian).product();
    ratio *= f64::from(image.camera.passage.density) / f64::from(base.camera.passage.density);
    for (there, here) in image.steps.iter().zip(&base.steps) {
        ratio *= f64::from(there.evaluation.density) / f64::from(here.evaluation.density);
        ratio *= f64::from(there.leg.passage.density) / f64::from(here.leg.passage.density);
    }
    (ratio > 0.0 && ratio.is_finite()).then_some(ratio)
}

/// The offset path as a base path of its own, without joints: its vertices and steps, then the tail that both share. `None` where
/// the shift failed.
fn image(scene: &Scene, base: &Subpath, offset: &OffsetSubpath) -> Option<Subpath> {
    let own = match offset.end {
        OffsetEnd::Failed { .. } => return None,
        OffsetEnd::Rejoined { at } => at,
        OffsetEnd::Followed { .. } => offset.vertices.len(),
    };
    let camera = Leg { passage: offset.camera, ..base.camera };
    let mut image = Subpath { camera, vertices: offset.vertices.clone(), stream: base.stream, ..Subpath::default() };
    image.vertices.extend(base.vertices.iter().skip(own));
    for (k, step) in base.steps.iter().enumerate() {
        let vertex = &image.vertices[k];
        let turned = offset.steps.get(k);
        // Past the shift's own steps directions are shared, the one that leaves the scene between connectable vertices included.
        let wi = turned.map_or(step.wi, |turned| turned.wi);
        let evaluation = match k {
            k if k > own => step.evaluation,
            k if k == own => vertex.seen_from(scene, offset.vertices[k - 1].position).evaluate(scene, wi),
            _ if step.delta => vertex.evaluate_delta(scene, step.transmits, wi),
            _ => vertex.evaluate(scene, wi),
        };
        let transmits = if k < own { vertex.wo.z * vertex.frame.normal.dot(wi) < 0.0 } else { step.transmits };
        let passage = turned.map_or(step.leg.passage, |turned| turned.passage);
        image.steps.push(Step { wi, evaluation, transmits, leg: Leg { passage, ..step.leg }, ..*step });
    }
    Some(image)
}
