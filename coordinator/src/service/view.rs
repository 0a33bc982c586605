//! What can be seen of jobs, frames, tiles and workers from outside.

use gradfarm_core::accuracy::{Curve, Estimate, Point, Reason, Stop};
use gradfarm_core::film::Statistics;
use gradfarm_core::lattice::{Moment, SampleRange, Tile};
use gradfarm_core::plan::Plan;
use gradfarm_proto::Digest;

use crate::job::{Attempt, Capabilities, FrameState, JobId, JobState, Needs, Seconds, Timestamp, WorkerId};
use crate::schedule::Waiting;

/// So much of so much.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Finished.
    pub done: u64,
    /// All there is to do.
    pub total: u64,
}

/// A job in a list.
#[derive(Clone, Debug, PartialEq)]
pub struct JobSummary {
    /// Its name.
    pub id: JobId,
    /// What the client called it.
    pub name: String,
    /// Where it stands.
    pub state: JobState,
    /// Whether it gets no leases for the time being.
    pub paused: bool,
    /// Why it failed.
    pub error: Option<String>,
    /// Higher goes first.
    pub priority: i32,
    /// When it was accepted.
    pub created: Timestamp,
    /// When its first unit was leased.
    pub started: Option<Timestamp>,
    /// When it reached its final state.
    pub finished: Option<Timestamp>,
    /// Frames.
    pub frames: Count,
    /// Units that were given up: frames are made without them.
    pub failed_units: u64,
    /// Units of work; an estimate of the total where frames may stop early.
    pub units: Count,
    /// Camera samples: pixels × samples per pixel × frames. The total is an estimate where frames may stop early.
    pub samples: Count,
}

/// A job in full.
#[derive(Clone, Debug, PartialEq)]
pub struct JobView {
    /// What the list says.
    pub summary: JobSummary,
    /// The plan, with the reason for each choice.
    pub plan: Plan,
    /// Digest of the scene's manifest.
    pub scene: Digest,
    /// Edge of the tiles [pixels].
    pub tile: u32,
    /// What it asks of the farm.
    pub needs: Needs,
    /// Why it gets no worker at this moment, if it waits for one.
    pub waiting: Option<Waiting>,
    /// Its frames, in order.
    pub frames: Vec<FrameView>,
    /// Its windows, in order, where moments are reconstructed together.
    pub windows: Vec<WindowView>,
    /// Sums over its frames, but for `render_span`, which runs from the job's first lease to its last result.
    pub seconds: Seconds,
    /// Counters summed over the finished frames.
    pub statistics: Statistics,
}

/// A window of moments that is reconstructed as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowView {
    /// Counts from 0.
    pub number: u32,
    /// Its first frame.
    pub first: u32,
    /// The frame after its last.
    pub end: u32,
    /// `waiting`, `solving` or `solved`.
    pub state: &'static str,
    /// Adding up and solving, once it is solved [s].
    pub seconds: Option<f64>,
}

/// A frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameView {
    /// Frame number.
    pub number: u32,
    /// The frames that show the same image. What is said below is that of the image.
    pub moment: Moment,
    /// Where it stands.
    pub state: FrameState,
    /// Units of work.
    pub units: Count,
    /// Camera samples.
    pub samples: Count,
    /// Where the time went.
    pub seconds: Seconds,
    /// Estimated relMSE of the finished image, where the two halves can tell.
    pub estimated_relmse: Option<f64>,
    /// Which reconstruction was chosen for it and why, where the plan leaves that to the film.
    pub choice: Option<String>,
    /// Counters summed over its units; zero until it is assembled.
    pub statistics: Statistics,
    /// Samples per pixel of its image, or to which it is being rendered.
    pub samples_per_pixel: u32,
    /// Why it went no further, where it might have.
    pub stopped: Option<Reason>,
    /// The error that was measured last.
    pub error: Option<Estimate>,
    /// Units that were given up, with the evidence: the image is made without them.
    pub failed: Vec<FailedUnitView>,
    /// Units whose results came from a worker that was found to be wrong, and were not checked.
    pub suspect_units: u32,
    /// Why the frame could not be assembled.
    pub failure: Option<String>,
}

