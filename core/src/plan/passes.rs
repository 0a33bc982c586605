//! The passes over the film that a frame is made of: in rounds, each of them partly even, partly guided by what came before.
//!
//! The first round gives every pixel the same number of samples. Each later one does so with a part of its share, and places the rest
//! where a [`Guide`](super::Guide) says. Only even samples steer (`adr/0006`), so even passes wait for nothing; the guided passes of a
//! round wait for the even samples of the rounds before.
//!
//! Where the number of samples is known, rounds are equal parts of it, and in the order of the sums all even samples come first. Where a
//! frame is checked on the way, nobody knows its end: rounds then double, each as long as all before it together, and come one after the
//! other, so that the passes of fewer samples are the first ones of more. The last of them has no end.

use super::Plan;
use crate::lattice::SampleRange;

/// One pass over the film: a unit of work for each tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Pass {
    /// Its place in the plan's samples. For an even pass these are the indices of its samples; a guided pass has as many on average.
    pub samples: SampleRange,
    /// What it takes from a guide; `None` for an even pass.
    pub slice: Option<Slice>,
}

/// What a guided pass takes from the guide of its round: from every pixel the same share, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Slice {
    /// The round, from 1.
    pub round: u32,
    /// Which part of the guide's samples, counted in samples of a pixel that has `of`. It may lie beyond `of` in a round without an
    /// end: the guide's shares then go on.
    pub samples: SampleRange,
    /// Mean number of samples per pixel that the guide places.
    pub of: u32,
}

impl Slice {
    /// The part of a pixel's samples, given how many the guide places there: the first index, and one past the last.
    pub(super) fn part(&self, count: u32) -> (u32, u32) {
        let upto = |n: u32| (u64::from(count) * u64::from(n) / u64::from(self.of.max(1))) as u32;
        (upto(self.samples.first), upto(self.samples.end()))
    }
}

impl Plan {
    /// The share of a later round's samples that is even: one in so many.
    const EVEN_SHARE: u32 = 4;
    /// Fewest samples per pixel and round: below, its variance cannot be told.
    pub const ROUND: u32 = 8;
    /// Samples per pixel of the first round where rounds double.
    pub const FIRST_ROUND: u32 = Self::EVEN_SHARE * Self::BATCH;

    /// The passes of a frame, in the order of their sums.
    pub fn passes(&self) -> Vec<Pass> {
        if self.rounds_double() {
            return self.doubling_passes();
        }
        let even_end = self.even_before(self.rounds);
        let mut passes = Vec::new();
        for round in 0..self.rounds {
            let (first, end) = (self.even_before(round), self.even_before(round + 1));
            for run in SampleRange::batches(end - first, self.batch) {
                passes.push(Pass { samples: SampleRange { first: first + run.first, count: run.count }, slice: None });
            }
        }
        let mut first = even_end;
        for round in 1..self.rounds {
            let of = self.guided_in(round);
            for samples in SampleRange::batches(of, self.batch) {
                let place = SampleRange { first: first + samples.first, count: samples.count };
                passes.push(Pass { samples: place, slice: Some(Slice { round, samples, of }) });
            }
            first += of;
        }
        passes
    }

    /// Whether rounds double, because a frame may end anywhere; else they are equal parts of the plan's samples.
    pub fn rounds_double(&self) -> bool {
        self.rounds > 1 && self.stop.has_checks()
    }

    /// Where a round begins that doubles the samples [samples per pixel]; 0 for the first one.
    fn doubled(&self, round: u32) -> u32 {
        let first = u64::from(self.batch.max(1)) * u64::from(Self::EVEN_SHARE);
        // Beyond every number of samples at the latest after as many doublings as these have bits.
        let begin = if round == 0 { 0 } else { first << (round - 1).min(u32::BITS - 2) };
        begin.min(u64::from(u32::MAX)) as u32
    }

