//! Where further samples help most: for each half of the film a map of counts, steered by the other half.
//!
//! A pixel's noise is the variance that one of its samples adds to the reconstruction, relative to the brightness. If it were known, the
//! error would be least with samples in proportion to its square root. But it comes from a few samples of heavy-tailed values: what they
//! did not meet they do not show, and stratified samples of smooth values are less noisy than their variance says. So the noise is
//! averaged over a window (a median would remove just the rare values that errors are made of), smoothed, and samples go in proportion to
//! its *fourth* root, which takes much of the gain where noise is uneven and loses little where it was misjudged.
//!
//! # Source
//! The score follows Manzi et al., "Temporal Gradient-Domain Path Tracing", ACM TOG 35(6), 2016: α² V(primal) + V(dx) + V(dy), relative
//! to the squared radiance of a 5 × 5 window. Here the gradients' part is what the pixel's own base paths contribute, in all four
//! directions, for that is what its samples change; and halves steer each other, where the published method steers by what it averages.

use super::{Plan, ReconstructionKind, Slice};
use crate::film::{FilmBlock, Image, Noise, PlaneKind};
use crate::lattice::{Extent, Half, SampleRange, Tile};
use crate::sampling::{Dimension, SampleKey, SampleStream};
use rayon::prelude::*;

/// How many guided samples each pixel of a frame gets in one round.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guide {
    extent: Extent,
    counts: [Vec<u32>; 2],
}

/// The samples of one guided pass for the pixels of a tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileGuide {
    /// For each half the samples of every pixel, row by row: runs of indices among the guided samples of that pixel and half.
    pub halves: [Vec<SampleRange>; 2],
}

/// Added to the squared radiance, as in relMSE.
const DARK: f64 = 1e-3;
/// Weight of the primal against the gradients where the noise of both is yet to decide it.
const TYPICAL_ALPHA: f32 = 0.2;
/// Pixels with a score below this share of the largest one count as if they had it.
const LEAST: f64 = 1e-4;
/// Taps of the filter that smooths the score, along rows and along columns.
const TAPS: [f64; 5] = [0.1, 0.2, 0.4, 0.2, 0.1];
/// Halvings in the search for the level that spends the budget: enough for every bit of an f64 that matters.
const HALVINGS: u32 = 100;

impl Guide {
    /// A pixel gets at most so many times the mean number of samples.
    pub const MOST: u32 = 16;

    /// The guide of a round of a frame from the `noise` of the even samples of all rounds before it, and the guides of those rounds.
    ///
    /// Counts of half A follow from the noise of half B alone, and the other way round, and sum to the round's budget exactly. Pure; the
    /// images must have the size of the plan's film, and `before` a guide for each of the rounds 1 to `round` − 1.
    pub fn new(plan: &Plan, frame: u32, round: u32, noise: &[Noise; 2], before: &[impl AsRef<Guide>]) -> Self {
        let counts = Half::ALL.map(|half| {
            let scores = scores(plan, &noise[1 - half.index()]);
            let placed: Vec<u32> = (0..plan.extent.pixels())
                .map(|i| before.iter().map(|guide| guide.as_ref().counts[half.index()].get(i).copied().unwrap_or(0)).sum())
                .collect();
            let even = SampleRange { first: 0, count: plan.even_before(round + 1) }.count_of(half);
            let had: Vec<f64> = placed.iter().map(|n| f64::from(even + n)).collect();
            let pixels = plan.extent.pixels() as u64;
            let budget = u64::from(plan.guided_in(round) / 2) * pixels;
            let mean = had.iter().sum::<f64>() / pixels as f64 + f64::from(plan.guided_in(round) / 2);
            let wanted = spread(&scores, &had, budget as f64, mean * f64::from(Self::MOST));
            // A number of the round and the half that no sample draws.
            let key = SampleKey { seed: plan.seed, frame, x: round, y: half.index() as u32, index: u32::MAX };
            round_to(&wanted, budget, f64::from(SampleStream::open(key).number(Dimension::PIXEL)))
        });
        Self { extent: plan.extent, counts }
    }

    /// Samples of each pixel of a half, row by row.
    pub fn counts(&self, half: Half) -> &[u32] {
        &self.counts[half.index()]
    }

