//! Adds blocks into a frame in one fixed order: by sample range within a tile, tiles wherever they lie.
//!
//! The values of a pixel come from the blocks of its own tile alone, added in f64 in the order of their sample ranges, which the
//! plan fixes. So the bits of the film do not depend on tile size, on who rendered what, or on the order of arrival. Where the planes
//! include counts, each pixel's sums are divided by its own; else by the number of samples that all pixels share.

use super::block::{BlockError, FilmBlock};
use super::graph::{Graph, LinkError};
use super::image::Image;
use super::plane::PlaneKind;
use super::statistics::Statistics;
use super::{Features, Film, Gradients, HalfFilm, gaps};
use crate::lattice::{Extent, Half, Offset, SampleRange, Tile};

/// Why a block cannot be added.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FoldError {
    /// The block itself is wrong.
    #[error(transparent)]
    Block(#[from] BlockError),
    /// The block is of another tile.
    #[error("block of tile {found:?} added to the fold of tile {expected:?}")]
    Tile {
        /// The fold's tile.
        expected: Tile,
        /// The block's tile.
        found: Tile,
    },
    /// Blocks must come in the order of their samples, without gaps.
    #[error("block starts at sample {found}, the next one due is {expected}")]
    Order {
        /// Next sample index.
        expected: u32,
        /// Where the block starts.
        found: u32,
    },
    /// Tiles must cover each pixel once and all end at the same sample.
    #[error("tile {tile:?} ends at sample {found}, the frame's others at {expected}")]
    Samples {
        /// The odd one.
        tile: Tile,
        /// What the first tile has.
        expected: u32,
        /// What this one has.
        found: u32,
    },
    /// A tile that lies outside the frame, or over a tile that was placed before.
    #[error("tile {tile:?} lies outside the frame or over another tile")]
    Place {
        /// The odd one.
        tile: Tile,
    },
    /// Linked pixels do not agree about their link.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Some pixels were never measured.
    #[error("{missing} pixels belong to no tile")]
    Incomplete {
        /// How many.
        missing: usize,
    },
}

/// Sums of one tile.
#[derive(Clone, Debug)]
pub struct TileFold {
    tile: Tile,
    layout: Vec<PlaneKind>,
    sums: Vec<Vec<f64>>,
    samples: u32,
    /// Where the next block starts.
    due: u32,
    statistics: Statistics,
}

impl TileFold {
    /// An empty fold for a tile and the planes of a plan.
    pub fn new(tile: Tile, layout: &[PlaneKind]) -> Self {
        let sums = layout.iter().map(|kind| vec![0.0; tile.pixels() * kind.channels()]).collect();
        Self { tile, layout: layout.to_vec(), sums, samples: 0, due: 0, statistics: Statistics::default() }
    }

    /// Adds the next block.
    ///
    /// # Errors
    /// If it is not the next one, or not of this tile, or malformed; the fold is then unchanged.
    pub fn add(&mut self, block: &FilmBlock) -> Result<(), FoldError> {
        if block.tile != self.tile {
            return Err(FoldError::Tile { expected: self.tile, found: block.tile });
        }
        if block.samples.first != self.due {
            return Err(FoldError::Order { expected: self.due, found: block.samples.first });
        }
        block.check(&self.layout)?;
        for (sums, (_, values)) in self.sums.iter_mut().zip(&block.planes) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += f64::from(*value);
            }
        }
        self.samples += block.samples.count;
        self.due += block.samples.count;
        self.statistics.merge(&block.statistics);
        Ok(())
    }

    /// Leaves out the samples that come next. Sums that leave some out are a copy of the tile by itself; its halves keep their equal
    /// shares if every run, left out or not, has an even number of samples.
    pub fn skip(&mut self, samples: SampleRange) {
        self.due = samples.end();
    }

    /// Where it lies.
    pub fn tile(&self) -> Tile {
        self.tile
    }

    /// Counters summed over its blocks.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Samples per pixel so far; their mean over the plan's film where pixels differ.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// How many samples the sums of a plane run over, at one pixel of the tile. Counts stand for themselves.
    fn count_behind(&self, kind: PlaneKind, pixel: usize) -> f64 {
        let range = SampleRange { first: 0, count: self.samples };
        let of = |half: Half| match self.layout.iter().position(|k| *k == PlaneKind::Count(half)) {
            Some(k) => self.sums[k][pixel],
            None => f64::from(range.count_of(half)),
        };
        match kind {
            PlaneKind::Primal(h)
            | PlaneKind::PrimalSquared(h)
            | PlaneKind::Direct(h)
            | PlaneKind::Gradient(h, _)
            | PlaneKind::GradientSquared(h, _)
            | PlaneKind::LinkGradient(h, _)
            | PlaneKind::LinkGradientSquared(h, _) => of(h),
            PlaneKind::Albedo | PlaneKind::Normal | PlaneKind::Depth | PlaneKind::Motion | PlaneKind::Link(_) => of(Half::A) + of(Half::B),
            PlaneKind::Count(_) => 1.0,
        }
    }
}

