//! What can happen to a job. One file for each event.

mod assembled;
mod cancelled;
mod delivered;
mod distrusted;
mod failed;
mod guided;
mod leased;
mod measured;
mod paused;
mod released;
mod renewed;
mod retried;
mod solved;
mod submitted;

use super::evidence::Ending;
use super::identity::WorkerId;
use super::record::{DeliveredRecord, FileRecord};
use super::{Action, Job, Seconds, SolvedWindow};
use crate::clock::Timestamp;
use gradfarm_core::accuracy::Estimate;
use gradfarm_core::film::Statistics;
use gradfarm_core::plan::Guide;
use std::sync::Arc;

pub use submitted::submit;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The schedule gives a ready unit to a worker.
    Leased {
        /// Unit.
        unit: u32,
        /// Who gets it.
        worker: WorkerId,
        /// Until when, unless renewed.
        until: Timestamp,
    },
    /// A worker says that it still holds a lease: by a heartbeat, or by coming back.
    Renewed {
        /// Unit.
        unit: u32,
        /// Epoch of its lease.
        epoch: u32,
        /// Who holds it.
        worker: WorkerId,
        /// Until when it lives now.
        until: Timestamp,
    },
    /// A worker hands a lease back, through no fault of the unit.
    Returned {
        /// Unit.
        unit: u32,
        /// Epoch of its lease.
        epoch: u32,
        /// Who held it.
        worker: WorkerId,
    },
    /// The connection to a worker broke.
    Lost {
        /// Which.
        worker: WorkerId,
    },
    /// Time went by: leases may have run out.
    Expired,
    /// A checked and stored result.
    Delivered {
        /// Unit.
        unit: u32,
        /// Epoch of the lease that it was made under.
        epoch: u32,
        /// Who made it.
        worker: WorkerId,
        /// The result.
        result: DeliveredRecord,
    },
    /// A worker could not carry out a unit, or its result was wrong.
    Failed {
        /// Unit.
        unit: u32,
        /// Epoch of its lease.
        epoch: u32,
        /// Who failed.
        worker: WorkerId,
        /// Why.
        reason: String,
    },
    /// Somebody calls the job off.
    Cancelled,
    /// A frame was assembled, or could not be.
    Assembled {
        /// Position of the frame.
        frame: u32,
        /// The outcome.
        outcome: Result<Assembled, String>,
    },
    /// The error of a frame as it is was measured, or could not be.
    Measured {
        /// Position of the frame.
        frame: u32,
        /// The outcome.
        outcome: Result<Measured, String>,
    },
    /// The guide of a round was made, or could not be.
    Guided {
        /// Position of the frame.
        frame: u32,
        /// The round.
        round: u32,
        /// The outcome.
        outcome: Result<Arc<Guide>, String>,
    },
    /// A window of moments was solved, or could not be.
    Solved {
        /// Number of the window.
        window: u32,
        /// The outcome.
        outcome: Result<SolvedWindow, String>,
    },
    /// Somebody pauses the job, or lets it go on.
    Paused {
        /// Which of the two.
        paused: bool,
    },
    /// Somebody changes how urgent it is.
    Prioritised {
        /// Higher goes first.
        priority: i32,
    },
    /// Somebody wants what failed to be tried again.
    Retried {
        /// Position of the one frame that is meant; all of them otherwise.
        frame: Option<u32>,
    },
    /// A unit came no further for too long, though its worker lives.
    Stuck {
        /// Unit.
        unit: u32,
        /// Epoch of its lease.
        epoch: u32,
        /// Who holds it.
        worker: WorkerId,
        /// For how long, in words.
        reason: String,
    },
    /// A worker was found to give wrong results.
    Distrusted {
        /// Who.
        worker: WorkerId,
    },
}

/// A frame that is finished and stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Assembled {
    /// Its files.
    pub files: Vec<FileRecord>,
    /// Units that it is made of.
    pub units: u32,
    /// Stitching, reconstructing and writing; the rest is zero.
    pub seconds: Seconds,
    /// Its error, where the halves can tell.
    pub error: Option<Estimate>,
    /// Which reconstruction was chosen for it and why, where the plan leaves that to the film.
    pub choice: Option<String>,
    /// Counters of all its units.
    pub statistics: Statistics,
}

/// How good a frame is at its present samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Samples per pixel that it was measured with.
    pub samples: u32,
    /// Its error, where the halves can tell.
    pub error: Option<Estimate>,
    /// Stitching and reconstructing [s].
    pub seconds: f64,
}

impl Event {
    pub(super) fn apply(self, job: &mut Job, now: Timestamp) -> Vec<Action> {
        match self {
            Event::Leased { unit, worker, until } => leased::apply(job, unit, worker, until, now),
            Event::Renewed { unit, epoch, worker, until } => renewed::apply(job, unit, epoch, worker, until),
            Event::Returned { unit, epoch, worker } => released::returned(job, unit, epoch, worker),
            Event::Lost { worker } => released::lost(job, worker, now),
            Event::Expired => released::expired(job, now),
            Event::Delivered { unit, epoch, worker, result } => delivered::apply(job, unit, epoch, worker, result, now),
            Event::Failed { unit, epoch, worker, reason } => failed::apply(job, unit, epoch, worker, reason, Ending::Failed, now),
            Event::Stuck { unit, epoch, worker, reason } => {
                let mut actions = failed::apply(job, unit, epoch, worker, reason, Ending::Stuck, now);
                if !actions.is_empty() {
                    actions.push(Action::Revoke { unit, epoch, worker });
                }
                actions
            }
            Event::Cancelled => cancelled::apply(job, now),
            Event::Assembled { frame, outcome } => assembled::apply(job, frame, outcome, now),
            Event::Measured { frame, outcome } => measured::apply(job, frame, outcome, now),
            Event::Guided { frame, round, outcome } => guided::apply(job, frame, round, outcome, now),
            Event::Solved { window, outcome } => solved::apply(job, window, outcome, now),
            Event::Paused { paused } => paused::apply(job, paused),
            Event::Prioritised { priority } => retried::prioritised(job, priority),
            Event::Retried { frame } => retried::apply(job, frame, now),
            Event::Distrusted { worker } => distrusted::apply(job, worker),
        }
    }
}
