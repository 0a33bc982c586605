//! One job: what it is, which states it passes through, and the pure machine that moves it.

mod identity;
mod state;
mod time;

pub use identity::{JobId, ParseIdError, WorkerId};
pub use state::{FileKind, FrameState, JobState};
pub use time::Timestamp;
