//! The loop that owns all jobs and workers. It works in turns: take what was asked, change the jobs, make the changes durable in one
//! commit, and only then answer, grant and assemble. If a commit fails it stops, for memory and store could differ.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use gradfarm_proto::convert::LeaseName;
use gradfarm_proto::v1;
use gradfarm_proto::v1::coordinator_message::Message;
use tokio::sync::{broadcast, mpsc, oneshot};

use super::cluster::own_jobs;
use super::command::{Command, Hello, SessionKey};
use super::grant::grants;
use super::look;
use super::roster::Roster;
use super::rules::Rules;
use super::view::JobEvent;
use crate::clock::{Clock, Timestamp};
use crate::error::Error;
use crate::job::{self, Action, Answer, Change, Errand, Event, Job, JobId, News, WorkerId};
use crate::metrics::{Ledger, Metrics};
use crate::schedule::Shares;
use crate::store::Store;
use crate::webhook::Webhook;

/// Most commands in one turn, so that nobody waits for long.
const TURN: usize = 256;
/// Events that a watcher may lag behind.
const WATCH: usize = 1024;

/// What is told to a job's assembler: the job as it is, and what to do.
pub(crate) type Assembler = Box<dyn Fn(&Job, Errand) + Send + Sync>;

/// The loop's state.
pub(crate) struct Dispatcher {
    pub(super) clock: Clock,
    pub(super) jobs: BTreeMap<JobId, Job>,
    pub(super) roster: Roster,
    heartbeat: Duration,
    pub(super) ttl: Duration,
    /// Why the loop must end.
    pub(super) broken: Option<Error>,
    /// Until then no lease runs out: the loop itself was held up.
    pub(super) patient_until: Timestamp,
    /// Jobs that are not over.
    pub(super) open: BTreeSet<JobId>,
    /// What the operator decided.
    pub(super) rules: Arc<Rules>,
    /// What projects were given.
    pub(super) shares: Shares,
    /// What projects were charged with for leases that are held [s].
    pub(super) charged: BTreeMap<(JobId, u32), f64>,
    /// How often leases are looked over, and when next.
    pub(super) sweep: Duration,
    pub(super) next_sweep: Timestamp,
    pub(super) tokens: BTreeMap<String, JobId>,
    pub(super) watchers: BTreeMap<JobId, broadcast::Sender<JobEvent>>,
    pub(super) store: Arc<dyn Store>,
    /// Whether nothing is granted any more, for the coordinator is about to stop.
    pub(super) draining: bool,
    /// Whom to tell that jobs change their state.
    pub(super) webhook: Option<Webhook>,
    pub(super) metrics: Arc<Metrics>,
    /// Since when leases are held.
    pub(super) ledger: Ledger,
    assembler: Assembler,
}

/// What one turn has gathered.
#[derive(Default)]
pub(super) struct Turn {
    pub(super) changes: Vec<Change>,
    pub(super) effects: Vec<Effect>,
    /// Workers that were shown to be wrong, with the job and the unit.
    pub(super) liars: Vec<(WorkerId, JobId, u32)>,
}

/// What is done once the turn's changes are durable.
pub(super) enum Effect {
    Reply(Box<dyn FnOnce() + Send>),
    Look(Box<dyn FnOnce(&mut Dispatcher) + Send>),
    Send(WorkerId, Message),
    Grant(WorkerId, LeaseName),
    Do(JobId, Errand),
    Tell(JobId, News),
}

impl Dispatcher {
    /// A dispatcher over the jobs that the store kept, with what was to be done to their frames and was broken off.
    pub(crate) async fn restore(
        store: Arc<dyn Store>,
        heartbeat: Duration,
        ttl: Duration,
        rules: Arc<Rules>,
        assembler: Assembler,
    ) -> Result<(Self, Vec<(JobId, Errand)>), Error> {
        let clock = Clock::new();
        let mut dispatcher = Self {
            clock,
            jobs: BTreeMap::new(),
            roster: Roster::default(),
            heartbeat,
            ttl,
            broken: None,
            patient_until: clock.now(),
            open: BTreeSet::new(),
            shares: Shares::new(rules.weights.clone()),
            rules,
            charged: BTreeMap::new(),
            sweep: (ttl / 10).clamp(Duration::from_millis(10), Duration::from_millis(500)),
            next_sweep: clock.now(),
            tokens: BTreeMap::new(),
            watchers: BTreeMap::new(),
            store,
            draining: false,
            webhook: None,
            metrics: Arc::default(),
            ledger: Ledger::default(),
            assembler,
        };
        let mut pending = Vec::new();
        for stored in own_jobs(dispatcher.store.as_ref()).await? {
            let (id, errands) = dispatcher.take_up(stored)?;
            pending.extend(errands.into_iter().map(|errand| (id, errand)));
        }
        Ok((dispatcher, pending))
    }

