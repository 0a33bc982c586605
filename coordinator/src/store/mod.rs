//! What was acknowledged and must not be lost: jobs, frames, units and their results in a [`Store`], bytes in [`Blobs`].
//!
//! Order of writing: first the blob, then the change that names it, then the answer. A crash between the first two leaves a blob
//! that nobody names, never a name without a blob.

mod blobs;
mod cluster;
#[cfg(test)]
mod conformance;
mod memory;
mod migrate;
mod postgres;
mod records;
mod singleton;
mod sql;
mod sqlite;
mod uri;

use std::fmt::Debug;
use std::ops::Range;

use async_trait::async_trait;
use gradfarm_proto::Digest;

pub use blobs::{BlobError, BlobUri, Blobs, Counted, GRACE, ParseBlobsError, Traffic};
pub use cluster::{Cluster, Owner, Presence};
pub use memory::Memory;
pub use migrate::{MigrateError, migrate};
pub use postgres::Postgres;
pub use records::Records;
pub use singleton::{Alone, Singleton};
pub use sqlite::Sqlite;
pub use uri::{ParseStoreError, StoreUri};

use crate::job::{Change, DeliveredRecord, FileKind, FileRecord, JobId, StoredJob};

/// Keeps jobs. One service at a time writes to a job.
#[async_trait]
pub trait Store: Records + Debug + Send + Sync {
    /// Makes all changes durable, in order, or none of them.
    ///
    /// # Errors
    /// [`StoreError::Conflict`] if one of them does not fit what is stored; nothing is changed then.
    async fn commit(&self, changes: &[Change]) -> Result<(), StoreError>;

    /// Every job, in the order of submission.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn jobs(&self) -> Result<Vec<StoredJob>, StoreError>;

    /// The results of a run of units, in order.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn results(&self, job: JobId, units: Range<u32>) -> Result<Vec<(u32, DeliveredRecord)>, StoreError>;

    /// A file of a frame, by the frame's position.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn file(&self, job: JobId, position: u32, kind: FileKind) -> Result<Option<FileRecord>, StoreError>;

    /// The contents of all files of all frames, in no order.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn files(&self) -> Result<Vec<Digest>, StoreError>;

    /// What several coordinators need of a store that they share; nothing where there is one writer.
    fn cluster(&self) -> Option<&dyn Cluster> {
        None
    }

    /// Takes over work that one coordinator at a time does for all; nothing if another one does it. A store that has one writer has
    /// nobody else.
    ///
    /// # Errors
    /// If the store cannot be asked.
    async fn alone(&self, _work: Singleton) -> Result<Option<Alone>, StoreError> {
        Ok(Some(Alone::always()))
    }
}

/// Why the store did not do as it was told.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The change does not fit what is stored: somebody else writes, or the caller's picture is wrong.
    #[error("store: {change} does not fit what is stored")]
    Conflict {
        /// Which change.
        change: String,
    },
    /// A row that cannot be read.
    #[error("store: {row} holds {found}")]
    Corrupt {
        /// Which row.
        row: String,
        /// What is in it.
        found: String,
    },
    /// The database failed.
    #[error("store: {0}")]
    Database(#[from] sqlx::Error),
    /// The database's software is too old.
    #[error("store: {software} is {found}, expected {least} or later")]
    Version {
        /// Which software.
        software: &'static str,
        /// Its version.
        found: String,
        /// The least that is known to be sound.
        least: String,
    },
    /// Others hold this coordinator for dead, or it was replaced: what it still wants to write is refused.
    #[error("store: another coordinator has taken over from this one, which was silent for too long or was started again elsewhere")]
    Fenced,
    /// The database did not answer for so long that nothing could be kept.
    #[error("store: the database could not be reached for {seconds} s: {source}")]
    Unreachable {
        /// How long it was tried [s].
        seconds: u64,
        /// What went wrong last.
        source: Box<StoreError>,
    },
    /// The database is of another version of the software.
    #[error("store: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
}

impl StoreError {
    fn conflict(change: &Change) -> Self {
        let change = match change {
            Change::Submitted(record) => format!("submission of job {}", record.id),
            Change::Job { job, state, .. } => format!("job {job} becoming {}", state.name()),
            Change::Frame { job, position, .. } => format!("frame {position} of job {job}"),
            Change::Leased { job, unit, epoch, .. } => format!("lease of unit {unit} of job {job} with epoch {epoch}"),
            Change::Freed { job, unit, .. } => format!("end of the lease of unit {unit} of job {job}"),
            Change::Attempt { job, unit, .. } => format!("an attempt at unit {unit} of job {job}"),
            Change::Witness { job, unit, .. } => format!("a result to compare for unit {unit} of job {job}"),
            Change::Withdrawn { job, unit, .. } => format!("the withdrawal of the result of unit {unit} of job {job}"),
            Change::Priority { job, priority } => format!("job {job} with priority {priority}"),
            Change::Delivered { job, unit, epoch, .. } => format!("result of unit {unit} of job {job} with epoch {epoch}"),
            Change::File { job, position, file } => format!("{} file of frame {position} of job {job}", file.kind.name()),
            Change::Window { job, window, .. } => format!("window {window} of job {job}"),
            Change::Paused { job, paused } => format!("job {job} being {}", if *paused { "paused" } else { "resumed" }),
            Change::Forgotten { job } => format!("end of job {job}"),
            Change::Worker { worker, .. } => format!("worker {worker}"),
        };
        Self::Conflict { change }
    }
}
