//! What is kept of every attempt at a unit that came to nothing: who, when and why. A unit that is given up is judged by it, and so are workers.

use super::identity::WorkerId;
use crate::clock::Timestamp;

/// How an attempt ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ending {
    /// The worker said that it failed, or its result was no result.
    Failed,
    /// The worker's connection broke.
    Lost,
    /// The lease ran out.
    Expired,
    /// The worker lived on, but the unit came no further.
    Stuck,
    /// The result was not the one that others had.
    Differed,
}

impl Ending {
    /// Every ending.
    pub const ALL: [Ending; 5] = [Ending::Failed, Ending::Lost, Ending::Expired, Ending::Stuck, Ending::Differed];

    /// Name in reports, JSON and the store.
    pub fn name(self) -> &'static str {
        match self {
            Ending::Failed => "failed",
            Ending::Lost => "lost",
            Ending::Expired => "expired",
            Ending::Stuck => "stuck",
            Ending::Differed => "differed",
        }
    }
}

/// An attempt at a unit that came to nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attempt {
    /// Who had it.
    pub worker: WorkerId,
    /// Under which epoch.
    pub epoch: u32,
    /// When it ended.
    pub at: Timestamp,
    /// How.
    pub ending: Ending,
    /// In words.
    pub reason: String,
}
