//! Sums of what workers delivered of one frame, in any order, on a grid that may be coarser than the film.

use std::collections::BTreeSet;

use gradfarm_core::film::{FilmBlock, Image, PlaneKind};
use gradfarm_core::lattice::{Extent, Half};

use super::PIXELS;
use super::picture::{factor, smaller};
use super::view::View;
use crate::job::JobId;

/// RGB sums of one kind.
type Sums = Vec<[f32; 3]>;

/// The sums of a frame.
#[derive(Debug)]
pub(super) struct Sketch {
    job: JobId,
    position: u32,
    factor: u32,
    extent: Extent,
    units: BTreeSet<u32>,
    /// Samples in each cell.
    samples: Vec<f32>,
    primal: Sums,
    /// Differences to the right and downwards: from the pixel before the step, and from the one behind it.
    steps: [[Sums; 2]; 2],
    differences: bool,
}

impl Sketch {
    /// Nothing yet of a film of this extent.
    pub(super) fn new(job: JobId, position: u32, film: Extent) -> Self {
        let factor = factor(film, PIXELS);
        let extent = smaller(film, factor);
        let zero = || vec![[0.0; 3]; extent.pixels()];
        Self {
            job,
            position,
            factor,
            extent,
            units: BTreeSet::new(),
            samples: vec![0.0; extent.pixels()],
            primal: zero(),
            steps: [[zero(), zero()], [zero(), zero()]],
            differences: false,
        }
    }

    /// Whether it is of this frame.
    pub(super) fn is_of(&self, job: JobId, position: u32) -> bool {
        (self.job, self.position) == (job, position)
    }

    /// Whether a unit's result is in it.
    pub(super) fn has(&self, unit: u32) -> bool {
        self.units.contains(&unit)
    }

    /// Adds a result. One that does not lie on the film is left out.
    pub(super) fn add(&mut self, unit: u32, block: &FilmBlock) {
        let tile = block.tile;
        let film = Extent { width: self.extent.width * self.factor, height: self.extent.height * self.factor };
        if tile.pixels() == 0 || !tile.lies_on(film) || !self.units.insert(unit) {
            return;
        }
        let cell = |pixel: usize| {
            let (x, y) = (tile.x + pixel as u32 % tile.width, tile.y + pixel as u32 / tile.width);
            self.extent.index(x / self.factor, y / self.factor)
        };
        let cells: Vec<usize> = (0..tile.pixels()).map(cell).collect();
        let counted = |half| block.planes.iter().find(|(kind, _)| *kind == PlaneKind::Count(half)).map(|(_, values)| values);
        for (pixel, cell) in cells.iter().enumerate() {
            let placed = Half::ALL.map(|half| counted(half).and_then(|values| values.get(pixel)).copied());
            self.samples[*cell] += match placed {
                [Some(a), Some(b)] => a + b,
                _ => block.samples.count as f32,
            };
        }
        for (kind, values) in &block.planes {
            let sums = match kind {
                PlaneKind::Primal(_) | PlaneKind::Direct(_) => &mut self.primal,
                PlaneKind::Gradient(_, offset) => {
                    self.differences = true;
                    match offset.displacement() {
                        (1, 0) => &mut self.steps[0][0],
                        (-1, 0) => &mut self.steps[0][1],
                        (0, 1) => &mut self.steps[1][0],
                        (0, -1) => &mut self.steps[1][1],
                        _ => continue,
                    }
                }
                _ => continue,
            };
            for (channel, plane) in values.chunks_exact(tile.pixels()).take(3).enumerate() {
                for (value, cell) in plane.iter().zip(&cells) {
                    sums[*cell][channel] += value;
                }
            }
        }
    }

    /// A view, if it is known from sums.
    pub(super) fn image(&self, view: View) -> Option<Image> {
        if self.units.is_empty() {
            return None;
        }
        match view {
            View::Primal => Some(self.fill(|x, y| self.mean(&self.primal, x, y))),
            View::Dx if self.differences => Some(self.fill(|x, y| self.difference(0, x, y, (1, 0)))),
            View::Dy if self.differences => Some(self.fill(|x, y| self.difference(1, x, y, (0, 1)))),
            View::Dx | View::Dy | View::Reconstructed | View::Error => None,
        }
    }

    fn fill(&self, value: impl Fn(u32, u32) -> [f32; 3]) -> Image {
        let mut image = Image::new(self.extent, 3);
        for y in 0..self.extent.height {
            for x in 0..self.extent.width {
                for (channel, value) in value(x, y).into_iter().enumerate() {
                    image.set(x, y, channel, value);
                }
            }
        }
        image
    }

    fn mean(&self, sums: &Sums, x: u32, y: u32) -> [f32; 3] {
        let cell = self.extent.index(x, y);
        let samples = self.samples[cell];
        sums[cell].map(|sum| if samples > 0.0 { sum / samples } else { 0.0 })
    }

    /// What both ends of a step say of it together. On a coarse grid both ends lie in one cell, but for its edge.
    fn difference(&self, axis: usize, x: u32, y: u32, step: (u32, u32)) -> [f32; 3] {
        let (behind_x, behind_y) = if self.factor == 1 { (x + step.0, y + step.1) } else { (x, y) };
        let before = self.mean(&self.steps[axis][0], x, y);
        if behind_x >= self.extent.width || behind_y >= self.extent.height {
            return [0.0; 3];
        }
        let behind = self.mean(&self.steps[axis][1], behind_x, behind_y);
        [before[0] + behind[0], before[1] + behind[1], before[2] + behind[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::film::Statistics;
    use gradfarm_core::lattice::{Offset, SampleRange, Tile};

    fn block(tile: Tile, value: f32) -> FilmBlock {
        let planes = vec![
            (PlaneKind::Primal(Half::A), vec![value; 3 * tile.pixels()]),
            (PlaneKind::Primal(Half::B), vec![value; 3 * tile.pixels()]),
            (PlaneKind::Gradient(Half::A, Offset::IMAGE[0]), vec![2.0 * value; 3 * tile.pixels()]),
        ];
        FilmBlock { tile, samples: SampleRange { first: 0, count: 4 }, planes, statistics: Statistics::default() }
    }

    #[test]
    fn results_are_averaged_once_each() {
        let extent = Extent { width: 4, height: 2 };
        let mut sketch = Sketch::new(JobId::fresh(), 0, extent);
        assert_eq!(sketch.image(View::Primal), None);
        let tile = Tile { x: 0, y: 0, width: 2, height: 2 };
        sketch.add(0, &block(tile, 6.0));
        sketch.add(0, &block(tile, 6.0));
        sketch.add(1, &block(Tile { x: 40, ..tile }, 6.0));
        sketch.add(2, &block(tile, 2.0));
        let primal = sketch.image(View::Primal).unwrap();
        assert_eq!((primal.at(1, 1, 2), primal.at(2, 1, 2)), (2.0, 0.0));
        assert_eq!(sketch.image(View::Error), None);
    }
}