    /// Works until `commands` is closed or `stop` says so.
    pub(crate) async fn run(
        mut self,
        pending: Vec<(JobId, Errand)>,
        mut commands: mpsc::Receiver<Command>,
        stop: impl Future<Output = ()>,
    ) -> Result<(), Error> {
        let mut tick = tokio::time::interval(self.sweep);
        tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        tokio::pin!(stop);
        for (job, errand) in pending {
            self.carry_out(Effect::Do(job, errand));
        }
        loop {
            let first = tokio::select! {
                () = &mut stop => break,
                _ = tick.tick() => None,
                command = commands.recv() => match command {
                    Some(command) => Some(command),
                    None => break,
                },
            };
            let mut turn = Turn::default();
            if let Some(first) = first {
                self.take(first, &mut turn);
                for _ in 1..TURN {
                    let Ok(command) = commands.try_recv() else { break };
                    self.take(command, &mut turn);
                }
            }
            self.expire(&mut turn);
            self.distrust(&mut turn);
            self.assign(&mut turn);
            if !turn.changes.is_empty() {
                let before = self.now();
                let begun = Instant::now();
                self.store.commit(&turn.changes).await?;
                self.metrics.committed(turn.changes.len(), begun.elapsed());
                self.metrics.count(&turn.changes, &mut self.ledger, before);
                if before + self.heartbeat < self.now() {
                    // Workers that were not heard meanwhile are not to blame.
                    self.patient_until = self.now() + self.ttl;
                }
            }
            if let Some(error) = self.broken.take() {
                return Err(error);
            }
            self.finish(turn.effects);
        }
        self.roster.dismiss();
        Ok(())
    }

    pub(super) fn now(&self) -> Timestamp {
        self.clock.now()
    }

    pub(super) fn admit(&mut self, job: Job) {
        let id = job.record.id;
        if let Some(token) = &job.record.client_token {
            self.tokens.insert(token.clone(), id);
        }
        if !job.state.is_final() {
            self.open.insert(id);
        }
        self.jobs.insert(id, job);
    }

