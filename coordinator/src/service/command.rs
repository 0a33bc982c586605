//! What the loop can be asked to do.

use std::sync::Arc;
use std::time::Duration;

use gradfarm_core::plan::Guide;
use gradfarm_proto::convert::LeaseName;
use gradfarm_proto::{Digest, v1};
use tokio::sync::{mpsc, oneshot};

use super::dispatch::Dispatcher;
use crate::error::Error;
use crate::job::{Answer, Assembled, Capabilities, DeliveredRecord, JobId, JobRecord, Measured, SolvedWindow, StoredJob, WorkerId};
use crate::store::StoreError;

/// One thing to do. Answers are sent after everything they rest on is durable.
pub(crate) enum Command {
    /// Accept a job, which is stored already if it is `kept`.
    Submit { record: Box<JobRecord>, kept: bool, paused: bool, reply: oneshot::Sender<Result<JobId, Error>> },
    /// Call a job off.
    Cancel { job: JobId, reply: oneshot::Sender<Result<(), Error>> },
    /// Pause a job, or let it go on.
    Pause { job: JobId, paused: bool, reply: oneshot::Sender<Result<(), Error>> },
    /// Jobs whose owner is gone, to be worked on from now on; or why this run is over.
    Adopt { outcome: Result<Vec<StoredJob>, StoreError> },
    /// Grant nothing any more: the coordinator is about to stop.
    Drain,
    /// Forget jobs that were over for so long.
    Forget { keep: Duration },
    /// Change a job's priority.
    Prioritise { job: JobId, priority: i32, reply: oneshot::Sender<Result<(), Error>> },
    /// Try again what failed, in one frame by number or in all.
    Retry { job: JobId, frame: Option<u32>, reply: oneshot::Sender<Result<(), Error>> },
    /// Look at the state; the closure answers by itself.
    Look(Box<dyn FnOnce(&mut Dispatcher) + Send>),
    /// A worker opened its stream.
    Connect { hello: Box<Hello>, outbox: mpsc::Sender<v1::CoordinatorMessage>, reply: oneshot::Sender<SessionKey> },
    /// A worker would take more leases.
    Credit { from: SessionKey, leases: u32 },
    /// A worker is alive and holds these.
    Heartbeat { from: SessionKey, held: Vec<LeaseName>, scenes: Vec<Digest>, progress: Vec<(LeaseName, u64)> },
    /// A worker hands leases back.
    Returned { from: SessionKey, leases: Vec<LeaseName> },
    /// A worker failed a unit, or delivered nonsense.
    Failed { worker: WorkerId, lease: LeaseName, reason: String },
    /// A worker's stream ended.
    Disconnect { from: SessionKey },
    /// A checked and stored result.
    Deliver { worker: WorkerId, lease: LeaseName, result: DeliveredRecord, reply: oneshot::Sender<Answer> },
    /// A frame was assembled, or could not be.
    Assembled { job: JobId, frame: u32, outcome: Result<Assembled, String> },
    /// A frame's error was measured, or could not be.
    Measured { job: JobId, frame: u32, outcome: Result<Measured, String> },
    /// A round's guide was made, or could not be.
    Guided { job: JobId, frame: u32, round: u32, outcome: Result<Arc<Guide>, String> },
    /// A window of moments was solved, or could not be.
    Solved { job: JobId, window: u32, outcome: Result<SolvedWindow, String> },
}

/// One connection of one worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SessionKey {
    /// Which worker.
    pub(crate) worker: WorkerId,
    /// Counts connections, so that the end of an old one does not end the new one.
    pub(crate) number: u64,
}

/// What a worker says of itself.
#[derive(Clone, Debug)]
pub(crate) struct Hello {
    pub(crate) worker: WorkerId,
    pub(crate) protocol: u32,
    pub(crate) name: String,
    pub(crate) version: String,
    pub(crate) capabilities: Capabilities,
    pub(crate) held: Vec<LeaseName>,
    pub(crate) scenes: Vec<Digest>,
}
