//! The pure function that the farm maps over units of work.
//!
//! `pixel` renders what is measured pixel by pixel (`pt`, `gpt`, `graph`), `group` what groups of pixels
//! measure together (`reuse`); `shutter` has one renderer for each
//! instant of an open shutter, `links` finds the similar pixels of `graph` by their `features`, `motion` the pixels that saw
//! the same thing in the moment before, `roulette` skips shifts of dark paths,
//! `sums` is what a pixel adds up, `outcome` what is counted, `watch` how far a unit has come.

mod features;
mod group;
mod links;
mod motion;
mod outcome;
mod pixel;
mod roulette;
mod shutter;
mod sums;
#[cfg(test)]
mod tests;
mod watch;

use crate::film::{FilmBlock, Statistics};
use crate::lattice::Half;
use crate::plan::{Plan, Technique, TileGuide, WorkUnit};
use crate::scene::{Instants, Scene};
use links::Links;
use motion::Motion;
use pixel::Scratch;
use shutter::Shutter;
use sums::{LinkSums, PixelSums, Planes};
pub use watch::Watch;

/// Renders one unit: the samples `unit.samples` of each pixel of `unit.tile`.
///
/// `scene` is a [`Scene`](crate::scene::Scene), or the [`Exposure`](crate::scene::Exposure) of the unit's moment.
///
/// Pure: the same scene, plan and unit give the same bits, so a retried unit is the same unit. The pixels of `unit.tile` must
/// lie on the plan's film. Values that are not finite are counted and replaced by zero.
pub fn render_unit<'a>(scene: impl Into<Instants<'a>>, plan: &'a Plan, unit: &WorkUnit) -> FilmBlock {
    render_watched(scene, plan, unit, None, &Watch::default())
}

/// The same while somebody watches; with a guide as [`render_guided`]. What comes of a unit that was told to stop is no block of it: whoever
/// told it throws it away.
pub fn render_watched<'a>(
    scene: impl Into<Instants<'a>>,
    plan: &'a Plan,
    unit: &WorkUnit,
    guide: Option<&TileGuide>,
    watch: &Watch,
) -> FilmBlock {
    if let Some(guide) = guide {
        return pixel_by_pixel(&scene.into(), plan, unit, |pixel| guide.samples(pixel), watch);
    }
    let samples = (unit.samples.first..unit.samples.end()).map(|sample| (Half::of_sample(sample), sample / 2));
    if plan.technique == Technique::Reuse {
        return group::render(&Shutter::new(&scene.into(), plan, unit), unit, samples, watch);
    }
    pixel_by_pixel(&scene.into(), plan, unit, |_| samples.clone(), watch)
}

/// Renders one unit of a guided pass: of each pixel of `unit.tile` the samples that `guide` names.
///
/// As pure as [`render_unit`]. `unit.samples` only says where the block stands among the tile's blocks. A guide of another number of
/// pixels than the tile leaves the others without samples.
pub fn render_guided<'a>(scene: impl Into<Instants<'a>>, plan: &'a Plan, unit: &WorkUnit, guide: &TileGuide) -> FilmBlock {
    render_watched(scene, plan, unit, Some(guide), &Watch::default())
}

/// The scene that motion is followed from, where the plan says so and there was a moment before.
fn follows<'a>(scene: &Instants<'a>, plan: &Plan) -> Option<&'a Scene> {
    scene.before.filter(|_| plan.temporal.is_some_and(|temporal| temporal.motion))
}

/// Renders a unit of a technique that measures each pixel by itself: of every pixel the samples by half and index within it.
fn pixel_by_pixel<I: Iterator<Item = (Half, u32)>>(
    scene: &Instants,
    plan: &Plan,
    unit: &WorkUnit,
    samples: impl Fn(usize) -> I,
    watch: &Watch,
) -> FilmBlock {
    let shutter = Shutter::new(scene, plan, unit);
    let mut planes = Planes::new(unit.tile, &plan.layout());
    let mut statistics = Statistics::default();
    let mut scratch = Scratch::default();
    let motion = follows(scene, plan).map(|before| Motion::of_tile(scene.scenes[0], before, plan.extent, unit.tile));
    let links = (plan.technique == Technique::Graph).then(|| Links::of_tile(scene.scenes[0], plan, unit.tile));
    for index in 0..unit.tile.pixels() {
        let place = [unit.tile.x + index as u32 % unit.tile.width, unit.tile.y + index as u32 / unit.tile.width];
        let mut sums = PixelSums::default();
        if let Some(links) = &links {
            sums.links.extend(links.of(index).map(LinkSums::new));
        }
        let mut traced = 0;
        for sample in samples(index) {
            traced += 1;
            let key = motion.as_ref().map_or(place, |motion| motion.key(place, sample.0));
            if let Some(partner) = motion.as_ref().and_then(|motion| motion.partner(place)) {
                sums.follow(place, partner);
            }
            shutter.at(sample).sample(place, key, sample, &mut scratch, &mut sums, &mut statistics);
        }
        planes.write(index, &sums);
        if !watch.count(traced) {
            break;
        }
    }
    planes.into_block(unit, statistics)
}
