//! The heart of a worker: every lease it holds, what became of it, and what to say about it.
//!
//! A lease is waiting (for its scene), queued, running, or being delivered; it is held, and named in every heartbeat, until the
//! coordinator has answered its delivery or taken it back.

use std::collections::BTreeMap;
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use gradfarm_core::plan::{Plan, TileGuide, WorkUnit};
use gradfarm_core::render::Watch;
use gradfarm_core::scene::Exposure;
use gradfarm_proto::convert::{ConvertError, LeaseName, lease_ref, tile_guide, uuid};
use gradfarm_proto::v1::coordinator_message::Message as Told;
use gradfarm_proto::v1::worker_message::Message as Say;
use gradfarm_proto::{Digest, v1, version};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::asset_cache::AssetCache;
use crate::config::Config;
use crate::crew::Crew;
use crate::deliver::{Delivery, deliver};
use crate::error::Error;
use crate::execute::{Report, Task};
use crate::link::{self, News};
use crate::metrics::Counted;
use crate::scene_cache::{Prepared, SceneCache, Sight, prepare};

/// Where a lease stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Waiting,
    Queued,
    Running,
    Delivering,
}

/// A lease that is held.
struct Held {
    stage: Stage,
    unit: WorkUnit,
    /// Which samples the pixels of a guided unit get.
    guide: Option<Arc<TileGuide>>,
    plan: Arc<Plan>,
    manifest: Digest,
    watch: Arc<Watch>,
    load_seconds: f64,
    compile_seconds: f64,
    delivery: Option<tokio::task::AbortHandle>,
}

impl Held {
    /// What it is rendered from.
    fn sight(&self) -> Sight {
        Sight::new(self.manifest, &self.plan, self.unit.moment)
    }
}

/// The end of what a moment's preparation takes, or of a delivery.
enum Done {
    Scene(Sight, Result<Prepared, String>),
    Delivered(LeaseName),
}

struct Loop {
    config: Config,
    crew: Arc<Crew>,
    /// Which of the crew this is.
    own: usize,
    reporter: mpsc::UnboundedSender<Report>,
    assets: AssetCache,
    scenes: SceneCache,
    held: BTreeMap<LeaseName, Held>,
    /// Scenes in the making, results on their way.
    tasks: JoinSet<Done>,
    preparing: Vec<Sight>,
    outbox: Option<mpsc::Sender<v1::WorkerMessage>>,
    /// Counts the stream while it is open.
    connected: Option<Counted>,
    /// Leases asked for on this stream and not granted yet.
    asked: u32,
    heartbeat: Duration,
    stopping: bool,
}

/// Works for one of the crew's coordinators.
///
/// # Errors
/// If it cannot start, or the coordinator refuses the worker for good.
pub(crate) async fn run(own: usize, crew: Arc<Crew>, config: Config, shutdown: impl Future<Output = ()> + Send) -> Result<(), Error> {
    let folder = |source| Error::Io { what: "cache folder".into(), source };
    let assets = AssetCache::new(crew.dials(own), config.cache.clone(), config.cache_bytes, crew.metrics.clone()).map_err(folder)?;
    let (reporter, mut reports) = mpsc::unbounded_channel();
    let (sender, mut news) = mpsc::channel(64);
    // The stream has a connection of its own, so that heartbeats never wait behind results.
    let link = tokio::spawn(link::keep(crew.dial(own), sender));
    let mut state = Loop {
        scenes: SceneCache::new(config.scenes),
        config,
        crew,
        own,
        reporter,
        assets,
        held: BTreeMap::new(),
        tasks: JoinSet::new(),
        preparing: Vec::new(),
        outbox: None,
        connected: None,
        asked: 0,
        heartbeat: Duration::from_secs(1),
        stopping: false,
    };
    let outcome = state.work(&mut news, &mut reports, shutdown).await;
    link.abort();
    outcome
}

