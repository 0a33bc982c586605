//! What a client submits.

use std::collections::BTreeMap;

use gradfarm_core::plan::{Request, Timeline};
use gradfarm_core::scene::SceneDescription;
use gradfarm_proto::Digest;

use crate::job::Needs;

/// A job to be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Submission {
    /// For people; at most 200 bytes.
    pub name: String,
    /// The scene description as JSON text.
    pub description: String,
    /// Digest of every file that the description refers to, by the relative name it uses. Each must have been put before.
    pub assets: BTreeMap<String, Digest>,
    /// Technique, samples, size and so on; what is left open the plan chooses.
    pub request: Request,
    /// Edge of the tiles [pixels], 1 to 1024. It changes how work is shared, never the bits.
    pub tile: u32,
    /// Which frames: `first .. first + count`.
    pub frames: Frames,
    /// Higher goes first; 0 is usual.
    pub priority: i32,
    /// Names this submission: sending it again with the same token gives the same job.
    pub client_token: Option<String>,
    /// What it asks of the farm: project, pools, tags, amounts, limits. Its share of verified units is `verify`.
    pub needs: Needs,
    /// Share of its units that are rendered by two workers, 0 to 1; `None`: that of the farm.
    pub verify: Option<f64>,
    /// Whether it waits until somebody resumes it.
    pub paused: bool,
}

impl Submission {
    /// The usual edge of tiles [pixels].
    pub const TILE: u32 = 64;
}

/// A run of frames. The default is the single frame 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    /// First frame number; part of every random number's key.
    pub first: u32,
    /// How many, ≥ 1.
    pub count: u32,
}

impl Frames {
    /// Most frames of a job.
    pub const MOST: u32 = 100_000;

    /// The numbers of the frames.
    pub fn range(self) -> std::ops::Range<u32> {
        self.first..self.first.saturating_add(self.count)
    }

    /// What a scene shows where nobody says which frames: its animation from the first key to the last one, or the single frame of a scene
    /// that rests.
    pub fn of(scene: &SceneDescription, timeline: Option<Timeline>) -> Self {
        let range = timeline.unwrap_or_default().frames_of(scene);
        Self { first: range.start, count: range.end - range.start }
    }
}

impl Default for Frames {
    fn default() -> Self {
        Self { first: 0, count: 1 }
    }
}
