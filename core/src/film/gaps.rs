//! What a film shows where nothing was measured: a smooth continuation of what lies around, so that a frame with a hole can be
//! reconstructed like any other. Which pixels these are the film's counts tell: they are zero there.
//!
//! The differences within a hole and across its edge are those of the continuation: one measured from one side alone lacks what the
//! other side would have added. Variances are those of the rest of the film on average, so that a hole neither steers the weight of
//! the primal nor counts as well known.

use super::{HalfFilm, Image};
use crate::lattice::{Extent, Half, SampleRange, Tile};

/// Notes in both halves' counts how many samples the pixels of a tile have.
pub(super) fn note(counts: &mut [Image; 2], tile: Tile, samples: u32) {
    let range = SampleRange { first: 0, count: samples };
    for half in Half::ALL {
        let image = &mut counts[half.index()];
        for y in tile.y..tile.y + tile.height {
            (tile.x..tile.x + tile.width).for_each(|x| image.set(x, y, 0, range.count_of(half) as f32));
        }
    }
}

/// Fills the holes of a half, given its samples of each pixel.
///
/// # Errors
/// The number of missing pixels, if there is nothing to go on from, or if pixels are linked: what a link to a hole would have measured
/// cannot be made up. The half is then unchanged.
pub(super) fn fill(half: &mut HalfFilm, counts: &Image) -> Result<(), usize> {
    let measured: Vec<bool> = counts.plane(0).iter().map(|count| *count > 0.0).collect();
    let holes = measured.iter().filter(|measured| !**measured).count();
    if holes == 0 {
        return Ok(());
    }
    if holes == measured.len() || half.graph.is_some() {
        return Err(holes);
    }
    let extent = counts.extent();
    continue_image(&mut half.primal, &measured);
    continue_image(&mut half.direct, &measured);
    level(&mut half.primal_variance, |pixel| measured[pixel]);
    if let Some(gradients) = &mut half.gradients {
        for (step, mean, variance) in
            [([1, 0], &mut gradients.dx, &mut gradients.dx_variance), ([0, 1], &mut gradients.dy, &mut gradients.dy_variance)]
        {
            let next = |pixel: usize| next(extent, pixel, step);
            for pixel in 0..measured.len() {
                if let Some(other) = next(pixel)
                    && !(measured[pixel] && measured[other])
                {
                    for channel in 0..3 {
                        let plane = half.primal.plane(channel);
                        mean.plane_mut(channel)[pixel] = plane[other] - plane[pixel];
                    }
                }
            }
            level(variance, |pixel| next(pixel).is_none_or(|other| measured[pixel] && measured[other]));
        }
    }
    Ok(())
}

/// The pixel one step on, if there is one.
fn next(extent: Extent, pixel: usize, [dx, dy]: [usize; 2]) -> Option<usize> {
    let width = extent.width as usize;
    let (x, y) = (pixel % width + dx, pixel / width + dy);
    (x < width && y < extent.height as usize).then(|| y * width + x)
}

/// Continues an image into its holes: each hole pixel is the mean of the measured pixels nearest to it in its row and its column,
/// weighted by their inverse distances; the mean of all measured pixels where both are empty.
fn continue_image(image: &mut Image, measured: &[bool]) {
    let width = image.extent().width as usize;
    let around: Vec<(usize, [Option<usize>; 4])> = nearest(width, measured);
    for channel in 0..image.channels() {
        let plane = image.plane_mut(channel);
        let known = plane.iter().zip(measured).filter(|(_, measured)| **measured);
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), (value, _)| (sum + f64::from(*value), count + 1.0));
        let filled: Vec<f32> = around
            .iter()
            .map(|(pixel, around)| {
                let (mut value, mut weights) = (0.0, 0.0);
                for other in around.iter().flatten() {
                    let steps = (pixel % width).abs_diff(other % width) + (pixel / width).abs_diff(other / width);
                    value += f64::from(plane[*other]) / steps as f64;
                    weights += 1.0 / steps as f64;
                }
                (if weights > 0.0 { value / weights } else { sum / count }) as f32
            })
            .collect();
        around.iter().zip(filled).for_each(|((pixel, _), value)| plane[*pixel] = value);
    }
}

/// For each hole pixel the measured ones nearest to the left, to the right, above and below.
fn nearest(width: usize, measured: &[bool]) -> Vec<(usize, [Option<usize>; 4])> {
    let mut found = vec![[None; 4]; measured.len()];
    let mut look = |direction: usize, pixels: &mut dyn Iterator<Item = usize>| {
        let mut last = None;
        for pixel in pixels {
            if measured[pixel] {
                last = Some(pixel);
            } else {
                found[pixel][direction] = last;
            }
        }
    };
    for row in 0..measured.len() / width {
        look(0, &mut (row * width..(row + 1) * width));
        look(1, &mut (row * width..(row + 1) * width).rev());
    }
    for column in 0..width {
        look(2, &mut (column..measured.len()).step_by(width));
        look(3, &mut (column..measured.len()).step_by(width).rev());
    }
    found.into_iter().enumerate().filter(|(pixel, _)| !measured[*pixel]).collect()
}