impl Loop {
    async fn work(
        &mut self,
        news: &mut mpsc::Receiver<News>,
        reports: &mut mpsc::UnboundedReceiver<Report>,
        shutdown: impl Future<Output = ()> + Send,
    ) -> Result<(), Error> {
        tokio::pin!(shutdown);
        let mut beat = Instant::now() + self.heartbeat;
        let mut deadline = None;
        loop {
            tokio::select! {
                () = &mut shutdown, if !self.stopping => {
                    self.stopping = true;
                    deadline = Some(Instant::now() + self.config.drain);
                    tracing::info!(held = self.held.len(), "stopping");
                    self.hand_back(|stage| matches!(stage, Stage::Waiting | Stage::Queued)).await;
                }
                () = tokio::time::sleep_until(deadline.unwrap_or(beat)), if deadline.is_some() => {
                    tracing::warn!(held = self.held.len(), "out of time: handing the rest back");
                    self.hand_back(|_| true).await;
                }
                () = tokio::time::sleep_until(beat) => {
                    beat = Instant::now() + self.heartbeat;
                    if self.outbox.is_none() {
                        self.crew.set_orphans(self.own, self.held.keys().copied());
                    }
                    let beat = v1::Heartbeat { held: self.names(), scenes: self.scene_names(), progress: self.progress() };
                    self.say(Say::Heartbeat(beat)).await;
                }
                Some(report) = reports.recv() => self.hear(report).await,
                Some(Ok(done)) = self.tasks.join_next() => self.complete(done).await,
                said = news.recv() => match said {
                    Some(News::Greeting(answer)) => {
                        // If the link is gone it asks again.
                        let _gone = answer.send(self.hello());
                    }
                    Some(News::Up(outbox)) => {
                        tracing::info!(coordinator = %self.config.coordinator, "connected");
                        (self.outbox, self.asked) = (Some(outbox), 0);
                        self.connected = Some(Counted::new(&self.crew.metrics.connected));
                        self.crew.set_orphans(self.own, std::iter::empty());
                    }
                    Some(News::Message(message)) => {
                        if let Told::Welcome(welcome) = &message {
                            let (url, version) = (&self.config.coordinator, &welcome.version);
                            if !version::SPOKEN.contains(&welcome.protocol) {
                                let (spoken, reason) = (version::SPOKEN, welcome.protocol);
                                let reason = format!(
                                    "speaks protocol {reason}, this worker {} to {}: bring both to one release",
                                    spoken.start(),
                                    spoken.end()
                                );
                                return Err(Error::Coordinator { url: url.clone(), reason });
                            }
                            tracing::info!(coordinator = %url, protocol = welcome.protocol, %version, "welcome");
                            self.heartbeat = Duration::from_millis(u64::from(welcome.heartbeat_ms.max(10)));
                            beat = Instant::now() + self.heartbeat;
                        }
                        self.obey(message).await;
                    }
                    Some(News::Down) => {
                        (self.outbox, self.connected) = (None, None);
                        self.crew.set_orphans(self.own, self.held.keys().copied());
                    }
                    Some(News::Refused(error)) => return Err(error),
                    None => return Err(Error::Coordinator { url: self.config.coordinator.clone(), reason: "the link broke off".into() }),
                },
            }
            if self.stopping && (self.held.is_empty() || self.outbox.is_none()) {
                self.say(Say::Goodbye(v1::Goodbye {})).await;
                return Ok(());
            }
            self.ask().await;
        }
    }

    fn hello(&self) -> v1::Hello {
        v1::Hello {
            protocol_min: *version::SPOKEN.start(),
            protocol_max: *version::SPOKEN.end(),
            worker: Bytes::copy_from_slice(&self.crew.worker),
            name: self.config.name.clone(),
            threads: self.config.threads as u32,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            held: self.names(),
            scenes: self.scene_names(),
            pool: self.config.pool.clone(),
            tags: self.config.tags.clone(),
            memory_bytes: self.config.memory,
        }
    }

    fn names(&self) -> Vec<v1::LeaseRef> {
        self.held.keys().copied().chain(self.crew.orphans(self.own)).map(Into::into).collect()
    }

    /// How far the units are that are being rendered.
    fn progress(&self) -> Vec<v1::LeaseProgress> {
        let running = self.held.iter().filter(|(_, held)| held.stage == Stage::Running);
        running.map(|(lease, held)| v1::LeaseProgress { lease: Some((*lease).into()), samples: held.watch.samples() }).collect()
    }

    fn scene_names(&self) -> Vec<Bytes> {
        self.scenes.digests().map(Digest::to_bytes).collect()
    }

    async fn say(&mut self, message: Say) {
        if let Some(outbox) = &self.outbox
            && outbox.send(v1::WorkerMessage { message: Some(message) }).await.is_err()
        {
            self.outbox = None;
        }
    }

