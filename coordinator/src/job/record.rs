//! What is kept of a job, and the changes that the store is asked to make durable.

use gradfarm_core::lattice::Moment;
use gradfarm_core::plan::Plan;
use gradfarm_proto::Digest;

use super::evidence::Attempt;
use super::frame::Frame;
use super::identity::{JobId, WorkerId};
use super::needs::Needs;
use super::state::{FileKind, JobState};
use super::verify::Witness;
use super::windows::SolvedWindow;
use crate::clock::Timestamp;

/// What never changes about a job, but for its priority.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRecord {
    /// Its name for the farm.
    pub id: JobId,
    /// Its name for people.
    pub name: String,
    /// Higher goes first.
    pub priority: i32,
    /// When it was accepted.
    pub created: Timestamp,
    /// The client's name for the submission.
    pub client_token: Option<String>,
    /// Digest of the scene's manifest.
    pub scene: Digest,
    /// The plan.
    pub plan: Plan,
    /// Edge of the tiles [pixels].
    pub tile: u32,
    /// Number of the first frame.
    pub first_frame: u32,
    /// How many frames.
    pub frame_count: u32,
    /// The moments that the frames show, in order. Kept, so that no later version of this software splits them otherwise.
    pub moments: Vec<Moment>,
    /// What it asks of the farm.
    pub needs: Needs,
}

/// A result that counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeliveredRecord {
    /// Digest of the block's encoding.
    pub content: Digest,
    /// Digest of the compressed form: its name among the blobs.
    pub blob: Digest,
    /// Size of the encoding before compression [bytes].
    pub size: u64,
    /// Waiting for scene and assets [s].
    pub load: f64,
    /// Compiling the scene [s].
    pub compile: f64,
    /// Tracing [s].
    pub render: f64,
}

/// A file of a finished frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileRecord {
    /// Which.
    pub kind: FileKind,
    /// Its name among the blobs.
    pub blob: Digest,
    /// Its size [bytes].
    pub size: u64,
}

/// One change to what is kept. A batch of changes becomes durable together or not at all.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A new job; its frames wait, its units are ready.
    Submitted(Box<JobRecord>),
    /// The job's state.
    Job {
        /// The job.
        job: JobId,
        /// Its state.
        state: JobState,
        /// Why it failed.
        error: Option<String>,
        /// When its first unit was leased.
        started: Option<Timestamp>,
        /// When it reached its final state.
        finished: Option<Timestamp>,
    },
    /// A frame's state and sums.
    Frame {
        /// The job.
        job: JobId,
        /// Position of the frame.
        position: u32,
        /// The frame.
        frame: Box<Frame>,
    },
    /// A unit was leased. Refused unless the stored epoch is one less and the unit is not done.
    Leased {
        /// The job.
        job: JobId,
        /// The unit.
        unit: u32,
        /// The new epoch.
        epoch: u32,
        /// Who got it.
        worker: WorkerId,
        /// When.
        at: Timestamp,
    },
    /// A unit's lease ended without a result.
    Freed {
        /// The job.
        job: JobId,
        /// The unit.
        unit: u32,
        /// How often it failed so far.
        failures: u32,
        /// How often its worker was lost so far.
        losses: u32,
        /// Whether it is given up, or is to be tried again.
        given_up: bool,
    },
    /// An attempt at a unit came to nothing.
    Attempt {
        /// The job.
        job: JobId,
        /// The unit.
        unit: u32,
        /// How many attempts were noted before.
        number: u32,
        /// What is known of it.
        attempt: Attempt,
    },
    /// What a worker gave for a unit that others render, too. Its lease is over.
    Witness {
        /// The job.
        job: JobId,
        /// The unit.
        unit: u32,
        /// What it gave.
        witness: Witness,
    },
    /// A unit's result counts no longer: its worker was found to give wrong ones. The unit waits under a new epoch.
    Withdrawn {
        /// The job.
        job: JobId,
        /// The unit.
        unit: u32,
        /// The new epoch.
        epoch: u32,
    },
    /// The job's priority.
    Priority {
        /// The job.
        job: JobId,
        /// Higher goes first.
        priority: i32,
    },
    /// A unit's result counts. Refused unless the stored epoch is this one and the unit is not done.
    Delivered {
        /// The job.
        job: JobId,
        /// The unit.
        unit: u32,
        /// The epoch of the lease.
        epoch: u32,
        /// Who made it.
        worker: WorkerId,
        /// The result.
        result: DeliveredRecord,
    },
    /// A file of a frame.
    File {
        /// The job.
        job: JobId,
        /// Position of the frame.
        position: u32,
        /// The file.
        file: FileRecord,
    },
    /// A window of moments is solved. Written once.
    Window {
        /// The job.
        job: JobId,
        /// Number of the window.
        window: u32,
        /// What it says, and how it went.
        solved: Box<SolvedWindow>,
    },
    /// The job gets no leases from now on, or gets them again.
    Paused {
        /// The job.
        job: JobId,
        /// Which of the two.
        paused: bool,
    },
    /// A job that is over is no longer kept, nor is anything of it.
    Forgotten {
        /// The job.
        job: JobId,
    },
    /// A worker connected.
    Worker {
        /// Its name for the farm.
        worker: WorkerId,
        /// Its name for people.
        name: String,
        /// Version of its software.
        version: String,
        /// Rendering threads.
        threads: u32,
        /// When.
        at: Timestamp,
    },
}

/// A job as the store has it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredJob {
    /// What never changes.
    pub record: JobRecord,
    /// Where it stands.
    pub state: JobState,
    /// Why it failed.
    pub error: Option<String>,
    /// When its first unit was leased.
    pub started: Option<Timestamp>,
    /// When it reached its final state.
    pub finished: Option<Timestamp>,
    /// Whether it gets no leases.
    pub paused: bool,
    /// Windows that are solved, in order.
    pub windows: Vec<(u32, SolvedWindow)>,
    /// Frames that something was kept of, by position.
    pub frames: Vec<(u32, Frame)>,
    /// Units that were ever leased, in order; empty for jobs that are done with no unit given up.
    pub units: Vec<StoredUnit>,
    /// Attempts that came to nothing, by unit, in order.
    pub attempts: Vec<(u32, Attempt)>,
    /// What workers gave for units that are compared, by unit, in order.
    pub witnesses: Vec<(u32, Witness)>,
}

/// A unit that was leased at least once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredUnit {
    /// The unit.
    pub unit: u32,
    /// Epoch of its last lease.
    pub epoch: u32,
    /// How often it failed.
    pub failures: u32,
    /// How often its worker was lost.
    pub losses: u32,
    /// Whether it is given up.
    pub given_up: bool,
    /// Who holds it.
    pub lease: Option<WorkerId>,
    /// Its result.
    pub result: Option<DeliveredRecord>,
    /// Who made the result.
    pub worker: Option<WorkerId>,
}