/// Sets all values that are not known to the mean of those that are.
fn level(image: &mut Image, known: impl Fn(usize) -> bool) {
    for channel in 0..image.channels() {
        let plane = image.plane_mut(channel);
        let values = plane.iter().enumerate().filter(|(pixel, _)| known(*pixel));
        let (sum, count) = values.fold((0.0, 0u32), |(sum, count), (_, value)| (sum + f64::from(*value), count + 1));
        let mean = if count > 0 { (sum / f64::from(count)) as f32 } else { 0.0 };
        plane.iter_mut().enumerate().filter(|(pixel, _)| !known(*pixel)).for_each(|(_, value)| *value = mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmBlock, FoldError, FrameFold, PlaneKind, Statistics, TileFold};
    use crate::lattice::Offset;
    use crate::reconstruction::{ReconstructionKind, reconstruct};

    const EXTENT: Extent = Extent { width: 24, height: 12 };

    /// The ramp I = 1 + x + y/2, measured without noise.
    fn block(tile: Tile, samples: SampleRange, layout: &[PlaneKind]) -> FilmBlock {
        let plane = |kind: &PlaneKind| {
            let mut values = Vec::new();
            for _ in 0..kind.channels() {
                for y in tile.y..tile.y + tile.height {
                    for x in tile.x..tile.x + tile.width {
                        let value = ramp(x, y);
                        let (value, n) = match kind {
                            PlaneKind::Primal(h) => (value, samples.count_of(*h)),
                            PlaneKind::PrimalSquared(h) => (value * value, samples.count_of(*h)),
                            PlaneKind::Gradient(h, step) => (half_step(*step), samples.count_of(*h)),
                            PlaneKind::GradientSquared(h, step) => (3.0 * half_step(*step) * half_step(*step), samples.count_of(*h)),
                            PlaneKind::Direct(_) => (0.0, 1),
                            _ => (1.0, samples.count),
                        };
                        values.push(value * n as f32);
                    }
                }
            }
            (*kind, values)
        };
        FilmBlock { tile, samples, planes: layout.iter().map(plane).collect(), statistics: Statistics::default() }
    }

    fn ramp(x: u32, y: u32) -> f32 {
        1.0 + x as f32 + 0.5 * y as f32
    }

    /// What one end measures of a difference: half of it; both halves are those of the forward difference.
    fn half_step(step: Offset) -> f32 {
        let (dx, dy) = step.displacement();
        0.5 * (dx.abs() as f32 + 0.5 * dy.abs() as f32)
    }

    fn fold(missing: impl Fn(usize, usize) -> bool) -> Result<crate::film::Film, FoldError> {
        let layout = PlaneKind::layout(true);
        let mut frame = FrameFold::with_gaps(EXTENT, &layout);
        for (index, tile) in EXTENT.tiles(6).into_iter().enumerate() {
            let mut fold = TileFold::new(tile, &layout);
            for (pass, range) in SampleRange::batches(16, 8).into_iter().enumerate() {
                if missing(index, pass) {
                    fold.skip(range);
                } else {
                    fold.add(&block(tile, range, &layout)).unwrap();
                }
            }
            frame.place(&fold)?;
        }
        frame.finish()
    }

    #[test]
    fn a_pass_that_is_missing_leaves_the_mean_as_it_is_and_shows_in_the_counts() {
        let whole = fold(|_, _| false).unwrap();
        let film = fold(|tile, pass| tile == 1 && pass == 0).unwrap();
        for (found, expected) in film.halves.iter().zip(&whole.halves) {
            assert_eq!((&found.primal, &found.gradients), (&expected.primal, &expected.gradients));
            assert_eq!(found.samples, 8);
        }
        let counts = film.counts.unwrap();
        assert_eq!((counts.at(0, 0, 0), counts.at(6, 0, 0), counts.at(12, 0, 0)), (16.0, 8.0, 16.0));
    }

    #[test]
    fn a_hole_is_continued_smoothly_and_every_reconstruction_gets_over_it() {
        let film = fold(|tile, _| tile == 1).unwrap();
        assert_eq!(film.counts.as_ref().unwrap().plane(0).iter().filter(|count| **count == 0.0).count(), 36);
        let half = &film.halves[0];
        let gradients = half.gradients.as_ref().unwrap();
        for (x, y) in [(6, 0), (8, 3), (11, 5)] {
            assert!((half.primal.at(x, y, 0) - ramp(x, y)).abs() < 4.0, "{} at {x}, {y}", half.primal.at(x, y, 0));
            assert_eq!(gradients.dx.at(x, y, 1), half.primal.at(x + 1, y, 1) - half.primal.at(x, y, 1));
        }
        assert_eq!(gradients.dx.at(5, 2, 0), half.primal.at(6, 2, 0) - half.primal.at(5, 2, 0), "across the edge, too");
        assert_eq!(half.primal.at(3, 3, 0), ramp(3, 3), "what was measured stays");
        for kind in [ReconstructionKind::None, ReconstructionKind::L2, ReconstructionKind::WeightedL2, ReconstructionKind::L1] {
            let image = reconstruct(&film, kind, None).unwrap().image;
            assert!(image.data().iter().all(|value| value.is_finite()), "{kind:?}");
            assert!((image.at(20, 6, 0) - ramp(20, 6)).abs() < 0.5, "{kind:?}: far from the hole it is {}", image.at(20, 6, 0));
        }
    }

    #[test]
    fn a_frame_without_any_sample_is_none() {
        assert_eq!(fold(|_, _| true).unwrap_err(), FoldError::Incomplete { missing: EXTENT.pixels() });
        let half = Half::A;
        assert_eq!(fold(|tile, _| tile != 7).unwrap().halves[half.index()].samples, 8, "one tile is enough to go on from");
    }
}
