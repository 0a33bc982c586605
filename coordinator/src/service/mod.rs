//! The running coordinator: `Config` opens a `Service`, a `Handle` speaks to it, `run` serves workers until shut down.
//!
//! `dispatch` is the loop that owns jobs and workers, `leases` says who gets and keeps what, `grant` words it, `control` does what people
//! ask of jobs, `command` is what it can be asked, `admit` checks submissions, `look` makes views.

mod admit;
mod book;
mod cluster;
pub(crate) mod command;
mod control;
pub(crate) mod dispatch;
mod duty;
mod explain;
mod grant;
mod handle;
mod leases;
#[cfg(test)]
mod load;
mod look;
mod looking;
mod meter;
mod resting;
mod roster;
mod rules;
mod submission;
mod sweep;
mod view;

use std::fs::File;
use std::future::Future;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use uuid::Uuid;

pub use handle::{DryRun, Handle};
pub(crate) use looking::Seen;
pub use rules::{LimitRule, ProjectRule, Rules};
pub use submission::{Frames, Submission};
pub use view::{
    AccuracyView, AttemptView, Count, FailedUnitView, FrameView, JobEvent, JobSummary, JobView, TileView, WindowView, WorkerView,
};

use crate::access::{Gate, OidcOptions};
use crate::assemble::Workshop;
use crate::clock::Clock;
use crate::error::Error;
use crate::grpc;
pub use crate::job::Seconds;
use crate::job::{Errand, JobId};
use crate::metrics::Metrics;
use crate::store::{BlobUri, GRACE as GRACE_OF_BLOBS, Presence, StoreUri};
use crate::tls::{self, Secured};
use crate::webhook::{self, Webhook};
use command::Command;
use dispatch::Dispatcher;
use sweep::Sweeper;

/// Commands that may wait for the loop before callers wait.
const QUEUE: usize = 1024;
/// How long open connections may take to end after the loop has.
const GRACE: Duration = Duration::from_secs(5);

/// What a service needs to know before it starts.
#[derive(Clone, Debug)]
pub struct Config {
    /// Folder for the database and the blobs; made if it is not there. One service at a time may use it.
    pub state: PathBuf,
    /// Where jobs are kept; a SQLite file in the state folder if nothing else is said.
    pub store: Option<StoreUri>,
    /// Where this coordinator answers people, for others on the same store; such as `http://127.0.0.1:7700`.
    pub http: String,
    /// Where it answers workers.
    pub grpc: String,
    /// Where bytes are kept; the folder `blobs` in the state folder if nothing else is said.
    pub blobs: Option<BlobUri>,
    /// How long bytes are kept that nobody names.
    pub blob_grace: Duration,
    /// How long jobs are kept that are over; for ever if nothing is said.
    pub keep_jobs: Option<Duration>,
    /// Whether what is acknowledged must survive a power cut. Off only for jobs that nobody would resume.
    pub durable: bool,
    /// Encryption of both ports; without it nothing listens beyond loopback.
    pub tls: Option<tls::Options>,
    /// An identity provider whose tokens are taken besides our own.
    pub oidc: Option<OidcOptions>,
    /// How often workers must be heard.
    pub heartbeat: Duration,
    /// How long a lease lives without a heartbeat.
    pub lease_ttl: Duration,
    /// What the operator decided about the farm as a whole.
    pub rules: Rules,
    /// Whether metrics are for anybody, without a token.
    pub metrics_open: bool,
    /// Whom to tell that jobs change their state.
    pub webhook: Option<webhook::Options>,
    /// How long workers in the same process may take to finish what they are at when they are told to stop.
    pub drain: Duration,
}