/// Means of a whole frame while its tiles come in, in any order.
#[derive(Clone, Debug)]
pub struct FrameFold {
    extent: Extent,
    layout: Vec<PlaneKind>,
    means: Vec<Image>,
    placed: Vec<bool>,
    samples: Option<u32>,
    /// Samples of each pixel in either half, where tiles may lack some.
    gaps: Option<[Image; 2]>,
    statistics: Statistics,
}

impl FrameFold {
    /// An empty frame for the planes of a plan.
    pub fn new(extent: Extent, layout: &[PlaneKind]) -> Self {
        Self {
            extent,
            layout: layout.to_vec(),
            means: layout.iter().map(|kind| Image::new(extent, kind.channels())).collect(),
            placed: vec![false; extent.pixels()],
            samples: None,
            gaps: None,
            statistics: Statistics::default(),
        }
    }

    /// The same for a frame whose tiles may have left samples out, up to all of them. The finished film tells how many each pixel has; where
    /// it has none, the film continues what lies around.
    pub fn with_gaps(extent: Extent, layout: &[PlaneKind]) -> Self {
        Self { gaps: Some([(); 2].map(|()| Image::new(extent, 1))), ..Self::new(extent, layout) }
    }

    /// Puts a finished tile in its place.
    ///
    /// # Errors
    /// If it lies outside the frame, over another tile, or has another number of samples than the tiles before.
    pub fn place(&mut self, fold: &TileFold) -> Result<(), FoldError> {
        let tile = fold.tile;
        if !tile.lies_on(self.extent) || self.indices(tile).any(|i| self.placed[i]) {
            return Err(FoldError::Place { tile });
        }
        let expected = *self.samples.get_or_insert(fold.samples);
        if let Some(counts) = &mut self.gaps {
            self.samples = Some(expected.max(fold.samples));
            gaps::note(counts, tile, fold.samples);
        } else if fold.samples != expected {
            return Err(FoldError::Samples { tile, expected, found: fold.samples });
        }
        for (k, kind) in self.layout.iter().enumerate() {
            let scales: Vec<f64> =
                (0..tile.pixels()).map(|i| fold.count_behind(*kind, i)).map(|n| if n > 0.0 { 1.0 / n } else { 0.0 }).collect();
            for channel in 0..kind.channels() {
                let sums = &fold.sums[k][channel * tile.pixels()..(channel + 1) * tile.pixels()];
                let plane = self.means[k].plane_mut(channel);
                let width = tile.width as usize;
                for (row, (values, scales)) in sums.chunks_exact(width).zip(scales.chunks_exact(width)).enumerate() {
                    let start = self.extent.index(tile.x, tile.y + row as u32);
                    for (mean, (sum, scale)) in plane[start..start + width].iter_mut().zip(values.iter().zip(scales)) {
                        *mean = (sum * scale) as f32;
                    }
                }
            }
        }
        for i in self.indices(tile) {
            self.placed[i] = true;
        }
        self.statistics.merge(&fold.statistics);
        Ok(())
    }