    /// What a pass of a tile takes from the guides of rounds 1, 2 and so on: `None` if that of its round is not there, or the tile lies
    /// outside the film.
    pub fn of_tile(guides: &[impl AsRef<Guide>], slice: &Slice, tile: Tile) -> Option<TileGuide> {
        let at = (slice.round as usize).checked_sub(1)?;
        let (before, own) = (guides.get(..at)?, guides.get(at)?.as_ref());
        if !tile.lies_on(own.extent) {
            return None;
        }
        let halves = Half::ALL.map(|half| {
            let rows = tile.y..tile.y + tile.height;
            let pixels = rows.flat_map(|y| (tile.x..tile.x + tile.width).map(move |x| own.extent.index(x, y)));
            let samples = |i: usize| {
                let first: u32 = before.iter().map(|guide| guide.as_ref().counts(half)[i]).sum();
                let (from, to) = slice.part(own.counts(half)[i]);
                SampleRange { first: first + from, count: to - from }
            };
            pixels.map(samples).collect()
        });
        Some(TileGuide { halves })
    }
}

impl AsRef<Guide> for Guide {
    fn as_ref(&self) -> &Guide {
        self
    }
}

impl TileGuide {
    /// Whether the pixels of a block have the counts that this guide gives them; it must be of their tile.
    pub fn matches(&self, block: &FilmBlock) -> bool {
        Half::ALL.into_iter().all(|half| {
            let counts = block.planes.iter().find(|(kind, _)| *kind == PlaneKind::Count(half));
            counts.is_some_and(|(_, found)| found.iter().copied().eq(self.halves[half.index()].iter().map(|run| run.count as f32)))
        })
    }

    /// The samples of a pixel of the tile: their halves, and their indices as the stream of random numbers knows them.
    pub fn samples(&self, pixel: usize) -> impl Iterator<Item = (Half, u32)> + '_ {
        Half::ALL.into_iter().flat_map(move |half| {
            let run = self.halves[half.index()].get(pixel).copied().unwrap_or(SampleRange { first: 0, count: 0 });
            (run.first..run.end()).map(move |index| (half, SampleKey::GUIDED | index))
        })
    }
}

/// The fourth root of the relative noise of one sample of each pixel, smoothed; none is zero unless all are.
fn scores(plan: &Plan, noise: &Noise) -> Vec<f64> {
    let extent = plan.extent;
    let alpha = f64::from(plan.alpha.unwrap_or(TYPICAL_ALPHA));
    // What the image is made of: the primal alone, or primal and gradients.
    let (primal, gradients) = if plan.reconstruction == ReconstructionKind::None { (1.0, 0.0) } else { (alpha * alpha, 1.0) };
    let grey = windows(extent, |window| {
        let sum: f64 = window.iter().map(|i| f64::from(noise.grey.data()[*i])).sum();
        sum / window.len() as f64
    });
    let value = |image: &Image, i: usize| f64::from(image.data()[i]);
    let relative: Vec<f64> = (0..extent.pixels())
        .map(|i| (primal * value(&noise.primal, i) + gradients * value(&noise.gradients, i)) / (grey[i] * grey[i] + DARK))
        .collect();
    let means = windows(extent, |window| window.iter().map(|i| relative[*i]).sum::<f64>() / window.len() as f64);
    let mut scores: Vec<f64> = smooth(extent, &means).into_iter().map(|noise| noise.sqrt().sqrt()).collect();
    let least = LEAST * scores.iter().copied().fold(0.0, f64::max);
    scores.iter_mut().for_each(|score| *score = score.max(least));
    scores
}

/// A value for each pixel from the indices of the 5 × 5 window around it, as far as it lies on the film.
fn windows(extent: Extent, value: impl Fn(&[usize]) -> f64 + Sync) -> Vec<f64> {
    let mut out = vec![0.0; extent.pixels()];
    out.par_chunks_mut(extent.width as usize).enumerate().for_each(|(y, row)| {
        let y = y as u32;
        for (x, out) in row.iter_mut().enumerate() {
            let x = x as u32;
            let mut window = [0; 25];
            let mut n = 0;
            for wy in y.saturating_sub(2)..(y + 3).min(extent.height) {
                for wx in x.saturating_sub(2)..(x + 3).min(extent.width) {
                    window[n] = extent.index(wx, wy);
                    n += 1;
                }
            }
            *out = value(&window[..n]);
        }
    });
    out
}