impl Config {
    /// The usual values for a state folder: durable, heartbeat 3 s, leases 15 s.
    pub fn new(state: impl Into<PathBuf>) -> Self {
        Self {
            state: state.into(),
            store: None,
            http: String::new(),
            grpc: String::new(),
            blobs: None,
            blob_grace: GRACE_OF_BLOBS,
            keep_jobs: None,
            durable: true,
            tls: None,
            oidc: None,
            heartbeat: Duration::from_secs(3),
            lease_ttl: Duration::from_secs(15),
            rules: Rules::default(),
            metrics_open: false,
            webhook: None,
            drain: Duration::from_secs(10),
        }
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
    listen_beyond_loopback(address).await
}

/// Binds a listener on any address, for a service with [`Config::tls`]; without that it will not [`run`](Service::run) on others than loopback.
///
/// # Errors
/// If the address cannot be bound.
pub async fn listen_beyond_loopback(address: SocketAddr) -> Result<TcpListener, Error> {
    TcpListener::bind(address).await.map_err(|source| Error::Listen { address, source })
}

/// The coordinator before it runs.
pub struct Service {
    handle: Handle,
    commands: mpsc::Receiver<Command>,
    dispatcher: Dispatcher,
    pending: Vec<(JobId, Errand)>,
    sweeper: Sweeper,
    /// Held as long as the service lives; the system releases it even after a crash.
    _lock: File,
}

impl Service {
    /// Opens the state folder and takes up whatever was left unfinished there.
    ///
    /// # Errors
    /// If the folder cannot be used, or its contents cannot be read.
    pub async fn open(config: Config) -> Result<Self, Error> {
        let folder = config.state.display().to_string();
        let io = |source| Error::Io { what: format!("state folder {folder}"), source };
        std::fs::create_dir_all(&config.state).map_err(io)?;
        let lock = File::create(config.state.join("lock")).map_err(io)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => return Err(Error::InUse(folder)),
            Err(std::fs::TryLockError::Error(source)) => return Err(io(source)),
        }
        let blobs = config.blobs.unwrap_or_else(|| BlobUri::File(config.state.join("blobs")));
        let blobs = blobs.open(config.durable)?.with_grace(config.blob_grace);
        let presence = Presence { place: place(&config.state).map_err(io)?, http: config.http, grpc: config.grpc };
        let store = config.store.unwrap_or_else(|| StoreUri::in_folder(&config.state)).open(config.durable, &presence).await?;
        let (rules, metrics) = (Arc::new(config.rules), Arc::new(Metrics::default()));
        let (sender, commands) = mpsc::channel(QUEUE);
        let gate = Gate::new(store.clone());
        let gate = Arc::new(match config.oidc.clone() {
            Some(options) => gate.with_oidc(options)?,
            None => gate,
        });
        let secured = config.tls.as_ref().map(|options| Secured::open(options, store.clone())).transpose()?.map(Arc::new);
        let handle = Handle {
            commands: sender,
            blobs: blobs.clone(),
            store: store.clone(),
            clock: Clock::new(),
            gate,
            secured,
            rules: rules.clone(),
            previews: Arc::default(),
            metrics: metrics.clone(),
            metrics_open: config.metrics_open,
            duty: Arc::default(),
        };
        let commands_of_all = handle.commands.downgrade();
        let workshop = Workshop::new(commands_of_all.clone(), store.clone(), blobs.clone(), metrics.clone());
        let (grace, keep_jobs) = (config.blob_grace, config.keep_jobs);
        let sweeper = Sweeper { store: store.clone(), blobs, commands: commands_of_all, grace, keep_jobs };
        let assembler = Box::new(move |job: &crate::job::Job, errand| workshop.take(job, errand));
        let (mut dispatcher, pending) = Dispatcher::restore(store, config.heartbeat, config.lease_ttl, rules, assembler).await?;
        dispatcher.webhook = config.webhook.map(|options| Webhook::start(options, metrics.clone()));
        dispatcher.metrics = metrics;
        Ok(Self { handle, commands, dispatcher, pending, sweeper, _lock: lock })
    }

    /// A handle to speak to the service. Calls wait until it runs.
    pub fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// Serves workers on `listener` and handles, until `shutdown` is ready. Frames that are being assembled are taken up again by
    /// the next run.
    ///
    /// # Errors
    /// If the state can no longer be written, or the listener fails or is beyond loopback without TLS.
    pub async fn run(self, listener: TcpListener, shutdown: impl Future<Output = ()> + Send) -> Result<(), Error> {
        let Self { handle, commands, dispatcher, pending, sweeper, _lock } = self;
        let address = listener.local_addr().map_err(|source| Error::Io { what: "listener".into(), source })?;
        if !address.ip().is_loopback() && handle.secured().is_none() {
            return Err(Error::NotLoopback(address));
        }
        let (stop, stopping) = watch::channel(false);
        let stopped = |mut stopping: watch::Receiver<bool>| async move {
            // The sender outlives both loops; if it were gone, stopping would be right too.
            let _sender_gone = stopping.wait_for(|stop| *stop).await;
        };
        let duty = handle.duty.clone();
        let server = grpc::serve(listener, handle, stopped(stopping.clone()));
        let turns = dispatcher.run(pending, commands, stopped(stopping));
        tokio::pin!(server, turns, shutdown);
        // Beside the loop, and over when this is.
        let mut beside = JoinSet::new();
        let store = sweeper.store.clone();
        beside.spawn(cluster::keep_alive(store.clone(), sweeper.commands.clone(), duty));
        beside.spawn(resting::keep_looking(store.clone(), sweeper.commands.clone()));
        beside.spawn(sweeper.run());
        tracing::info!(%address, "serving workers");
        tokio::select! {
            () = &mut shutdown => {}
            outcome = &mut server => return outcome,
            outcome = &mut turns => return outcome,
        }
        tracing::info!("shutting down");
        // Both loops hold a receiver.
        let _both_gone = stop.send(true);
        turns.await?;
        if let Some(cluster) = store.cluster() {
            beside.shutdown().await;
            if let Err(error) = cluster.leave().await {
                tracing::warn!(%error, "the others will notice the end of this coordinator by its silence");
            }
        }
        match tokio::time::timeout(GRACE, server).await {
            Ok(outcome) => outcome,
            Err(_) => Ok(()),
        }
    }
}

/// What names a state folder over restarts. Whoever holds the folder's lock knows that earlier runs in it are over.
fn place(state: &Path) -> std::io::Result<Uuid> {
    let file = state.join("place");
    if let Ok(text) = std::fs::read_to_string(&file)
        && let Ok(place) = text.trim().parse()
    {
        return Ok(place);
    }
    let place = Uuid::now_v7();
    std::fs::write(&file, format!("{place}\n"))?;
    Ok(place)
}
