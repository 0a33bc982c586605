//! The states of jobs and frames.

/// Where a job stands. `Done`, `Failed` and `Cancelled` are final.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JobState {
    /// Accepted; no unit was leased yet.
    Queued,
    /// Units are being rendered or frames assembled.
    Running,
    /// Every frame is there.
    Done,
    /// It cannot be finished; the job's error says why.
    Failed,
    /// Somebody called it off.
    Cancelled,
}

impl JobState {
    /// Every state.
    pub const ALL: [JobState; 5] = [JobState::Queued, JobState::Running, JobState::Done, JobState::Failed, JobState::Cancelled];

    /// Name in reports, JSON and the store.
    pub fn name(self) -> &'static str {
        match self {
            JobState::Queued => "queued",
            JobState::Running => "running",
            JobState::Done => "done",
            JobState::Failed => "failed",
            JobState::Cancelled => "cancelled",
        }
    }

    /// Whether nothing can change any more.
    pub fn is_final(self) -> bool {
        matches!(self, JobState::Done | JobState::Failed | JobState::Cancelled)
    }
}

/// Where a frame stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameState {
    /// No unit of it was leased yet.
    Waiting,
    /// Units are being rendered.
    Rendering,
    /// All units are there, and windows over it are not all solved. Told of it, and kept as `Rendering`.
    Rendered,
    /// All units are there; they are being stitched, reconstructed and written.
    Assembling,
    /// Its files are there.
    Done,
    /// It could not be assembled.
    Failed,
}

impl FrameState {
    /// Every state.
    pub const ALL: [FrameState; 6] =
        [FrameState::Waiting, FrameState::Rendering, FrameState::Rendered, FrameState::Assembling, FrameState::Done, FrameState::Failed];

    /// Name in reports, JSON and the store.
    pub fn name(self) -> &'static str {
        match self {
            FrameState::Waiting => "waiting",
            FrameState::Rendering => "rendering",
            FrameState::Rendered => "rendered",
            FrameState::Assembling => "assembling",
            FrameState::Done => "done",
            FrameState::Failed => "failed",
        }
    }
}

/// The files of a finished frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FileKind {
    /// OpenEXR with all layers.
    Exr,
    /// The image tone-mapped to eight bits.
    Png,
    /// What was counted, tile by tile.
    Statistics,
}

impl FileKind {
    /// Every kind.
    pub const ALL: [FileKind; 3] = [FileKind::Exr, FileKind::Png, FileKind::Statistics];

    /// Name in the store; also the usual ending of the file.
    pub fn name(self) -> &'static str {
        match self {
            FileKind::Exr => "exr",
            FileKind::Png => "png",
            FileKind::Statistics => "json",
        }
    }
}