    fn take(&mut self, command: Command, turn: &mut Turn) {
        match command {
            Command::Submit { record, kept, paused, reply } => {
                let outcome = self.submit(*record, kept, paused, turn);
                turn.effects.push(answer(reply, outcome));
            }
            Command::Cancel { job, reply } => {
                let outcome = self.cancel(job, turn);
                turn.effects.push(answer(reply, outcome));
            }
            Command::Pause { job, paused, reply } => {
                let outcome = self.pause(job, paused, turn);
                turn.effects.push(answer(reply, outcome));
            }
            Command::Adopt { outcome } => self.adopt(outcome, turn),
            Command::Drain => self.drain(turn),
            Command::Forget { keep } => self.forget(keep, turn),
            Command::Prioritise { job, priority, reply } => {
                let outcome = self.prioritise(job, priority, turn);
                turn.effects.push(answer(reply, outcome));
            }
            Command::Retry { job, frame, reply } => {
                let outcome = self.retry(job, frame, turn);
                turn.effects.push(answer(reply, outcome));
            }
            Command::Look(look) => turn.effects.push(Effect::Look(look)),
            Command::Connect { hello, outbox, reply } => {
                let key = self.connect(&hello, outbox, turn);
                turn.effects.push(answer(reply, key));
            }
            Command::Credit { from, leases } => {
                let now = self.now();
                if let Some(session) = self.roster.current(from) {
                    session.hear(now);
                    session.credit = session.credit.saturating_add(leases).min(gradfarm_proto::limits::LEASES as u32);
                }
            }
            Command::Heartbeat { from, held, scenes, progress } => {
                let now = self.now();
                if let Some(session) = self.roster.current(from) {
                    session.hear(now);
                    session.note_progress(&progress, now);
                    session.scenes = scenes.into_iter().collect();
                    self.renew(from.worker, &held, turn);
                }
            }
            Command::Returned { from, leases } => {
                for LeaseName { job, unit, epoch } in leases {
                    self.apply(JobId::from_bytes(job), Event::Returned { unit, epoch, worker: from.worker }, turn);
                }
            }
            Command::Failed { worker, lease, reason } => {
                let job = JobId::from_bytes(lease.job);
                tracing::warn!(%worker, %job, unit = lease.unit, epoch = lease.epoch, %reason, "unit failed");
                let event = Event::Failed { unit: lease.unit, epoch: lease.epoch, worker, reason };
                self.apply(JobId::from_bytes(lease.job), event, turn);
            }
            Command::Disconnect { from } => self.disconnect(from, turn),
            Command::Deliver { worker, lease, result, reply } => {
                let event = Event::Delivered { unit: lease.unit, epoch: lease.epoch, worker, result };
                let outcome = self.apply(JobId::from_bytes(lease.job), event, turn).unwrap_or(Answer::Superseded);
                turn.effects.push(answer(reply, outcome));
            }
            Command::Assembled { job, frame, outcome } => {
                self.apply(job, Event::Assembled { frame, outcome }, turn);
            }
            Command::Measured { job, frame, outcome } => {
                self.apply(job, Event::Measured { frame, outcome }, turn);
            }
            Command::Guided { job, frame, round, outcome } => {
                self.apply(job, Event::Guided { frame, round, outcome }, turn);
            }
            Command::Solved { job, window, outcome } => {
                self.apply(job, Event::Solved { window, outcome }, turn);
            }
        }
    }

