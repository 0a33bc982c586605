//! The JSON shapes of the API, read by clients and written by the server. Only this file knows them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use super::accuracy_json::{Accuracy, AccuracyCost, AccuracyFit, AccuracyPoint, AccuracyPrice};
pub use super::schedule_json::{Attempt, DryRun, FailedUnit, Needs, Waiting};

/// So much of so much.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Count {
    /// Finished.
    pub done: u64,
    /// All there is to do.
    pub total: u64,
}

impl Count {
    /// Finished part, from 0 to 1.
    pub fn fraction(self) -> f64 {
        if self.total == 0 { 0.0 } else { self.done as f64 / self.total as f64 }
    }
}

/// How far a job or frame has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Progress {
    /// Units of work.
    pub units: Count,
    /// Camera samples.
    pub samples: Count,
}

/// A job in a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobSummary {
    /// Its name for the farm.
    pub id: String,
    /// Its name for people.
    pub name: String,
    /// `queued`, `running`, `done`, `failed` or `cancelled`.
    pub state: String,
    /// Whether it gets no leases for the time being.
    #[serde(default)]
    pub paused: bool,
    /// Why it failed.
    pub error: Option<String>,
    /// Higher goes first.
    pub priority: i32,
    /// When it was accepted [ms since 1970].
    pub created_ms: i64,
    /// When its first unit was leased [ms since 1970].
    pub started_ms: Option<i64>,
    /// When it reached its final state [ms since 1970].
    pub finished_ms: Option<i64>,
    /// Frames that have their files.
    pub frames_done: u64,
    /// Frames.
    pub frames_total: u64,
    /// Units that were given up: frames are made without them.
    #[serde(default)]
    pub failed_units: u64,
    /// How far it has come.
    pub progress: Progress,
}

impl JobSummary {
    /// Whether nothing can change any more.
    pub fn is_over(&self) -> bool {
        is_final(&self.state)
    }
}

/// Whether a job in this state can no longer change.
pub fn is_final(state: &str) -> bool {
    crate::job::JobState::ALL.iter().any(|known| known.name() == state && known.is_final())
}

/// A page of the list of jobs, newest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobPage {
    /// The jobs.
    pub jobs: Vec<JobSummary>,
    /// What to ask for as `cursor` to get the next page; absent on the last one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

/// A job in full.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Job {
    /// What the list says.
    #[serde(flatten)]
    pub summary: JobSummary,
    /// The plan, with the reason for each choice.
    pub plan: PlanView,
    /// Digest of the scene and all its files.
    pub scene: String,
    /// Edge of the tiles [pixels].
    pub tile: u32,
    /// What it asks of the farm.
    #[serde(default)]
    pub needs: Needs,
    /// Why it gets no worker at this moment, if it waits for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waiting: Option<Waiting>,
    /// Its frames, in order.
    pub frames: Vec<Frame>,
    /// Its windows, in order, where frames are reconstructed together.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub windows: Vec<Window>,
    /// Where the time went.
    pub seconds: Seconds,
    /// Counters summed over the finished frames.
    pub statistics: BTreeMap<String, u64>,
}

