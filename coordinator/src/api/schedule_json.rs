//! The JSON shapes of what the schedule says: what a job asks of the farm, why it waits, units that were given up and why.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::json::PlanView;
use crate::job;
use crate::schedule;
use crate::service::{self, FailedUnitView};

/// What a job asks of the farm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Needs {
    /// The project that it belongs to; empty: none in particular.
    pub project: String,
    /// Pools whose workers may render it; empty: all.
    pub pools: Vec<String>,
    /// Tags that a worker must have.
    pub tags: Vec<String>,
    /// Least memory of a worker [bytes].
    pub memory: u64,
    /// Least threads of a worker.
    pub threads: u32,
    /// Named limits that its leases count against.
    pub limits: Vec<String>,
    /// Most workers at once.
    pub max_workers: Option<u32>,
    /// Share of its units that are rendered by two workers and compared.
    pub verify: f64,
}

impl From<job::Needs> for Needs {
    fn from(needs: job::Needs) -> Self {
        let job::Needs { project, pools, tags, memory, threads, limits, most_workers, verify } = needs;
        let [pools, tags, limits] = [pools, tags, limits].map(|names| names.into_iter().collect());
        Self { project, pools, tags, memory, threads, limits, max_workers: most_workers, verify }
    }
}

/// Why a job gets no worker at this moment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Waiting {
    /// One word: `paused`, `making`, `no_worker`, `none_fits`, `limit`, `priority`, `share` or `busy`.
    pub reason: String,
    /// For people.
    pub detail: String,
}

impl From<&schedule::Waiting> for Waiting {
    fn from(waiting: &schedule::Waiting) -> Self {
        Self { reason: waiting.name().to_owned(), detail: waiting.to_string() }
    }
}

/// What would become of a submission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DryRun {
    /// The plan, with the reason for each choice.
    pub plan: PlanView,
    /// Units that it falls into, at most.
    pub units: u64,
    /// Frames.
    pub frames: u64,
    /// Images: frames that show the same are one.
    pub moments: u64,
    /// Digests of the files that would have to be uploaded first.
    pub missing: Vec<String>,
    /// Workers that are connected.
    pub workers: u64,
    /// Of these, the ones that may render it.
    pub fitting: u64,
    /// What the others lack.
    pub lacks: Vec<String>,
}

impl From<service::DryRun> for DryRun {
    fn from(run: service::DryRun) -> Self {
        Self {
            plan: (&run.plan).into(),
            units: run.units,
            frames: run.frames,
            moments: run.moments,
            missing: run.missing.iter().map(ToString::to_string).collect(),
            workers: run.workers,
            fitting: run.fitting,
            lacks: run.lacks.iter().map(ToString::to_string).collect(),
        }
    }
}

/// A unit that was given up: its frame's image is made without it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FailedUnit {
    /// First column of its tile.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// First sample of each pixel.
    pub first_sample: u32,
    /// Samples of each pixel.
    pub samples: u32,
    /// What was tried, in order.
    pub attempts: Vec<Attempt>,
}

/// An attempt at a unit that came to nothing.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Attempt {
    /// Who had it.
    pub worker: String,
    /// The worker's name for people, if it is known.
    pub name: Option<String>,
    /// When it ended [ms since 1970].
    pub at_ms: i64,
    /// How: `failed`, `lost`, `expired`, `stuck` or `differed`.
    pub ending: String,
    /// In words.
    pub reason: String,
}

impl From<&FailedUnitView> for FailedUnit {
    fn from(view: &FailedUnitView) -> Self {
        let attempts = view.attempts.iter().map(|shown| Attempt {
            worker: shown.attempt.worker.to_string(),
            name: shown.name.clone(),
            at_ms: shown.attempt.at.millis(),
            ending: shown.attempt.ending.name().to_owned(),
            reason: shown.attempt.reason.clone(),
        });
        Self {
            x: view.tile.x,
            y: view.tile.y,
            width: view.tile.width,
            height: view.tile.height,
            first_sample: view.samples.first,
            samples: view.samples.count,
            attempts: attempts.collect(),
        }
    }
}

impl FailedUnit {
    /// In one line for people: where it lies, and its last attempt.
    pub fn told(&self) -> String {
        let last = self.attempts.last().map_or(String::new(), |attempt| {
            let who = attempt.name.as_deref().unwrap_or(&attempt.worker);
            format!(", tried {} times, the last time on {who}: {}", self.attempts.len(), attempt.reason)
        });
        let end = self.first_sample.saturating_add(self.samples).saturating_sub(1);
        format!("tile at ({}, {}), samples {} to {end}{last}", self.x, self.y, self.first_sample)
    }
}
