//! Several coordinators on one store: signs of life, jobs that are taken over, and where to find those of others.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::time::MissedTickBehavior;

use super::command::Command;
use super::dispatch::{Dispatcher, Effect, Turn};
use super::duty::Duty;
use super::handle::Handle;
use crate::error::Error;
use crate::job::{Action, Change, Errand, Job, JobId, JobRecord, StoredJob};
use crate::store::{Owner, Store, StoreError};

/// How often a sign of life is given.
const BEAT: Duration = Duration::from_millis(500);
/// How long a job may be without an owner that answers for it before whoever asks is told so.
const TAKEOVER: Duration = Duration::from_secs(10);

/// Gives signs of life and hands the loop what was taken over, until the loop is gone or others hold this run for dead.
pub(super) async fn keep_alive(store: Arc<dyn Store>, commands: mpsc::WeakSender<Command>, duty: Arc<Duty>) {
    let Some(cluster) = store.cluster() else { return };
    let mut tick = tokio::time::interval(BEAT);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tick.tick().await;
        let outcome = cluster.adopt().await;
        let over = outcome.is_err();
        if !over {
            duty.beat();
        }
        if !matches!(&outcome, Ok(jobs) if jobs.is_empty()) {
            let Some(commands) = commands.upgrade() else { return };
            if commands.send(Command::Adopt { outcome }).await.is_err() {
                return;
            }
        }
        if over || commands.strong_count() == 0 {
            return;
        }
    }
}

/// Every job that is this coordinator's to work on, as the store has it.
pub(super) async fn own_jobs(store: &dyn Store) -> Result<Vec<StoredJob>, StoreError> {
    match store.cluster() {
        Some(cluster) => cluster.adopt().await,
        None => store.jobs().await,
    }
}

impl Dispatcher {
    /// Takes up jobs whose owner is gone. After an error the loop ends: this run is over.
    pub(super) fn adopt(&mut self, outcome: Result<Vec<StoredJob>, StoreError>, turn: &mut Turn) {
        let jobs = match outcome {
            Ok(jobs) => jobs,
            Err(error) => return self.broken = Some(error.into()),
        };
        for stored in jobs.into_iter().filter(|stored| !self.jobs.contains_key(&stored.record.id)).collect::<Vec<_>>() {
            match self.take_up(stored) {
                Ok((id, errands)) => {
                    tracing::info!(job = %id, "job taken over");
                    turn.effects.extend(errands.into_iter().map(|errand| Effect::Do(id, errand)));
                }
                Err(error) => return self.broken = Some(error),
            }
        }
    }

    /// Takes up a job as the store has it; what was to be done for it.
    pub(super) fn take_up(&mut self, stored: StoredJob) -> Result<(JobId, Vec<Errand>), Error> {
        let id = stored.record.id;
        let (job, actions) = Job::restore(stored, self.clock.now(), self.ttl)?;
        let errands = actions.into_iter().filter_map(|action| match action {
            Action::Do(errand) => Some(errand),
            _ => None,
        });
        let errands = errands.collect();
        self.admit(job);
        Ok((id, errands))
    }
}

impl Handle {
    /// Where people find a job that another coordinator owns; `None` if it is here, or nowhere. While a job changes hands this waits.
    ///
    /// # Errors
    /// If the store cannot be read, or nobody takes the job over.
    pub async fn elsewhere(&self, job: JobId) -> Result<Option<String>, Error> {
        let Some(cluster) = self.store.cluster() else { return Ok(None) };
        let asked = tokio::time::Instant::now();
        loop {
            if self.look(move |dispatcher| dispatcher.jobs.contains_key(&job)).await? {
                return Ok(None);
            }
            match cluster.owner(job).await? {
                None => return Ok(None),
                Some(Owner::At(http)) => return Ok(Some(http)),
                // It is about to be taken over, or was a moment ago.
                Some(Owner::Nobody | Owner::Here) if asked.elapsed() < TAKEOVER => {}
                Some(_) => return Err(Error::Unowned { job }),
            }
            tokio::time::sleep(BEAT / 4).await;
        }
    }

    /// Where the other coordinators answer people.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub async fn peers(&self) -> Result<Vec<String>, Error> {
        let Some(cluster) = self.store.cluster() else { return Ok(Vec::new()) };
        Ok(cluster.peers().await?.into_iter().map(|peer| peer.http).collect())
    }

    /// Whether a job that this coordinator does not have may be another's.
    pub(crate) async fn may_be_elsewhere(&self, job: JobId) -> Result<bool, Error> {
        let Some(cluster) = self.store.cluster() else { return Ok(false) };
        Ok(cluster.owner(job).await?.is_some())
    }

    /// Accepts a job. On a shared store it is stored first and then handed to the loop: whether a client's token was used before, only the
    /// store knows, and the loop must not stumble over it.
    pub(super) async fn accept(&self, record: JobRecord, paused: bool) -> Result<JobId, Error> {
        let record = Box::new(record);
        let Some(cluster) = self.store.cluster() else {
            return self.ask(|reply| Command::Submit { record, kept: false, paused, reply }).await?;
        };
        let mut changes = vec![Change::Submitted(record.clone())];
        changes.extend(paused.then_some(Change::Paused { job: record.id, paused }));
        match self.store.commit(&changes).await {
            Ok(()) => self.ask(|reply| Command::Submit { record, kept: true, paused, reply }).await?,
            Err(StoreError::Conflict { change }) => {
                let token = record.client_token.clone().unwrap_or_default();
                let known = cluster.job_of_token(&token).await?.ok_or(StoreError::Conflict { change })?;
                // Its priority may have been changed since.
                let JobRecord { id, created, priority, .. } = known.clone();
                if known == (JobRecord { id, created, priority, ..*record }) { Ok(id) } else { Err(Error::TokenReused { token, job: id }) }
            }
            Err(error) => Err(error.into()),
        }
    }
}
