//! Speaks to a running service.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use futures::StreamExt;
use futures::stream::{self, BoxStream};
use gradfarm_core::plan::Plan;
use gradfarm_proto::{Digest, limits};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{broadcast, mpsc, oneshot};

use super::admit::{Checked, admit, check};
use super::command::Command;
use super::dispatch::Dispatcher;
use super::duty::Duty;
use super::look;
use super::rules::Rules;
use super::submission::Submission;
use super::view::{AccuracyView, JobEvent, JobSummary, JobView, TileView, WorkerView};
use crate::access::Gate;
use crate::clock::Clock;
use crate::error::Error;
use crate::job::{FileKind, JobId, Lack};
use crate::metrics::Metrics;
use crate::preview::Previews;
use crate::schedule::Split;
use crate::store::{Blobs, Store};
use crate::tls::Secured;

/// Speaks to a running service; cheap to clone. Every method fails with [`Error::Stopped`] once the service has stopped.
#[derive(Clone, Debug)]
pub struct Handle {
    pub(super) commands: mpsc::Sender<Command>,
    pub(super) blobs: Blobs,
    pub(super) store: Arc<dyn Store>,
    pub(super) clock: Clock,
    pub(super) gate: Arc<Gate>,
    pub(super) secured: Option<Arc<Secured>>,
    pub(super) rules: Arc<Rules>,
    pub(super) previews: Arc<Previews>,
    pub(super) metrics: Arc<Metrics>,
    pub(super) metrics_open: bool,
    pub(super) duty: Arc<Duty>,
}

/// What would become of a submission.
#[derive(Clone, Debug, PartialEq)]
pub struct DryRun {
    /// The plan, with the reason for each choice.
    pub plan: Plan,
    /// Units that it falls into, at most.
    pub units: u64,
    /// Frames.
    pub frames: u64,
    /// Images: frames that show the same are one.
    pub moments: u64,
    /// Files that would have to be put first, by content.
    pub missing: Vec<Digest>,
    /// Workers that are connected.
    pub workers: u64,
    /// Of these, the ones that may render it.
    pub fitting: u64,
    /// What the others lack.
    pub lacks: Vec<Lack>,
}

impl Handle {
    /// Encryption and the register of workers, if the service speaks TLS.
    pub fn secured(&self) -> Option<&Secured> {
        self.secured.as_deref()
    }

    /// Whether metrics are for anybody.
    pub fn metrics_open(&self) -> bool {
        self.metrics_open
    }

    /// Knows who may do what.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }

    /// Stores a file by content. Putting it again changes nothing.
    ///
    /// # Errors
    /// If it is larger than allowed or cannot be stored.
    pub async fn put_asset(&self, bytes: Bytes) -> Result<Digest, Error> {
        if bytes.len() as u64 > limits::ASSET {
            let expected = format!("at most {} bytes", limits::ASSET);
            return Err(Error::Invalid { what: "asset", found: format!("{} bytes long", bytes.len()), expected });
        }
        Ok(self.blobs.put(bytes).await?)
    }