/// The separable filter, the image continued beyond its border by its outermost pixels.
fn smooth(extent: Extent, values: &[f64]) -> Vec<f64> {
    let along = |values: &[f64], dx: i64, dy: i64| -> Vec<f64> {
        let clamp = |at: i64, size: u32| at.clamp(0, i64::from(size) - 1) as u32;
        (0..extent.pixels())
            .map(|i| {
                let (x, y) = ((i % extent.width as usize) as i64, (i / extent.width as usize) as i64);
                let tap = |k: i64| values[extent.index(clamp(x + k * dx, extent.width), clamp(y + k * dy, extent.height))];
                TAPS.iter().zip(-2..).map(|(weight, k)| weight * tap(k)).sum()
            })
            .collect()
    };
    along(&along(values, 1, 0), 0, 1)
}

/// How many samples each pixel should get so that what it has then comes as near as can be to a share in proportion to its score:
/// nothing is taken back, and no pixel comes above `most`.
fn spread(scores: &[f64], had: &[f64], budget: f64, most: f64) -> Vec<f64> {
    let least = scores.iter().copied().fold(f64::INFINITY, f64::min);
    if least.is_nan() || least <= 0.0 || budget <= 0.0 {
        return vec![budget / scores.len().max(1) as f64; scores.len()];
    }
    let wanted = |level: f64, score: f64, had: f64| ((level * score).min(most) - had).max(0.0);
    let (mut low, mut high) = (0.0, most / least);
    for _ in 0..HALVINGS {
        let level = 0.5 * (low + high);
        let sum: f64 = scores.iter().zip(had).map(|(score, had)| wanted(level, *score, *had)).sum();
        if sum < budget { low = level } else { high = level }
    }
    scores.iter().zip(had).map(|(score, had)| wanted(high, *score, *had)).collect()
}