/// A unit that was given up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FailedUnitView {
    /// Its pixels.
    pub tile: Tile,
    /// Its samples.
    pub samples: SampleRange,
    /// What was tried, in order.
    pub attempts: Vec<AttemptView>,
}

/// An attempt at a unit that came to nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttemptView {
    /// What is known of it.
    pub attempt: Attempt,
    /// The worker's name for people, if it connected since the coordinator started.
    pub name: Option<String>,
}

/// What accuracy cost in a frame, and what more of it would cost.
#[derive(Clone, Debug, PartialEq)]
pub struct AccuracyView {
    /// The job's name for people.
    pub name: String,
    /// Frame number.
    pub frame: u32,
    /// Where it stands.
    pub state: FrameState,
    /// When it stops.
    pub stop: Stop,
    /// Most samples per pixel.
    pub most_samples: u32,
    /// With how many samples per pixel it will stop, as far as one can tell.
    pub expected_samples: u32,
    /// Why it stopped, where it might have gone on.
    pub stopped: Option<Reason>,
    /// The points and the laws through them.
    pub curve: Curve,
}

/// A tile of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileView {
    /// Its pixels.
    pub tile: Tile,
    /// Passes (units of work) over this tile.
    pub units: Count,
    /// How many of them are leased at this moment.
    pub leased: u64,
    /// How many of them were given up.
    pub failed: u64,
    /// Who holds these, each once.
    pub workers: Vec<WorkerId>,
}

/// A worker.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkerView {
    /// Its name for the farm.
    pub id: WorkerId,
    /// Its name for people.
    pub name: String,
    /// Version of its software.
    pub version: String,
    /// Rendering threads.
    pub threads: u32,
    /// What it has to offer.
    pub capabilities: Capabilities,
    /// When it connected.
    pub connected: Timestamp,
    /// When it was last heard.
    pub heard: Timestamp,
    /// Leases it holds.
    pub leases: u64,
    /// Results that counted, since it connected.
    pub delivered: u64,
    /// Units it failed, since it connected.
    pub failed: u64,
    /// It gets no work until then, for it failed too often in a row or was wrong.
    pub set_aside_until: Option<Timestamp>,
    /// An operator lets it finish what it holds, and gives it nothing new.
    pub draining: bool,
    /// Results of its that others showed to be wrong.
    pub lies: u32,
}

/// Something that happened to a job.
#[derive(Clone, Debug, PartialEq)]
pub enum JobEvent {
    /// The job's state, when it changes and when a subscription begins. After a final state the stream ends.
    State {
        /// The state.
        state: JobState,
        /// Why it failed.
        error: Option<String>,
    },
    /// How far the job is, whenever a result counts and when a subscription begins.
    Progress {
        /// Units of work.
        units: Count,
        /// Camera samples.
        samples: Count,
        /// Time since the first lease [s].
        elapsed: f64,
    },
    /// A tile has the result of one more pass.
    Tile {
        /// Frame number.
        frame: u32,
        /// Index of the tile, row by row.
        tile: u32,
        /// Passes.
        units: Count,
    },
    /// The error of a frame was measured.
    Accuracy {
        /// Frame number.
        frame: u32,
        /// What was found.
        point: Point,
        /// The error to reach.
        target: Option<f64>,
        /// Wall-clock time until the frame stops, as far as one can tell [s].
        seconds_left: Option<f64>,
    },
    /// A window of moments changed its state.
    Window {
        /// The window.
        window: WindowView,
    },
    /// Frames that show one moment changed their state.
    Frame {
        /// Number of the first one.
        frame: u32,
        /// The one after the last.
        end: u32,
        /// The state.
        state: FrameState,
    },
}