    /// Which of these are not stored yet.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub async fn missing_assets(&self, digests: &[Digest]) -> Result<Vec<Digest>, Error> {
        let mut missing = Vec::new();
        for digest in digests {
            if !self.blobs.has(*digest).await? {
                missing.push(*digest);
            }
        }
        Ok(missing)
    }

    /// Checks, plans and accepts a job. Once this returns, the job survives a crash.
    ///
    /// # Errors
    /// What is wrong with the submission; [`Error::MissingAssets`] lists what to put first.
    pub async fn submit(&self, submission: Submission) -> Result<JobId, Error> {
        let paused = submission.paused;
        let record = admit(submission, &self.blobs, &self.rules, self.clock.now()).await?;
        self.accept(record, paused).await
    }

    /// Checks a submission and says what would become of it. Nothing is stored.
    ///
    /// # Errors
    /// What is wrong with it; files that are missing are no error here.
    pub async fn dry_run(&self, submission: Submission) -> Result<DryRun, Error> {
        let Checked { record, missing, .. } = check(submission, &self.blobs, &self.rules, self.clock.now()).await?;
        let split = Split::new(&record.plan, &record.moments, record.tile)?;
        let needs = record.needs.clone();
        let (workers, (fitting, lacks)) =
            self.look(move |dispatcher| (dispatcher.roster.count() as u64, dispatcher.fitting(&needs))).await?;
        Ok(DryRun {
            units: u64::from(split.units()),
            frames: u64::from(record.frame_count),
            moments: u64::from(split.frames()),
            plan: record.plan,
            missing,
            workers,
            fitting: fitting as u64,
            lacks,
        })
    }

    /// All jobs, newest first.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn list(&self) -> Result<Vec<JobSummary>, Error> {
        self.look(|dispatcher| dispatcher.jobs.values().rev().map(look::summary).collect()).await
    }

    /// One job in full.
    ///
    /// # Errors
    /// [`Error::NoJob`].
    pub async fn get(&self, job: JobId) -> Result<JobView, Error> {
        self.look(move |dispatcher| dispatcher.jobs.get(&job).map(|found| look::view(found, dispatcher))).await?.ok_or(Error::NoJob(job))
    }

    /// The tiles of a frame, row by row.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`].
    pub async fn tiles(&self, job: JobId, frame: u32) -> Result<Vec<TileView>, Error> {
        let tiles = move |dispatcher: &mut Dispatcher| dispatcher.jobs.get(&job).map(|found| look::tiles(found, frame));
        self.look(tiles).await?.ok_or(Error::NoJob(job))?
    }

    /// What accuracy cost in a frame so far, and what more of it would cost.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`].
    pub async fn accuracy(&self, job: JobId, frame: u32) -> Result<AccuracyView, Error> {
        let accuracy = move |dispatcher: &mut Dispatcher| dispatcher.jobs.get(&job).map(|found| look::accuracy(found, frame));
        self.look(accuracy).await?.ok_or(Error::NoJob(job))?
    }

    /// Calls a job off. Cancelling a cancelled job changes nothing.
    ///
    /// # Errors
    /// [`Error::NoJob`], and [`Error::Over`] if it is done or failed.
    pub async fn cancel(&self, job: JobId) -> Result<(), Error> {
        self.ask(|reply| Command::Cancel { job, reply }).await?
    }

    /// Pauses a job: it gets no leases until it is resumed; units that are being rendered finish. Pausing twice changes nothing.
    ///
    /// # Errors
    /// [`Error::NoJob`], and [`Error::Over`] if it is over.
    pub async fn pause(&self, job: JobId) -> Result<(), Error> {
        self.ask(|reply| Command::Pause { job, paused: true, reply }).await?
    }

    /// Lets a paused job go on.
    ///
    /// # Errors
    /// As [`pause`](Self::pause).
    pub async fn resume(&self, job: JobId) -> Result<(), Error> {
        self.ask(|reply| Command::Pause { job, paused: false, reply }).await?
    }

    /// Changes how urgent a job is; higher goes first.
    ///
    /// # Errors
    /// [`Error::NoJob`], and [`Error::Over`] if it is over.
    pub async fn prioritise(&self, job: JobId, priority: i32) -> Result<(), Error> {
        self.ask(|reply| Command::Prioritise { job, priority, reply }).await?
    }

    /// Tries again what failed in a job, or in one frame of it, by its number: units that were given up get new chances, and everything that
    /// is there stays.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`], [`Error::Over`] if it was cancelled, [`Error::NothingFailed`].
    pub async fn retry(&self, job: JobId, frame: Option<u32>) -> Result<(), Error> {
        self.ask(|reply| Command::Retry { job, frame, reply }).await?
    }

    /// What happens to a job from now on, beginning with its state and progress; ends after a final state, or when the service
    /// stops. A reader that lags behind loses events, but never the last state.
    ///
    /// # Errors
    /// [`Error::NoJob`].
    pub async fn subscribe(&self, job: JobId) -> Result<BoxStream<'static, JobEvent>, Error> {
        let (first, receiver) = self.watch(job).await?;
        let state = (self.clone(), VecDeque::from(first), Some(receiver));
        let events = stream::unfold(state, move |(handle, mut waiting, mut receiver)| async move {
            loop {
                if let Some(event) = waiting.pop_front() {
                    if look::is_last(&event) {
                        receiver = None;
                        waiting.clear();
                    }
                    return Some((event, (handle, waiting, receiver)));
                }
                match receiver.as_mut()?.recv().await {
                    Ok(event) => waiting.push_back(event),
                    Err(RecvError::Lagged(_)) => {
                        let (again, from_now) = handle.watch(job).await.ok()?;
                        waiting = again.into();
                        receiver = Some(from_now);
                    }
                    Err(RecvError::Closed) => return None,
                }
            }
        });
        Ok(events.boxed())
    }

    async fn watch(&self, job: JobId) -> Result<(Vec<JobEvent>, broadcast::Receiver<JobEvent>), Error> {
        self.look(move |dispatcher| dispatcher.watch(job)).await?.ok_or(Error::NoJob(job))
    }

    /// A file of a finished frame.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`], [`Error::NotReady`].
    pub async fn frame_file(&self, job: JobId, frame: u32, kind: FileKind) -> Result<Bytes, Error> {
        let position = move |dispatcher: &mut Dispatcher| dispatcher.jobs.get(&job).map(|found| look::position(found, frame));
        let position = self.look(position).await?.ok_or(Error::NoJob(job))??;
        let file = self.store.file(job, position, kind).await?.ok_or(Error::NotReady { job, frame, kind })?;
        Ok(self.blobs.get(file.blob).await?)
    }

    /// The workers that are connected.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn workers(&self) -> Result<Vec<WorkerView>, Error> {
        self.look(|dispatcher| dispatcher.roster.views(dispatcher.clock.now(), |worker| dispatcher.lease_count(worker))).await
    }

    /// Stores a result's bytes.
    pub(crate) async fn put_blob(&self, bytes: Bytes) -> Result<Digest, Error> {
        Ok(self.blobs.put(bytes).await?)
    }

    /// Reads any content.
    pub(crate) async fn get_blob(&self, digest: Digest) -> Result<Bytes, Error> {
        Ok(self.blobs.get(digest).await?)
    }

    /// Asks the loop for something that it answers.
    pub(crate) async fn ask<T>(&self, command: impl FnOnce(oneshot::Sender<T>) -> Command) -> Result<T, Error> {
        let (reply, answer) = oneshot::channel();
        self.commands.send(command(reply)).await.map_err(|_| Error::Stopped)?;
        answer.await.map_err(|_| Error::Stopped)
    }

    /// Looks at the state between two turns.
    pub(crate) async fn look<T: Send + 'static>(&self, look: impl FnOnce(&mut Dispatcher) -> T + Send + 'static) -> Result<T, Error> {
        self.ask(|reply| {
            Command::Look(Box::new(move |dispatcher| {
                // Whoever asked may have gone away meanwhile.
                let _gone = reply.send(look(dispatcher));
            }))
        })
        .await
    }

    /// Tells the loop something that it does not answer.
    pub(crate) async fn tell(&self, command: Command) -> Result<(), Error> {
        self.commands.send(command).await.map_err(|_| Error::Stopped)
    }
}