/// Whole numbers whose sum is `budget`, each the expected value of `wanted` up to a common factor near 1 if `start` is uniform in [0, 1).
fn round_to(wanted: &[f64], budget: u64, start: f64) -> Vec<u32> {
    let total: f64 = wanted.iter().sum();
    let scale = if total > 0.0 { budget as f64 / total } else { 0.0 };
    let (mut sum, mut given) = (0.0, 0u64);
    let mut counts: Vec<u32> = wanted
        .iter()
        .map(|w| {
            sum += w;
            let upto = ((sum * scale + start) as u64).min(budget);
            let count = upto.saturating_sub(given);
            given += count;
            count as u32
        })
        .collect();
    // The last step of the sum may miss the budget by a rounding error.
    if let Some(last) = counts.last_mut() {
        *last += (budget - given) as u32;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Technique;
    use crate::testing;

    const EDGE: u32 = 24;

    fn plan(samples: u32, rounds: u32) -> Plan {
        let plan = testing::plan(Technique::Gpt, EDGE, samples, 6, 3);
        Plan { rounds, reconstruction: ReconstructionKind::L2, ..plan }
    }

    /// Noise that grows from left to right by a factor of 100 in the standard deviation, and is `scale` times as large.
    fn noise(scale: f32) -> Noise {
        let extent = Extent { width: EDGE, height: EDGE };
        let mut gradients = Image::new(extent, 1);
        for y in 0..EDGE {
            for x in 0..EDGE {
                gradients.set(x, y, 0, scale * if x < EDGE / 2 { 1.0 } else { 10_000.0 });
            }
        }
        let mut grey = Image::new(extent, 1);
        grey.data_mut().fill(1.0);
        Noise { grey, primal: Image::new(extent, 1), gradients }
    }

    fn guides(plan: &Plan, noise: &[Noise; 2]) -> Vec<Guide> {
        let mut guides = Vec::new();
        for round in 1..plan.rounds {
            guides.push(Guide::new(plan, 0, round, noise, &guides));
        }
        guides
    }

    #[test]
    fn counts_spend_the_budget_exactly() {
        for (samples, rounds) in [(32, 2), (33, 4), (500, 3), (1000, 8)] {
            let plan = plan(samples, rounds);
            for noise in [[noise(1.0), noise(2.0)], [noise(0.0), noise(0.0)]] {
                for (round, guide) in (1..).zip(guides(&plan, &noise)) {
                    for half in Half::ALL {
                        let sum: u64 = guide.counts(half).iter().map(|n| u64::from(*n)).sum();
                        assert_eq!(sum, u64::from(plan.guided_in(round) / 2) * u64::from(EDGE * EDGE));
                    }
                }
            }
        }
    }

    #[test]
    fn noisy_pixels_get_more_within_bounds() {
        let plan = plan(1024, 4);
        let guides = guides(&plan, &[noise(1.0), noise(1.0)]);
        let all = |x: u32| {
            let i = plan.extent.index(x, EDGE / 2);
            plan.even_before(4) / 2 + guides.iter().map(|guide| guide.counts(Half::A)[i]).sum::<u32>()
        };
        // The even samples alone are more than the quiet side's share: it gets no others.
        assert_eq!(all(2), plan.even_before(4) / 2);
        assert!(f64::from(all(EDGE - 3)) > 1.4 * 512.0 && all(EDGE - 3) <= Guide::MOST * 512);
        // Without noise there is nothing to choose.
        let even = super::tests::guides(&plan, &[noise(0.0), noise(0.0)]);
        assert!(even.iter().zip(1..).all(|(guide, round)| guide.counts(Half::B).iter().all(|n| *n == plan.guided_in(round) / 2)));
        // Twice the noise everywhere is the same choice.
        assert_eq!(guides, super::tests::guides(&plan, &[noise(2.0), noise(2.0)]));
    }

    #[test]
    fn a_half_steers_the_other_one_and_not_itself() {
        let plan = plan(64, 3);
        let mut other = noise(1.0);
        other.gradients.data_mut().reverse();
        let (both, a_changed) = (guides(&plan, &[noise(1.0), noise(1.0)]), guides(&plan, &[other, noise(1.0)]));
        for (before, after) in both.iter().zip(&a_changed) {
            assert_eq!(before.counts(Half::A), after.counts(Half::A));
            assert_ne!(before.counts(Half::B), after.counts(Half::B));
        }
    }

    #[test]
    fn tiles_and_slices_take_every_guided_sample_once() {
        let plan = plan(700, 4);
        let guides = guides(&plan, &[noise(1.0), noise(3.0)]);
        for tile in plan.extent.tiles(7) {
            let mut next = [vec![0; tile.pixels()], vec![0; tile.pixels()]];
            for slice in plan.passes().into_iter().filter_map(|pass| pass.slice) {
                let part = Guide::of_tile(&guides, &slice, tile).unwrap();
                for (runs, next) in part.halves.iter().zip(&mut next) {
                    for (run, next) in runs.iter().zip(next) {
                        assert_eq!(run.first, *next);
                        *next = run.end();
                    }
                }
            }
            for half in Half::ALL {
                let sum = |x: u32, y: u32| guides.iter().map(|guide| guide.counts(half)[plan.extent.index(x, y)]).sum::<u32>();
                let expected: Vec<u32> = (0..tile.pixels() as u32).map(|i| sum(tile.x + i % tile.width, tile.y + i / tile.width)).collect();
                assert_eq!(next[half.index()], expected);
            }
        }
        let slice = Slice { round: 4, samples: SampleRange { first: 0, count: 1 }, of: 1 };
        assert_eq!(Guide::of_tile(&guides, &slice, plan.extent.tiles(7)[0]), None);
    }

    #[test]
    fn rounding_keeps_the_sum_and_the_mean() {
        let wanted: Vec<f64> = (0..100).map(|i| f64::from(i % 7) * 0.3).collect();
        let budget = wanted.iter().sum::<f64>() as u64;
        let mut sums = vec![0.0; 100];
        for k in 0..1000 {
            let counts = round_to(&wanted, budget, f64::from(k) / 1000.0);
            assert_eq!(counts.iter().map(|n| u64::from(*n)).sum::<u64>(), budget);
            sums.iter_mut().zip(&counts).for_each(|(sum, n)| *sum += f64::from(*n) / 1000.0);
        }
        let scale = budget as f64 / wanted.iter().sum::<f64>();
        assert!(sums.iter().zip(&wanted).all(|(mean, w)| (mean - w * scale).abs() < 0.02));
    }
}
