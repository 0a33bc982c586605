//! The passes over the film that a frame is made of: in rounds, each of them partly even, partly guided by what came before.
//!
//! The first round gives every pixel the same number of samples. Each later one does so with a part of its share, and places the rest
//! where a [`Guide`](super::Guide) says. Only even samples steer (`adr/0006`), so even passes wait for nothing; the guided passes of a
//! round wait for the even samples of the rounds before. In the order of the sums all even samples come first.

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
    /// Which part of the guide's samples, counted in samples of a pixel that has `of`.
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

    /// The passes of a frame, in the order of their sums.
    pub fn passes(&self) -> Vec<Pass> {
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

    /// How many passes a frame has, without listing them.
    pub fn pass_count(&self) -> u64 {
        let batches = |samples: u32| u64::from(samples.div_ceil(self.batch.max(1)));
        (0..self.rounds).map(|round| batches(self.samples_in(round) - self.guided_in(round)) + batches(self.guided_in(round))).sum()
    }

    /// Even samples per pixel of the rounds before this one.
    pub fn even_before(&self, round: u32) -> u32 {
        (0..round.min(self.rounds)).map(|r| self.samples_in(r) - self.guided_in(r)).sum()
    }

    /// Guided samples per pixel of a round, on average: an even number, half of them for each half of the film.
    pub fn guided_in(&self, round: u32) -> u32 {
        if round == 0 || round >= self.rounds {
            return 0;
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
    use crate::plan::{Plan, Technique};
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