    /// Passes of rounds that double: whole batches all, whatever the number of samples is, which only cuts the last one.
    fn doubling_passes(&self) -> Vec<Pass> {
        let batch = self.batch.max(1);
        let (mut round, mut guided) = (0, 0);
        SampleRange::batches(self.samples, batch)
            .into_iter()
            .map(|samples| {
                let nth = samples.first / batch;
                // Position among the passes of its doubling, the first of which has as many as a round has at least.
                let doubling = (nth / Self::EVEN_SHARE).checked_ilog2().map_or(0, |log| log + 1);
                let length = Self::EVEN_SHARE << doubling.saturating_sub(1);
                let even = doubling == 0 || nth % length < length / Self::EVEN_SHARE;
                let own = doubling.min(self.rounds - 1);
                if own > round {
                    (round, guided) = (own, 0);
                }
                let slice = (!even).then(|| {
                    let slice = Slice { round, samples: SampleRange { first: guided, count: samples.count }, of: self.guided_in(round) };
                    guided += samples.count;
                    slice
                });
                Pass { samples, slice }
            })
            .collect()
    }

    /// How many passes a frame has, without listing them.
    pub fn pass_count(&self) -> u64 {
        let batches = |samples: u32| u64::from(samples.div_ceil(self.batch.max(1)));
        if self.rounds_double() {
            return batches(self.samples);
        }
        (0..self.rounds).map(|round| batches(self.samples_in(round) - self.guided_in(round)) + batches(self.guided_in(round))).sum()
    }

    /// Even samples per pixel of the rounds before this one. Where rounds double, of rounds that are there in full.
    pub fn even_before(&self, round: u32) -> u32 {
        if self.rounds_double() {
            // The whole first round, and its share of each one after it.
            let (first, begin) = (self.doubled(1), self.doubled(round.min(self.rounds)));
            return if round == 0 { 0 } else { first + (begin - first) / Self::EVEN_SHARE };
        }
        (0..round.min(self.rounds)).map(|r| self.samples_in(r) - self.guided_in(r)).sum()
    }

    /// The even passes that end here or before steer the guide of this round.
    pub fn steered_until(&self, round: u32) -> u32 {
        if self.rounds_double() { self.doubled(round) } else { self.even_before(round) }
    }

    /// Guided samples per pixel of a round, on average: an even number, half of them for each half of the film.
    pub fn guided_in(&self, round: u32) -> u32 {
        if round == 0 || round >= self.rounds {
            return 0;
        }
        if self.rounds_double() {
            let length = self.doubled(round);
            return (length - length / Self::EVEN_SHARE) / 2 * 2;
        }
        let samples = self.samples_in(round);
        let even = samples.div_ceil(Self::EVEN_SHARE).next_multiple_of(2);
        samples.saturating_sub(even) / 2 * 2
    }

    /// Samples per pixel of a round: an even number but for the last one.
    fn samples_in(&self, round: u32) -> u32 {
        let end = |r: u32| {
            let share = (u64::from(self.samples) * u64::from(r) / u64::from(self.rounds.max(1))) as u32;
            if r == self.rounds { self.samples } else { share / 2 * 2 }
        };
        end(round + 1) - end(round)
    }
}

#[cfg(test)]
mod tests {
    use crate::lattice::SampleRange;
    use crate::plan::{Pass, Plan, Stop, Technique};
    use crate::testing;

    fn plan(samples: u32, rounds: u32) -> Plan {
        Plan { rounds, ..testing::plan(Technique::Gpt, 8, samples, 6, 0) }
    }

    #[test]
    fn one_round_is_even() {
        for samples in [1, 5, 16, 100] {
            let plan = plan(samples, 1);
            let passes: Vec<SampleRange> = plan.passes().iter().map(|pass| pass.samples).collect();
            assert_eq!(passes, plan.sample_ranges());
            assert!(plan.passes().iter().all(|pass| pass.slice.is_none()));
        }
    }

    fn checked(samples: u32, rounds: u32) -> Plan {
        Plan { stop: Stop { error: Some(0.01), ..Stop::default() }, ..plan(samples, rounds) }
    }

