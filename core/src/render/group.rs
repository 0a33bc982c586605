//! Groups of pixels that reuse one another's paths: each base path of a group is shifted to all its pixels.
//!
//! The film is cut into groups of S × S pixels, from its first pixel on and whatever the tiles are. A group reaches one column
//! and one row into the groups after it: these pixels give it their paths and take part in differences, but their primal belongs
//! to the next group. All differences within a group are those of its primal; the ones across its far edges tie the groups
//! together, and the reconstruction spreads out what the pixels of each have in common.
//!
//! # Source
//! Bauszat, Petitjean and Eisemann, "Gradient-Domain Path Reusing", ACM TOG 36(6), 2017.

use super::outcome::{finite, tell};
use super::pixel::PixelRenderer;
use super::shutter::Shutter;
use super::sums::{PixelSums, Planes};
use super::watch::Watch;
use crate::film::{Counter, FilmBlock, Statistics};
use crate::gradient::Sharing;
use crate::lattice::{Extent, Half, Offset, Tile};
use crate::path::{OffsetSubpath, Subpath};
use crate::plan::WorkUnit;
use crate::sampling::Dimension;
use crate::spectrum::Spectrum;

/// Renders every group that has pixels in the unit's tile, and keeps those pixels.
///
/// A group counts for the statistics of the tile that has its first pixel, so that it counts once.
pub(super) fn render(shutter: &Shutter, unit: &WorkUnit, samples: impl Iterator<Item = (Half, u32)> + Clone, watch: &Watch) -> FilmBlock {
    let plan = shutter.first().plan;
    let (tile, edge) = (unit.tile, plan.grain());
    let mut planes = Planes::new(tile, &plan.layout());
    let mut statistics = Statistics::default();
    let mut scratch = Scratch::default();
    for y in (tile.y / edge * edge..tile.y + tile.height).step_by(edge as usize) {
        for x in (tile.x / edge * edge..tile.x + tile.width).step_by(edge as usize) {
            let group = Group::new(x, y, edge, plan.extent);
            let mut counted = Statistics::default();
            scratch.prepare(&group);
            for sample in samples.clone() {
                group.sample(shutter.at(sample), sample, &mut scratch, &mut counted);
            }
            if tile.contains(x, y) {
                statistics.merge(&counted);
            }
            for (x, y, index) in group.pixels().filter(|(x, y, _)| group.owns(*x, *y) && tile.contains(*x, *y)) {
                let place = (y - tile.y) as usize * tile.width as usize + (x - tile.x) as usize;
                planes.write(place, &scratch.sums[index]);
            }
            if !watch.count(group.set.pixels() as u64 * samples.clone().count() as u64) {
                return planes.into_block(unit, statistics);
            }
        }
    }
    planes.into_block(unit, statistics)
}

/// A group and the pixels beyond it that it reaches.
#[derive(Clone, Copy, Debug)]
struct Group {
    /// All pixels whose paths are shared.
    set: Tile,
    edge: u32,
}

/// What is used again from sample to sample, by pixel of the set.
#[derive(Default)]
struct Scratch {
    base: Subpath,
    sharing: Sharing,
    images: Vec<OffsetSubpath>,
    /// What one base path gives.
    given: Vec<Spectrum>,
    /// What the base paths of one sample give together.
    primal: Vec<Spectrum>,
    sums: Vec<PixelSums>,
}

impl Scratch {
    fn prepare(&mut self, group: &Group) {
        let pixels = group.set.pixels();
        if self.images.len() < pixels {
            self.images.resize_with(pixels, OffsetSubpath::default);
        }
        self.given.resize(pixels, Spectrum::BLACK);
        self.primal.resize(pixels, Spectrum::BLACK);
        self.sums.clear();
        self.sums.resize_with(pixels, PixelSums::default);
    }
}

impl Group {
    /// The group whose first pixel is (x, y).
    fn new(x: u32, y: u32, edge: u32, extent: Extent) -> Group {
        Group { set: Tile { x, y, width: (edge + 1).min(extent.width - x), height: (edge + 1).min(extent.height - y) }, edge }
    }

    /// Pixels of the set with their index, row by row.
    fn pixels(&self) -> impl Iterator<Item = (u32, u32, usize)> + use<> {
        let set = self.set;
        (0..set.pixels()).map(move |index| (set.x + index as u32 % set.width, set.y + index as u32 / set.width, index))
    }

    /// Whether the primal of a pixel of the set belongs to this group.
    fn owns(&self, x: u32, y: u32) -> bool {
        x < self.set.x + self.edge && y < self.set.y + self.edge
    }

    /// Adds one sample of every pixel of the group.
    fn sample(&self, renderer: &PixelRenderer, (half, sample): (Half, u32), scratch: &mut Scratch, statistics: &mut Statistics) {
        let Scratch { base, sharing, images, given, primal, sums } = scratch;
        let images = &mut images[..self.set.pixels()];
        primal.fill(Spectrum::BLACK);
        for (x, y, own) in self.pixels() {
            let place = renderer.trace([x, y], [x, y], (half, sample), base, statistics);
            if self.owns(x, y) {
                sums[own].see(half, base, place.weight, statistics);
            }
            if base.vertices.is_empty() {
                // The camera saw no surface: there is nothing to share.
                continue;
            }
            // Without its images nobody knows how much a path counts, so the ones that are not shifted give nothing at all.
            let survival = renderer.survival(base.primal() * place.weight);
            if survival < 1.0 && base.stream.number(Dimension::shift(0)) >= survival {
                statistics.add(Counter::ShiftSkipped, images.len() as u64 - 1);
                continue;
            }
            let weight = place.weight / survival;
            for (to_x, to_y, index) in self.pixels().filter(|(_, _, index)| *index != own) {
                let by = [i64::from(to_x) - i64::from(x), i64::from(to_y) - i64::from(y)];
                renderer.shift(base, &place, by, &mut images[index]);
                statistics.add(Counter::Rays, u64::from(images[index].rays));
                tell(renderer.plan.shift, base, &images[index], statistics);
            }
            given.fill(Spectrum::BLACK);
            let rays = sharing.share(renderer.scene, base, own, images, given);
            statistics.add(Counter::Rays, u64::from(rays));
            for (sum, value) in primal.iter_mut().zip(given.iter()) {
                *sum += finite(*value * weight, Counter::NotFinitePrimal, statistics);
            }
        }
        let extent = renderer.plan.extent;
        for (x, y, index) in self.pixels().filter(|(x, y, _)| self.owns(*x, *y)) {
            let sums = &mut sums[index].halves[half.index()];
            sums.add_primal(primal[index]);
            for step in Offset::IMAGE.into_iter().filter(|step| step.step > 0) {
                let (dx, dy) = step.displacement();
                if !extent.contains(i64::from(x) + dx, i64::from(y) + dy) {
                    statistics.add(Counter::ShiftOutsideFilm, 1);
                    continue;
                }
                // The set reaches one pixel further than what the group owns.
                let next = index + if dx > 0 { 1 } else { self.set.width as usize };
                sums.add_gradient(step, primal[next] - primal[index]);
            }
        }
    }
}
