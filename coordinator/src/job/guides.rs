//! The guides of a frame in rounds: which are there, which is being made, and what the next one still waits for.

use std::sync::Arc;

use gradfarm_core::plan::Guide;

use super::Job;
use super::action::{Action, Errand};
use crate::schedule::Split;

impl Job {
    /// The next guide of a frame, if it is to be made now.
    pub(super) fn next_guide(&mut self, position: u32) -> Option<Action> {
        let needed = self.split.guides_within(self.split.passes_within(self.frames[position as usize].goal));
        self.guides[position as usize].next(position, needed).map(Action::Do)
    }
}

/// What a frame knows of its guides. Nothing of it is stored: guides are made again from results.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FrameGuides {
    made: Vec<Arc<Guide>>,
    /// Round of the guide that was asked for last; 0 before the first.
    asked: u32,
    /// For each round from 1 on, how many of the units that steer its guide are not done.
    missing: Vec<u32>,
}

impl FrameGuides {
    /// Those of a frame that nothing was done for.
    pub(super) fn waiting(split: &Split) -> Self {
        let steer = |round| (0..split.passes().len() as u32).filter(|pass| split.steers(*pass, round)).count() as u32;
        let missing = (1..=split.steering().len() as u32).map(|round| steer(round) * split.units_per_pass()).collect();
        Self { made: Vec::new(), asked: 0, missing }
    }

    /// The guides of rounds 1, 2 and so on.
    pub(super) fn made(&self) -> &[Arc<Guide>] {
        &self.made
    }

    /// Whether a guide is being made.
    pub(super) fn in_the_making(&self) -> bool {
        self.asked as usize > self.made.len()
    }

    /// A unit of this pass is done.
    pub(super) fn done(&mut self, split: &Split, pass: u32) {
        for (missing, round) in self.missing.iter_mut().zip(1..) {
            if split.steers(pass, round) {
                *missing = missing.saturating_sub(1);
            }
        }
    }

    /// A unit of this pass, which was settled, is to be rendered after all. Guides that are made or asked for stay as they are.
    pub(super) fn undone(&mut self, split: &Split, pass: u32) {
        let open = (self.asked as usize).max(self.made.len());
        for (missing, round) in self.missing.iter_mut().zip(1..).skip(open) {
            *missing += u32::from(split.steers(pass, round));
        }
    }

    /// The next guide to make, once: when all that steers it is there, and the guides before it, and the frame goes so far as to need it:
    /// `needed` of them in all.
    pub(super) fn next(&mut self, frame: u32, needed: usize) -> Option<Errand> {
        let due = !self.in_the_making() && self.made.len() < needed && self.missing.get(self.made.len()) == Some(&0);
        due.then(|| {
            self.asked += 1;
            Errand::Guide { frame, round: self.asked }
        })
    }

    /// Whether the guide of this round is being made.
    pub(super) fn awaits(&self, round: u32) -> bool {
        self.in_the_making() && round == self.asked
    }

    /// The guide that was asked for is there.
    pub(super) fn take(&mut self, guide: Arc<Guide>) {
        self.made.push(guide);
    }

    /// All units are done, or none will be: the guides are not needed any more.
    pub(super) fn drop_all(&mut self) {
        *self = Self::default();
    }
}