    #[test]
    fn rounds_of_frames_without_a_known_end_double() {
        let plan = Plan { batch: 16, ..checked(1000, 4) };
        let told = |pass: &Pass| (pass.samples.first, pass.slice.map(|slice| (slice.round, slice.samples.first, slice.of)));
        let passes: Vec<_> = plan.passes().iter().map(told).collect();
        assert_eq!(
            passes[..16],
            [
                (0, None),
                (16, None),
                (32, None),
                (48, None),
                (64, None),
                (80, Some((1, 0, 48))),
                (96, Some((1, 16, 48))),
                (112, Some((1, 32, 48))),
                (128, None),
                (144, None),
                (160, Some((2, 0, 96))),
                (176, Some((2, 16, 96))),
                (192, Some((2, 32, 96))),
                (208, Some((2, 48, 96))),
                (224, Some((2, 64, 96))),
                (240, Some((2, 80, 96))),
            ]
        );
        // The last round has no end: from its second doubling on its guide's shares go on.
        assert_eq!((passes[31], passes[32], passes[40]), ((496, Some((3, 176, 192))), (512, None), (640, Some((3, 192, 192)))));
        assert_eq!((plan.even_before(1), plan.even_before(2), plan.even_before(3), plan.even_before(4)), (64, 80, 112, 176));
        assert_eq!([0, 1, 2, 3].map(|round| plan.steered_until(round)), [0, 64, 128, 256]);
    }

    #[test]
    fn passes_of_fewer_samples_are_the_first_ones_of_more() {
        let most = checked(4099, 7).passes();
        for samples in [1, 16, 63, 64, 70, 128, 500, 4099] {
            for rounds in [7, 64] {
                let plan = checked(samples, rounds);
                let passes = plan.passes();
                assert_eq!(passes.len() as u64, plan.pass_count());
                let (last, whole) = passes.split_last().unwrap();
                if rounds == 7 {
                    assert_eq!(whole, &most[..whole.len()]);
                    assert_eq!(last.slice.map(|s| (s.round, s.of)), most[whole.len()].slice.map(|s| (s.round, s.of)));
                }
                assert_eq!((last.samples.end(), last.samples.first), (samples, whole.len() as u32 * plan.batch));
                for round in 1..rounds {
                    let steering = passes.iter().filter(|pass| pass.slice.is_none() && pass.samples.end() <= plan.steered_until(round));
                    let sum: u32 = steering.map(|pass| pass.samples.count).sum();
                    assert!(sum == plan.even_before(round) || plan.steered_until(round) > samples);
                }
            }
        }
    }

    #[test]
    fn passes_follow_one_another_and_use_every_sample() {
        for (samples, rounds) in [(32, 2), (33, 4), (257, 5), (1000, 8), (4096, 64)] {
            let plan = plan(samples, rounds);
            let passes = plan.passes();
            let mut next = 0;
            for pass in &passes {
                assert_eq!(pass.samples.first, next);
                assert!(pass.samples.count <= plan.batch && pass.samples.count > 0);
                next = pass.samples.end();
            }
            assert_eq!((next, passes.len() as u64), (samples, plan.pass_count()));
            assert!(plan.even_before(1) >= samples / rounds - 1, "{}", plan.even_before(1));
            let first_guided = passes.iter().position(|pass| pass.slice.is_some()).unwrap();
            assert!(passes[first_guided..].iter().all(|pass| pass.slice.is_some()));
            assert_eq!(passes[first_guided].samples.first, plan.even_before(rounds));
            for round in 1..rounds {
                // Batches of even samples end where a round does, and the slices of a guide use all that it places.
                assert!(passes.iter().any(|pass| pass.slice.is_none() && pass.samples.end() == plan.even_before(round)));
                for count in [0, 1, 7, 1000] {
                    let parts = passes.iter().filter_map(|pass| pass.slice).filter(|slice| slice.round == round);
                    let end = parts.fold(0, |from, slice| {
                        assert_eq!(slice.part(count).0, from);
                        slice.part(count).1
                    });
                    assert_eq!(end, if plan.guided_in(round) > 0 { count } else { 0 });
                }
            }
        }
    }
}
