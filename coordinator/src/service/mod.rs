//! The running coordinator: `Config` opens a `Service`, a `Handle` speaks to it, `run` serves workers until shut down.

mod submission;
mod view;

use std::future::Future;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use bytes::Bytes;
use futures::stream::BoxStream;
use gradfarm_proto::Digest;
use tokio::net::TcpListener;

pub use submission::{Frames, Submission};
pub use view::{Count, FrameView, JobEvent, JobSummary, JobView, TileView, WorkerView};

pub use crate::job::Seconds;

use crate::error::Error;
use crate::job::{FileKind, JobId};

/// What a service needs to know before it starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Config {
    /// Folder for the database and the blobs; made if it is not there. One service at a time may use it.
    pub state: PathBuf,
    /// Whether what is acknowledged must survive a power cut. Off only for jobs that nobody would resume.
    pub durable: bool,
    /// How often workers must be heard.
    pub heartbeat: Duration,
    /// How long a lease lives without a heartbeat.
    pub lease_ttl: Duration,
}

impl Config {
    /// The usual values for a state folder: durable, heartbeat 3 s, leases 15 s.
    pub fn new(state: impl Into<PathBuf>) -> Self {
        Self { state: state.into(), durable: true, heartbeat: Duration::from_secs(3), lease_ttl: Duration::from_secs(15) }
    }
}

/// Binds a listener on a loopback address; port 0 picks a free one.
///
/// # Errors
/// If the address is not on loopback, or cannot be bound.
pub async fn listen(address: SocketAddr) -> Result<TcpListener, Error> {
    if !address.ip().is_loopback() {
        return Err(Error::NotLoopback(address));
    }
    TcpListener::bind(address).await.map_err(|source| Error::Listen { address, source })
}

/// The coordinator before and while it runs.
#[derive(Debug)]
pub struct Service {
    handle: Handle,
}

impl Service {
    /// Opens the state folder and takes up whatever was left unfinished there.
    ///
    /// # Errors
    /// If the folder cannot be used, or its contents cannot be read.
    pub async fn open(config: Config) -> Result<Self, Error> {
        let _ = config;
        Err(Error::Stopped)
    }

    /// A handle to speak to the service. Calls wait until it runs.
    pub fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// Serves workers on `listener` and handles, until `shutdown` is ready.
    ///
    /// # Errors
    /// If the state can no longer be written, or the listener fails.
    pub async fn run(self, listener: TcpListener, shutdown: impl Future<Output = ()> + Send) -> Result<(), Error> {
        drop((listener, shutdown));
        Err(Error::Stopped)
    }
}

/// Speaks to a running service; cheap to clone. Every method fails with [`Error::Stopped`] once the service has stopped.
#[derive(Clone, Debug)]
pub struct Handle {}

impl Handle {
    /// Stores a file by content. Putting it again changes nothing.
    ///
    /// # Errors
    /// If it is larger than allowed or cannot be stored.
    pub async fn put_asset(&self, bytes: Bytes) -> Result<Digest, Error> {
        let _ = bytes;
        Err(Error::Stopped)
    }

    /// Which of these are not stored yet.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub async fn missing_assets(&self, digests: &[Digest]) -> Result<Vec<Digest>, Error> {
        let _ = digests;
        Err(Error::Stopped)
    }

    /// Checks, plans and accepts a job. Once this returns, the job survives a crash.
    ///
    /// # Errors
    /// What is wrong with the submission; [`Error::MissingAssets`] lists what to put first.
    pub async fn submit(&self, submission: Submission) -> Result<JobId, Error> {
        let _ = submission;
        Err(Error::Stopped)
    }

    /// All jobs, newest first.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn list(&self) -> Result<Vec<JobSummary>, Error> {
        Err(Error::Stopped)
    }

    /// One job in full.
    ///
    /// # Errors
    /// [`Error::NoJob`].
    pub async fn get(&self, job: JobId) -> Result<JobView, Error> {
        Err(Error::NoJob(job))
    }

    /// The tiles of a frame, row by row.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`].
    pub async fn tiles(&self, job: JobId, frame: u32) -> Result<Vec<TileView>, Error> {
        let _ = frame;
        Err(Error::NoJob(job))
    }

    /// Calls a job off. Cancelling a cancelled job changes nothing.
    ///
    /// # Errors
    /// [`Error::NoJob`], and [`Error::Over`] if it is done or failed.
    pub async fn cancel(&self, job: JobId) -> Result<(), Error> {
        Err(Error::NoJob(job))
    }

    /// What happens to a job from now on, beginning with its state and progress; ends after a final state.
    /// A reader that lags behind loses tiles' events, never the last state.
    ///
    /// # Errors
    /// [`Error::NoJob`].
    pub async fn subscribe(&self, job: JobId) -> Result<BoxStream<'static, JobEvent>, Error> {
        Err(Error::NoJob(job))
    }

    /// A file of a finished frame.
    ///
    /// # Errors
    /// [`Error::NoJob`], [`Error::NoFrame`], [`Error::NotReady`].
    pub async fn frame_file(&self, job: JobId, frame: u32, kind: FileKind) -> Result<Bytes, Error> {
        let _ = (frame, kind);
        Err(Error::NoJob(job))
    }

    /// The workers that are connected.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn workers(&self) -> Result<Vec<WorkerView>, Error> {
        Err(Error::Stopped)
    }
}