/// What the bits of an image depend on besides the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanView {
    /// Film width [pixels].
    pub width: u32,
    /// Film height [pixels].
    pub height: u32,
    /// Technique.
    pub technique: String,
    /// Reconstruction.
    pub reconstruction: String,
    /// Weight of the primal in the reconstruction; null: the one that the measured noise calls for.
    pub alpha: Option<f32>,
    /// Whether negative values of the finished image become zero, which biases it.
    #[serde(default)]
    pub clamp: bool,
    /// Samples per pixel; the most where frames may stop early.
    pub samples: u32,
    /// Samples per unit of work.
    pub batch: u32,
    /// Seed of all randomness.
    pub seed: u64,
    /// Longest path [edges].
    pub max_depth: u32,
    /// Edges after which Russian roulette starts.
    pub roulette_depth: u32,
    /// Shift.
    pub shift: String,
    /// Roughness at and above which a vertex counts as connectable.
    pub shift_threshold: f32,
    /// Least probability with which Russian roulette lets a shift happen.
    pub shift_survival: f32,
    /// Edge of the groups of pixels that reuse one another's paths [pixels].
    pub reuse_edge: u32,
    /// Most links of a pixel to similar ones.
    pub links: u32,
    /// Rounds in which samples are placed.
    pub rounds: u32,
    /// Estimated relMSE at which a frame stops.
    #[serde(default)]
    pub stop_error: Option<f64>,
    /// Wall-clock time of a frame at which it stops [s].
    #[serde(default)]
    pub stop_seconds: Option<f64>,
    /// When frames are, where the scene is animated.
    #[serde(default)]
    pub timeline: Option<Timeline>,
    /// How frames are reconstructed together, if they are.
    #[serde(default)]
    pub temporal: Option<Temporal>,
    /// Why each choice was made.
    pub reasons: Vec<String>,
}

/// When frames are and how they are exposed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Timeline {
    /// Frames per second.
    pub fps: f64,
    /// Share of a frame's time in which the shutter is open.
    pub shutter: f64,
    /// Instants at which the shutter sees the scene.
    pub instants: u32,
}

/// How moments are reconstructed together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Temporal {
    /// Moments of a window.
    pub window: u32,
    /// Moments from window to window.
    pub stride: u32,
    /// Whether differences in time follow what moves.
    pub motion: bool,
}

/// The frames `first .. end`, which show the same image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Moment {
    /// The first one.
    pub first: u32,
    /// The one after the last.
    pub end: u32,
}

/// A window of moments that is reconstructed as a whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Window {
    /// Counts from 0.
    pub number: u32,
    /// Its first frame.
    pub first: u32,
    /// The frame after its last.
    pub end: u32,
    /// `waiting`, `solving` or `solved`.
    pub state: String,
    /// Adding up and solving, once it is solved [s].
    pub seconds: Option<f64>,
}

/// A frame of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Frame {
    /// Frame number.
    pub number: u32,
    /// The frames that show the same image; what is told of one of them holds for all.
    #[serde(default)]
    pub moment: Option<Moment>,
    /// `waiting`, `rendering`, `rendered` (it waits for windows), `assembling`, `done` or `failed`.
    pub state: String,
    /// How far it has come.
    pub progress: Progress,
    /// Where the time went.
    pub seconds: Seconds,
    /// Estimated relMSE of the finished image, where its two halves can tell.
    pub estimated_relmse: Option<f64>,
    /// Which reconstruction was chosen for it and why, where the plan leaves that to the film.
    pub choice: Option<String>,
    /// Samples per pixel of its image, or to which it is being rendered.
    pub samples_per_pixel: u32,
    /// Why it went no further where it might have: `error`, `seconds` or `samples`.
    pub stopped: Option<String>,
    /// The error that was measured last, with its interval.
    pub error: Option<ErrorEstimate>,
    /// Units that were given up, with the evidence: the image is made without them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failed: Vec<FailedUnit>,
    /// Units whose results came from a worker that was found to be wrong, and were not checked.
    #[serde(default)]
    pub suspect_units: u64,
    /// Why the frame could not be assembled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Counters summed over its units.
    pub statistics: BTreeMap<String, u64>,
    /// Addresses of its files, once they are there, by kind (`exr`, `png`).
    pub files: BTreeMap<String, String>,
}

/// An error that was estimated without a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorEstimate {
    /// Estimated relMSE.
    pub relmse: f64,
    /// Lower end of its 95 % confidence interval.
    pub low: f64,
    /// Upper end of it.
    pub high: f64,
}