    fn connect(&mut self, hello: &Hello, outbox: mpsc::Sender<v1::CoordinatorMessage>, turn: &mut Turn) -> SessionKey {
        let (now, worker) = (self.now(), hello.worker);
        self.metrics.connections.inc();
        let key = self.roster.connect(hello, outbox, now);
        tracing::info!(%worker, name = %hello.name, threads = hello.capabilities.threads, pool = %hello.capabilities.pool, "worker connected");
        let (name, version, threads) = (hello.name.clone(), hello.version.clone(), hello.capabilities.threads);
        turn.changes.push(Change::Worker { worker, name, version, threads, at: now });
        let millis = |span: Duration| u32::try_from(span.as_millis()).unwrap_or(u32::MAX);
        let welcome = v1::Welcome {
            protocol: hello.protocol,
            heartbeat_ms: millis(self.heartbeat),
            lease_ttl_ms: millis(self.ttl),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        turn.effects.push(Effect::Send(worker, Message::Welcome(welcome)));
        // Leases that it was granted but never got.
        let held: BTreeSet<&LeaseName> = hello.held.iter().collect();
        for (job, unit, epoch) in self.leases_of(worker) {
            if !held.contains(&LeaseName { job: job.to_bytes(), unit, epoch }) {
                self.apply(job, Event::Returned { unit, epoch, worker }, turn);
            }
        }
        self.renew(worker, &hello.held, turn);
        key
    }

    /// Applies an event to a job and sorts what follows; the answer to a delivery, if there is one.
    pub(super) fn apply(&mut self, id: JobId, event: Event, turn: &mut Turn) -> Option<Answer> {
        let now = self.now();
        let actions = job::apply(self.jobs.get_mut(&id)?, event, now);
        self.sort(id, actions, turn)
    }

    pub(super) fn sort(&mut self, id: JobId, actions: Vec<Action>, turn: &mut Turn) -> Option<Answer> {
        let now = self.now();
        let mut answered = None;
        for action in actions {
            match action {
                Action::Keep(change) => {
                    self.settle_charge(&change);
                    turn.changes.push(change);
                }
                Action::Answer(answer) => answered = Some(answer),
                Action::Grant { unit, epoch, worker } => {
                    if let Some(work) = self.jobs.get(&id).map(|job| job.split.work(unit)) {
                        let (frame, tile) = (work.moment.first, format!("{},{}", work.tile.x, work.tile.y));
                        tracing::debug!(job = %id, frame, tile, unit, epoch, %worker, "granted");
                    }
                    turn.effects.push(Effect::Grant(worker, LeaseName { job: id.to_bytes(), unit, epoch }));
                }
                Action::Revoke { unit, epoch, worker } => {
                    turn.effects.push(revoke(worker, LeaseName { job: id.to_bytes(), unit, epoch }));
                }
                Action::Do(errand) => turn.effects.push(Effect::Do(id, errand)),
                Action::Blame(worker) => self.roster.blame(worker, now),
                Action::Praise(worker) => self.roster.praise(worker),
                Action::Distrust { worker, unit } => turn.liars.push((worker, id, unit)),
                Action::Tell(news) => turn.effects.push(Effect::Tell(id, news)),
            }
        }
        if let Some(job) = self.jobs.get(&id) {
            // A job that is tried again is open again.
            if job.state.is_final() {
                self.open.remove(&id)
            } else {
                self.open.insert(id)
            };
        }
        answered
    }

    fn finish(&mut self, effects: Vec<Effect>) {
        let mut grants: BTreeMap<WorkerId, Vec<LeaseName>> = BTreeMap::new();
        for effect in effects {
            match effect {
                Effect::Grant(worker, lease) => grants.entry(worker).or_default().push(lease),
                other => self.carry_out(other),
            }
        }
        for (worker, leases) in grants {
            self.send_grants(worker, &leases);
        }
        self.watchers.retain(|_, watcher| watcher.receiver_count() > 0);
    }

    fn carry_out(&mut self, effect: Effect) {
        match effect {
            Effect::Reply(reply) => reply(),
            Effect::Look(look) => look(self),
            Effect::Send(worker, message) => self.send(worker, message),
            Effect::Grant(worker, lease) => self.send_grants(worker, &[lease]),
            Effect::Do(id, errand) => {
                if let Some(job) = self.jobs.get(&id) {
                    (self.assembler)(job, errand);
                }
            }
            Effect::Tell(id, news) => {
                let Some(job) = self.jobs.get(&id) else { return };
                if news == News::Job {
                    tracing::info!(job = %id, state = job.state.name(), error = job.error.as_deref(), "job");
                    if let Some(webhook) = &self.webhook {
                        webhook.job(job);
                    }
                }
                if let Some(watcher) = self.watchers.get(&id) {
                    for event in look::events(job, news, self.now()) {
                        // No watcher is left: nothing to tell.
                        let _gone = watcher.send(event);
                    }
                }
            }
        }
    }

    fn send(&mut self, worker: WorkerId, message: Message) {
        // A failed send means the worker is gone or does not read; its stream ends and its leases are freed by that or by time.
        if !self.roster.send(worker, message) {
            tracing::warn!(%worker, "worker could not be reached");
        }
    }

    fn send_grants(&mut self, worker: WorkerId, leases: &[LeaseName]) {
        for grant in grants(&self.jobs, leases) {
            self.send(worker, Message::Grant(grant));
        }
    }

    /// A job by name.
    pub(crate) fn job(&self, id: JobId) -> Option<&Job> {
        self.jobs.get(&id)
    }

    /// Watches a job: its events from now on, after its state and progress of this moment.
    pub(super) fn watch(&mut self, id: JobId) -> Option<(Vec<JobEvent>, broadcast::Receiver<JobEvent>)> {
        let job = self.jobs.get(&id)?;
        let mut first = vec![look::state_event(job), look::progress_event(job, self.now())];
        if job.state.is_final() {
            first.reverse();
        }
        let watcher = self.watchers.entry(id).or_insert_with(|| broadcast::channel(WATCH).0);
        Some((first, watcher.subscribe()))
    }
}

pub(super) fn answer<T: Send + 'static>(reply: oneshot::Sender<T>, value: T) -> Effect {
    Effect::Reply(Box::new(move || {
        // Whoever asked may have gone away meanwhile.
        let _gone = reply.send(value);
    }))
}

pub(super) fn revoke(worker: WorkerId, lease: LeaseName) -> Effect {
    Effect::Send(worker, Message::Revoke(v1::Revoke { leases: vec![lease.into()] }))
}