    /// Asks for as many leases as keep every thread busy, with a few in reserve so that none waits for the network; none while too many
    /// results wait to be delivered.
    async fn ask(&mut self) {
        if self.stopping || self.outbox.is_none() {
            return;
        }
        let threads = self.config.threads;
        let delivering = self.held.values().filter(|held| held.stage == Stage::Delivering).count();
        let at_hand = self.held.len() - delivering + self.asked as usize;
        let wanted = if delivering >= 2 * threads + 4 { 0 } else { threads + threads.div_ceil(2) };
        let leases = wanted.saturating_sub(at_hand) as u32;
        if leases > 0 {
            self.asked += leases;
            self.say(Say::Credit(v1::Credit { leases })).await;
        }
    }

    async fn obey(&mut self, message: Told) {
        match message {
            Told::Welcome(_) => {}
            Told::Grant(grant) => {
                self.asked = self.asked.saturating_sub(grant.leases.len() as u32);
                match read(grant) {
                    Ok(leases) => {
                        for (lease, held) in leases {
                            self.take(lease, held).await;
                        }
                    }
                    // Leases that were not understood are not held, and run out.
                    Err(problem) => tracing::error!(%problem, "grant not understood"),
                }
            }
            Told::Revoke(revoke) => {
                for lease in revoke.leases.into_iter().filter_map(|lease| LeaseName::try_from(lease).ok()) {
                    tracing::info!(job = %job_of(&lease), unit = lease.unit, epoch = lease.epoch, "lease taken back");
                    self.drop_lease(lease);
                }
            }
            Told::Drain(_) => tracing::info!("the coordinator is about to stop"),
        }
    }

    async fn take(&mut self, lease: LeaseName, held: Held) {
        if !held.unit.tile.lies_on(held.plan.extent) || held.unit.samples.end() > held.plan.samples {
            let reason = format!("the unit lies outside its plan: {:?}", held.unit);
            return self.say(Say::Failed(v1::Failed { lease: Some(lease.into()), reason })).await;
        }
        if self.stopping {
            return self.say(Say::Returned(v1::Returned { leases: vec![lease.into()] })).await;
        }
        let (sight, plan, moment) = (held.sight(), held.plan.clone(), held.unit.moment);
        self.held.insert(lease, held);
        if let Some(exposure) = self.scenes.get(&sight) {
            self.queue(lease, exposure);
        } else if !self.preparing.contains(&sight) {
            self.preparing.push(sight);
            let (assets, stage) = (self.assets.clone(), self.scenes.stage(sight.manifest));
            self.tasks.spawn(async move { Done::Scene(sight, prepare(sight, plan, moment, &stage, &assets).await) });
        }
    }

    fn queue(&mut self, lease: LeaseName, exposure: Arc<Exposure>) {
        if let Some(held) = self.held.get_mut(&lease) {
            held.stage = Stage::Queued;
            let reports = self.reporter.clone();
            self.crew.pool.push(Task {
                reports,
                lease,
                unit: held.unit,
                guide: held.guide.clone(),
                plan: held.plan.clone(),
                exposure,
                watch: held.watch.clone(),
            });
        }
    }

    async fn complete(&mut self, done: Done) {
        match done {
            Done::Delivered(lease) => {
                self.held.remove(&lease);
            }
            Done::Scene(sight, outcome) => {
                self.preparing.retain(|other| *other != sight);
                let manifest = sight.manifest;
                let waits = |(lease, held): (&LeaseName, &Held)| (held.stage == Stage::Waiting && held.sight() == sight).then_some(*lease);
                let waiting: Vec<LeaseName> = self.held.iter().filter_map(waits).collect();
                match outcome {
                    Ok(prepared) => {
                        tracing::info!(scene = %manifest, load = prepared.load_seconds, compile = prepared.compile_seconds, "scene ready");
                        self.crew.metrics.scene(prepared.load_seconds + prepared.compile_seconds);
                        self.scenes.insert(sight, prepared.exposure.clone());
                        // The first unit that waited tells how long it took.
                        if let Some(held) = waiting.first().and_then(|lease| self.held.get_mut(lease)) {
                            (held.load_seconds, held.compile_seconds) = (prepared.load_seconds, prepared.compile_seconds);
                        }
                        waiting.into_iter().for_each(|lease| self.queue(lease, prepared.exposure.clone()));
                    }
                    Err(reason) => {
                        tracing::error!(scene = %manifest, %reason, "scene could not be made ready");
                        for lease in waiting {
                            self.held.remove(&lease);
                            self.say(Say::Failed(v1::Failed { lease: Some(lease.into()), reason: reason.clone() })).await;
                        }
                    }
                }
            }
        }
    }