/// Where the time went [s].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Seconds {
    /// Fetching scenes and assets, summed over workers.
    pub load: f64,
    /// Compiling scenes, summed over workers.
    pub compile: f64,
    /// Tracing, summed over threads.
    pub render: f64,
    /// From the first lease to the last accepted result.
    pub render_span: f64,
    /// Reading results and adding them up.
    pub stitch: f64,
    /// Reconstruction.
    pub reconstruct: f64,
    /// Encoding and storing the files.
    pub write: f64,
}

/// The tiles of a frame, row by row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Tiles {
    /// The tiles.
    pub tiles: Vec<Tile>,
}

/// A tile of a frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Sample ranges of this tile.
    pub units: Count,
    /// How many of them are leased at this moment.
    pub leased: u64,
    /// How many of them were given up.
    #[serde(default)]
    pub failed: u64,
    /// Who holds these, as in [`Worker`], each once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub workers: Vec<String>,
}

/// The connected workers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Workers {
    /// The workers.
    pub workers: Vec<Worker>,
}

/// A worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Worker {
    /// Its name for the farm.
    pub id: String,
    /// Its name for people.
    pub name: String,
    /// Version of its software.
    pub version: String,
    /// Rendering threads.
    pub threads: u32,
    /// Its pool; empty: none.
    #[serde(default)]
    pub pool: String,
    /// Its tags.
    #[serde(default)]
    pub tags: Vec<String>,
    /// Memory [bytes]; 0: it did not say.
    #[serde(default)]
    pub memory: u64,
    /// When it connected [ms since 1970].
    pub connected_ms: i64,
    /// When it was last heard [ms since 1970].
    pub heard_ms: i64,
    /// Leases it holds.
    pub leases: u64,
    /// Results that counted.
    pub delivered: u64,
    /// Units it failed.
    pub failed: u64,
    /// It gets no work until then, for it failed too often in a row or was wrong [ms since 1970].
    pub set_aside_until_ms: Option<i64>,
    /// An operator lets it finish what it holds, and gives it nothing new.
    #[serde(default)]
    pub draining: bool,
    /// Results of its that others showed to be wrong.
    #[serde(default)]
    pub lies: u32,
}

/// Jobs that changed, as an event of the farm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FarmJobs {
    /// The jobs, newest first.
    pub jobs: Vec<JobSummary>,
}

/// Something that happened to a job. The name of the server-sent event is the key: `state`, `progress`, `tile`,
/// `accuracy`, `window` or `frame`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The job's state; the first event of every stream, and after a final state the last.
    State {
        /// As in [`JobSummary`].
        state: String,
        /// Why it failed.
        error: Option<String>,
    },
    /// Results counted.
    Progress {
        /// Units of work.
        units: Count,
        /// Camera samples.
        samples: Count,
        /// Time since the first lease [s].
        elapsed: f64,
    },
    /// A tile has one more sample range.
    Tile {
        /// Frame number.
        frame: u32,
        /// Index of the tile, row by row.
        tile: u32,
        /// Sample ranges.
        units: Count,
    },
    /// The error of a frame was measured.
    Accuracy {
        /// Frame number.
        frame: u32,
        /// What was found.
        point: AccuracyPoint,
        /// The error to reach.
        target: Option<f64>,
        /// Wall-clock time until the frame stops, as far as one can tell [s].
        seconds_left: Option<f64>,
    },
    /// A window's state.
    Window(Window),
    /// A frame's state.
    Frame {
        /// Frame number.
        frame: u32,
        /// The frame after the last one that shows the same; 0 from a coordinator that does not tell.
        #[serde(default)]
        end: u32,
        /// As in [`Frame`].
        state: String,
    },
}

/// An uploaded file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Asset {
    /// BLAKE3 of its bytes, hexadecimal.
    pub digest: String,
    /// Its length.
    pub bytes: u64,
}

/// Whether the coordinator works.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Health {
    /// `ok`.
    pub status: String,
    /// Version of the coordinator.
    pub version: String,
}
