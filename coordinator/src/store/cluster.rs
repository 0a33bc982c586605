//! What several coordinators on one store need of it: who owns which job, and who is alive.
//!
//! Every job is owned by one run of one coordinator: the one that accepted it, or that took it over when its owner was gone. A run that
//! gave no sign of life for a while is declared dead by another one; from then on it can commit nothing, and its jobs are taken.

use std::fmt::Debug;

use async_trait::async_trait;
use uuid::Uuid;

use super::StoreError;
use crate::job::{JobId, JobRecord, StoredJob};

/// How a coordinator shows itself to the others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Presence {
    /// Stays the same over restarts: a run ends the runs before it at the same place, which cannot be alive any more.
    pub place: Uuid,
    /// Where it answers people, such as `http://127.0.0.1:7700`.
    pub http: String,
    /// Where it answers workers, such as `http://127.0.0.1:7781`.
    pub grpc: String,
}

impl Presence {
    /// Of somebody whom nobody needs to find.
    pub fn hidden() -> Self {
        Self { place: Uuid::now_v7(), http: String::new(), grpc: String::new() }
    }
}

/// Who owns a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Owner {
    /// This run.
    Here,
    /// Another run that is alive: where it answers people.
    At(String),
    /// Nobody who is alive: it is about to be taken over.
    Nobody,
}

/// A store that several coordinators share.
#[async_trait]
pub trait Cluster: Debug + Send + Sync {
    /// Gives a sign of life, declares dead who gave none for long, and takes over jobs that have no living owner. Jobs that were returned
    /// before may be among the returned ones again.
    ///
    /// # Errors
    /// [`StoreError::Fenced`] if others hold this run for dead.
    async fn adopt(&self) -> Result<Vec<StoredJob>, StoreError>;

    /// Who owns a job; `None` if there is no such job.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn owner(&self, job: JobId) -> Result<Option<Owner>, StoreError>;

    /// Where the other living coordinators answer people.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn peers(&self) -> Result<Vec<Presence>, StoreError>;

    /// The job that a client's token stands for.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn job_of_token(&self, token: &str) -> Result<Option<JobRecord>, StoreError>;

    /// Ends this run, so that others take its jobs at once.
    ///
    /// # Errors
    /// If the store cannot be written; then they find out by themselves.
    async fn leave(&self) -> Result<(), StoreError>;
}