    /// The finished frame.
    ///
    /// # Errors
    /// If a pixel was never measured, or linked pixels do not agree about their link.
    pub fn finish(mut self) -> Result<Film, FoldError> {
        self.check_complete()?;
        let range = SampleRange { first: 0, count: self.samples.unwrap_or(0) };
        let counted = self.layout.contains(&PlaneKind::Count(Half::A)) || self.gaps.is_some();
        let [a, b] = Half::ALL.map(|half| self.counts(half));
        let counts = counted.then(|| {
            let mut both = a.clone();
            both.data_mut().iter_mut().zip(b.data()).for_each(|(sum, n)| *sum += n);
            both
        });
        let mut graphs = Graph::join(&self, [&a, &b])?;
        let mut halves = [self.half(Half::A, range, &a), self.half(Half::B, range, &b)];
        for (half, graph) in halves.iter_mut().zip(&mut graphs) {
            half.graph = graph.take();
        }
        if self.gaps.is_some() {
            for (half, counts) in halves.iter_mut().zip([&a, &b]).filter(|(half, _)| half.samples > 0 || range.count == 0) {
                gaps::fill(half, counts).map_err(|missing| FoldError::Incomplete { missing })?;
            }
        }
        // Sums of whole numbers, divided: they are whole again.
        let motion = self.layout.contains(&PlaneKind::Motion).then(|| {
            let mut motion = self.take(PlaneKind::Motion);
            motion.data_mut().iter_mut().for_each(|value| *value = value.round());
            motion
        });
        let features =
            Features { albedo: self.take(PlaneKind::Albedo), normal: self.take(PlaneKind::Normal), depth: self.take(PlaneKind::Depth) };
        Ok(Film { extent: self.extent, halves, counts, motion, features, statistics: self.statistics })
    }

    /// That every pixel belongs to a tile.
    pub(super) fn check_complete(&self) -> Result<(), FoldError> {
        match self.placed.iter().filter(|placed| !**placed).count() {
            0 => Ok(()),
            missing => Err(FoldError::Incomplete { missing }),
        }
    }

    /// Size [pixels].
    pub(super) fn extent(&self) -> Extent {
        self.extent
    }

    /// Samples of a half, per pixel.
    pub(super) fn counts(&self, half: Half) -> Image {
        if let Some(k) = self.layout.iter().position(|kind| *kind == PlaneKind::Count(half)) {
            return self.means[k].clone();
        }
        if let Some(counts) = &self.gaps {
            return counts[half.index()].clone();
        }
        let mut counts = Image::new(self.extent, 1);
        counts.data_mut().fill(SampleRange { first: 0, count: self.samples.unwrap_or(0) }.count_of(half) as f32);
        counts
    }

    /// A plane's mean, if it was measured.
    pub(super) fn mean(&self, kind: PlaneKind) -> Option<&Image> {
        self.layout.iter().position(|k| *k == kind).map(|k| &self.means[k])
    }

    fn half(&mut self, half: Half, range: SampleRange, counts: &Image) -> HalfFilm {
        let samples = range.count_of(half);
        let primal = self.take(PlaneKind::Primal(half));
        let squares = self.take(PlaneKind::PrimalSquared(half));
        let mut primal_variance = Image::new(self.extent, 3);
        let means = primal.data().iter().zip(squares.data());
        for (v, ((m, s), n)) in primal_variance.data_mut().iter_mut().zip(means.zip(counts.data().iter().cycle())) {
            *v = variance_of_mean(f64::from(*m) * f64::from(*m), f64::from(*s), *n);
        }
        let has_gradients = self.layout.contains(&PlaneKind::Gradient(half, Offset::IMAGE[0]));
        let gradients = has_gradients.then(|| {
            let (dx, dx_variance) = self.difference(half, Offset::IMAGE[0], counts);
            let (dy, dy_variance) = self.difference(half, Offset::IMAGE[2], counts);
            Gradients { dx, dy, dx_variance, dy_variance }
        });
        HalfFilm { samples, primal, primal_variance, direct: self.take(PlaneKind::Direct(half)), gradients, graph: None }
    }

    /// Joins what the base pixel measured forward with what its neighbour measured backward. Some techniques measure forward only:
    /// what they lack adds nothing, and does not vary.
    fn difference(&mut self, half: Half, forward: Offset, counts: &Image) -> (Image, Image) {
        let ahead = self.take(PlaneKind::Gradient(half, forward));
        let back = self.take(PlaneKind::Gradient(half, forward.reversed()));
        let ahead_squares = self.take(PlaneKind::GradientSquared(half, forward));
        let back_squares = self.take(PlaneKind::GradientSquared(half, forward.reversed()));
        let mut mean = Image::new(self.extent, 3);
        let mut variance = Image::new(self.extent, 1);
        let (sx, sy) = forward.displacement();
        for y in 0..self.extent.height {
            for x in 0..self.extent.width {
                let (nx, ny) = (i64::from(x) + sx, i64::from(y) + sy);
                if !self.extent.contains(nx, ny) {
                    continue;
                }
                let (nx, ny) = (nx as u32, ny as u32);
                let (mut square_ahead, mut square_back) = (0.0, 0.0);
                for c in 0..3 {
                    let (a, b) = (f64::from(ahead.at(x, y, c)), f64::from(back.at(nx, ny, c)));
                    mean.set(x, y, c, (a + b) as f32);
                    square_ahead += a * a;
                    square_back += b * b;
                }
                let v = variance_of_mean(square_ahead, f64::from(ahead_squares.at(x, y, 0)), counts.at(x, y, 0))
                    + variance_of_mean(square_back, f64::from(back_squares.at(nx, ny, 0)), counts.at(nx, ny, 0));
                variance.set(x, y, 0, v);
            }
        }
        (mean, variance)
    }