    async fn hear(&mut self, report: Report) {
        match report {
            Report::Started { lease } => {
                if let Some(held) = self.held.get_mut(&lease) {
                    held.stage = Stage::Running;
                }
            }
            Report::Finished { lease, outcome, render_seconds } => {
                // A lease that was taken back meanwhile is not held any more: its result is dropped.
                let Some(held) = self.held.get_mut(&lease) else { return };
                match outcome {
                    Ok(block) => {
                        held.stage = Stage::Delivering;
                        let (load_seconds, compile_seconds) = (held.load_seconds, held.compile_seconds);
                        let delivery = Delivery { worker: self.crew.worker, lease, block, load_seconds, compile_seconds, render_seconds };
                        let (dials, metrics) = (self.crew.dials(self.own), self.crew.metrics.clone());
                        let deliver = async move {
                            let _counted = Counted::new(&metrics.spooled);
                            deliver(dials, delivery, metrics.clone()).await;
                            Done::Delivered(lease)
                        };
                        held.delivery = Some(self.tasks.spawn(deliver));
                    }
                    Err(reason) => {
                        let (frame, tile) = (held.unit.moment.first, format!("{},{}", held.unit.tile.x, held.unit.tile.y));
                        tracing::error!(job = %job_of(&lease), frame, tile, unit = lease.unit, %reason, "unit failed");
                        self.held.remove(&lease);
                        self.say(Say::Failed(v1::Failed { lease: Some(lease.into()), reason })).await;
                    }
                }
            }
        }
    }

    fn drop_lease(&mut self, lease: LeaseName) {
        self.crew.pool.remove(lease);
        let Some(held) = self.held.remove(&lease) else { return };
        // A thread that is at it is free for something else from the next pixel on.
        held.watch.stop();
        if let Some(delivery) = held.delivery {
            delivery.abort();
        }
    }

    async fn hand_back(&mut self, which: impl Fn(Stage) -> bool) {
        let back: Vec<LeaseName> = self.held.iter().filter(|(_, held)| which(held.stage)).map(|(lease, _)| *lease).collect();
        back.iter().for_each(|lease| self.drop_lease(*lease));
        if !back.is_empty() {
            self.say(Say::Returned(v1::Returned { leases: back.into_iter().map(Into::into).collect() })).await;
        }
    }
}

/// The job of a lease, for the log.
pub(crate) fn job_of(lease: &LeaseName) -> uuid::Uuid {
    uuid::Uuid::from_bytes(lease.job)
}

/// The leases of a grant.
fn read(grant: v1::Grant) -> Result<Vec<(LeaseName, Held)>, ConvertError> {
    let mut jobs = BTreeMap::new();
    for spec in grant.jobs {
        let manifest = Digest::try_from(spec.manifest.as_ref()).map_err(|_| ConvertError::Missing { field: "grant.jobs.manifest" })?;
        let plan = Plan::try_from(spec.plan.ok_or(ConvertError::Missing { field: "grant.jobs.plan" })?)?;
        jobs.insert(uuid("grant.jobs.job", &spec.job)?, (manifest, Arc::new(plan)));
    }
    let mut leases = Vec::with_capacity(grant.leases.len());
    for message in grant.leases {
        let lease = lease_ref(message.lease)?;
        let unit = WorkUnit::try_from(message.unit.ok_or(ConvertError::Missing { field: "grant.leases.unit" })?)?;
        let guide = message.guide.map(|guide| tile_guide(guide, unit.tile)).transpose()?.map(Arc::new);
        let (manifest, plan) = jobs.get(&lease.job).cloned().ok_or(ConvertError::Missing { field: "grant.jobs" })?;
        let held = Held {
            stage: Stage::Waiting,
            unit,
            guide,
            plan,
            manifest,
            watch: Arc::default(),
            load_seconds: 0.0,
            compile_seconds: 0.0,
            delivery: None,
        };
        leases.push((lease, held));
    }
    Ok(leases)
}
