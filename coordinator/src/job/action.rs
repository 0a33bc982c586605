//! What is to be done after an event: the machine says it, the service does it, after the changes are durable.

use super::identity::WorkerId;
use super::record::Change;

/// Something to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Make this durable, before anything else of the same event is done.
    Keep(Change),
    /// Tell the worker who delivered.
    Answer(Answer),
    /// Send this lease to the worker.
    Grant {
        /// Unit.
        unit: u32,
        /// Its new epoch.
        epoch: u32,
        /// Who gets it.
        worker: WorkerId,
    },
    /// Tell the worker that this lease is no longer his.
    Revoke {
        /// Unit.
        unit: u32,
        /// Epoch of the lease that is over.
        epoch: u32,
        /// Who held it.
        worker: WorkerId,
    },
    /// Do this to a frame from its results, and report.
    Do(Errand),
    /// The worker failed a unit.
    Blame(WorkerId),
    /// A result of the worker counted.
    Praise(WorkerId),
    /// The worker gave a result that others showed to be wrong.
    Distrust {
        /// Who.
        worker: WorkerId,
        /// For which unit.
        unit: u32,
    },
    /// Tell whoever watches.
    Tell(News),
}

/// Something that is done to a frame, or to a window of moments, from results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errand {
    /// All results of this frame are there: stitch, reconstruct and write it.
    Assemble {
        /// Position of the frame.
        frame: u32,
    },
    /// All results so far are there: reconstruct the frame as it is, and say how good it is.
    Measure {
        /// Position of the frame.
        frame: u32,
    },
    /// The results that steer a round are there: make its guide.
    Guide {
        /// Position of the frame.
        frame: u32,
        /// The round, from 1.
        round: u32,
    },
    /// All moments of this window are rendered: solve for them together.
    Window {
        /// Number of the window.
        window: u32,
    },
    /// The job is over: let go of what is kept between its windows.
    Release,
}

/// The answer to a delivery.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The result counts, now or since an earlier delivery.
    Accepted,
    /// The lease is over.
    Superseded,
    /// The result is wrong.
    Refused(String),
}

/// What changed, for those who watch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// The state of the job.
    Job,
    /// The state of the frame at this position.
    Frame(u32),
    /// The frame at this position has one more point.
    Accuracy(u32),
    /// The state of this window.
    Window(u32),
    /// A tile has one more result.
    Tile {
        /// Position of the frame.
        frame: u32,
        /// Index of the tile.
        tile: u32,
    },
}