    /// Takes a plane's mean out; planes that the layout lacks are zero.
    fn take(&mut self, kind: PlaneKind) -> Image {
        match self.layout.iter().position(|k| *k == kind) {
            Some(k) => std::mem::replace(&mut self.means[k], Image::new(Extent { width: 0, height: 0 }, kind.channels())),
            None => Image::new(self.extent, kind.channels()),
        }
    }

    fn indices(&self, tile: Tile) -> impl Iterator<Item = usize> + use<> {
        let extent = self.extent;
        (tile.y..tile.y + tile.height).flat_map(move |y| (tile.x..tile.x + tile.width).map(move |x| extent.index(x, y)))
    }
}

/// Unbiased estimate of the variance of a mean of `n` samples, from the squared mean and the mean square. Zero for n < 2.
pub(super) fn variance_of_mean(squared_mean: f64, mean_square: f64, n: f32) -> f32 {
    if n < 2.0 {
        return 0.0;
    }
    ((mean_square - squared_mean).max(0.0) / (f64::from(n) - 1.0)).min(f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of the samples a plane's sums run over.
    fn count_behind(kind: PlaneKind, range: SampleRange) -> u32 {
        match kind {
            PlaneKind::Primal(h)
            | PlaneKind::PrimalSquared(h)
            | PlaneKind::Direct(h)
            | PlaneKind::Gradient(h, _)
            | PlaneKind::GradientSquared(h, _)
            | PlaneKind::LinkGradient(h, _)
            | PlaneKind::LinkGradientSquared(h, _)
            | PlaneKind::Count(h) => range.count_of(h),
            PlaneKind::Albedo | PlaneKind::Normal | PlaneKind::Depth | PlaneKind::Motion | PlaneKind::Link(_) => range.count,
        }
    }

    fn block(tile: Tile, samples: SampleRange, layout: &[PlaneKind], value: impl Fn(PlaneKind, u32, u32) -> f32) -> FilmBlock {
        let planes = layout
            .iter()
            .map(|kind| {
                let mut values = Vec::new();
                for _ in 0..kind.channels() {
                    for y in tile.y..tile.y + tile.height {
                        for x in tile.x..tile.x + tile.width {
                            values.push(value(*kind, x, y) * count_behind(*kind, samples) as f32);
                        }
                    }
                }
                (*kind, values)
            })
            .collect();
        FilmBlock { tile, samples, planes, statistics: Statistics::default() }
    }

    fn film(edge: u32, gradients: bool) -> Film {
        let extent = Extent { width: 13, height: 7 };
        let layout = PlaneKind::layout(gradients);
        let mut frame = FrameFold::new(extent, &layout);
        for tile in extent.tiles(edge).into_iter().rev() {
            let mut fold = TileFold::new(tile, &layout);
            for range in SampleRange::batches(5, 2) {
                fold.add(&block(tile, range, &layout, |kind, x, y| (kind.code() + 1) as f32 * 0.1 + x as f32 + 0.01 * y as f32)).unwrap();
            }
            frame.place(&fold).unwrap();
        }
        frame.finish().unwrap()
    }

    #[test]
    fn film_does_not_depend_on_tiles() {
        assert_eq!(film(4, true), film(64, true));
        assert_eq!(film(3, false), film(5, false));
    }

    #[test]
    fn counted_pixels_are_divided_by_their_own_counts() {
        // Two blocks: the same sums everywhere, but the second one of 1 + x + y samples in each half.
        let extent = Extent { width: 3, height: 2 };
        let mut layout = PlaneKind::layout(true);
        layout.extend(Half::ALL.map(PlaneKind::Count));
        let mut fold = TileFold::new(extent.tiles(8)[0], &layout);
        let range = |first, count| SampleRange { first, count };
        let n = |x: u32, y: u32| (1 + x + y) as f32;
        let even =
            block(extent.tiles(8)[0], range(0, 4), &layout, |kind, _, _| if matches!(kind, PlaneKind::Count(_)) { 1.0 } else { 3.0 });
        let mut guided = block(extent.tiles(8)[0], range(4, 4), &layout, |_, _, _| 0.0);
        for (kind, values) in &mut guided.planes {
            let share = if matches!(kind, PlaneKind::Albedo | PlaneKind::Normal | PlaneKind::Depth) { 2.0 } else { 1.0 };
            let value = if matches!(kind, PlaneKind::Count(_)) { 1.0 } else { 3.0 };
            values.iter_mut().enumerate().for_each(|(i, v)| *v = value * share * n(i as u32 % 6 % 3, i as u32 % 6 / 3));
        }
        fold.add(&even).unwrap();
        fold.add(&guided).unwrap();
        let mut frame = FrameFold::new(extent, &layout);
        frame.place(&fold).unwrap();
        let film = frame.finish().unwrap();
        assert_eq!(film.halves[0].samples, 4);
        assert!(film.halves.iter().all(|half| half.primal.data().iter().all(|v| *v == 3.0)));
        assert!(film.features.albedo.data().iter().all(|v| *v == 3.0));
        let counts = film.counts.unwrap();
        assert_eq!((counts.at(0, 0, 0), counts.at(2, 1, 0)), (6.0, 12.0));
    }

    #[test]
    fn gradients_join_both_directions() {
        let film = film(4, true);
        let gradients = film.halves[0].gradients.as_ref().unwrap();
        let forward = |x: f32| 17.0 * 0.1 + x;
        let backward = |x: f32| 18.0 * 0.1 + x;
        assert!((gradients.dx.at(2, 0, 0) - (forward(2.0) + backward(3.0))).abs() < 1e-5);
        assert_eq!(gradients.dx.at(12, 3, 1), 0.0);
        assert_eq!(gradients.dy.at(4, 6, 1), 0.0);
    }

    #[test]
    fn gradients_measured_forward_only_stand_alone() {
        let extent = Extent { width: 5, height: 4 };
        let mut layout = PlaneKind::layout(true);
        layout.retain(|kind| !matches!(kind, PlaneKind::Gradient(_, o) | PlaneKind::GradientSquared(_, o) if o.step < 0));
        let mut fold = TileFold::new(extent.tiles(8)[0], &layout);
        let range = SampleRange { first: 0, count: 8 };
        fold.add(&block(extent.tiles(8)[0], range, &layout, |kind, x, _| if kind.channels() == 1 { 30.0 } else { x as f32 })).unwrap();
        let mut frame = FrameFold::new(extent, &layout);
        frame.place(&fold).unwrap();
        let film = frame.finish().unwrap();
        let gradients = film.halves[0].gradients.as_ref().unwrap();
        assert_eq!(gradients.dx.at(3, 1, 0), 3.0);
        // Mean square 30 over RGB, squared mean 3 · 3², four samples.
        assert_eq!(gradients.dx_variance.at(3, 1, 0), 1.0);
    }

    #[test]
    fn folds_refuse_what_does_not_fit() {
        let extent = Extent { width: 4, height: 4 };
        let layout = PlaneKind::layout(false);
        let tiles = extent.tiles(2);
        let mut fold = TileFold::new(tiles[0], &layout);
        let range = |first, count| SampleRange { first, count };
        let late = block(tiles[0], range(2, 2), &layout, |_, _, _| 1.0);
        assert!(matches!(fold.add(&late), Err(FoldError::Order { expected: 0, found: 2 })));
        let other = block(tiles[1], range(0, 2), &layout, |_, _, _| 1.0);
        assert!(matches!(fold.add(&other), Err(FoldError::Tile { .. })));
        let mut bad = block(tiles[0], range(0, 2), &layout, |_, _, _| 1.0);
        bad.planes[0].1[0] = f32::NAN;
        assert!(matches!(fold.add(&bad), Err(FoldError::Block(BlockError::NotFinite { .. }))));
        fold.add(&block(tiles[0], range(0, 2), &layout, |_, _, _| 1.0)).unwrap();
        let mut frame = FrameFold::new(extent, &layout);
        frame.place(&fold).unwrap();
        assert!(matches!(frame.place(&fold), Err(FoldError::Place { .. })));
        assert!(matches!(frame.finish(), Err(FoldError::Incomplete { missing: 12 })));
    }
}
