//! Leases: who gets them, who keeps them, and when they end.

use std::collections::BTreeSet;

use gradfarm_proto::convert::LeaseName;

use super::book::Book;
use super::command::SessionKey;
use super::dispatch::{Dispatcher, Turn, revoke};
use crate::clock::Timestamp;
use crate::job::{self, Change, Event, Job, JobId, WorkerId};
use crate::schedule::{Queue, choose};

impl Dispatcher {
    pub(super) fn disconnect(&mut self, from: SessionKey, turn: &mut Turn) {
        if self.roster.disconnect(from) {
            tracing::info!(worker = %from.worker, "worker disconnected");
            for job in self.jobs_held_by(from.worker) {
                self.apply(job, Event::Lost { worker: from.worker }, turn);
            }
        }
    }

    pub(super) fn renew(&mut self, worker: WorkerId, held: &[LeaseName], turn: &mut Turn) {
        let until = self.now() + self.ttl;
        for lease in held {
            let LeaseName { job, unit, epoch } = *lease;
            let id = JobId::from_bytes(job);
            if self.jobs.contains_key(&id) {
                self.apply(id, Event::Renewed { unit, epoch, worker, until }, turn);
            } else if self.store.cluster().is_none() {
                turn.effects.push(revoke(worker, *lease));
            }
        }
    }

    /// Ends what has run out of time: leases, frames, and leases that show no progress. Looked at a few times in the life of a lease.
    pub(super) fn expire(&mut self, turn: &mut Turn) {
        let now = self.now();
        if now < self.next_sweep || now < self.patient_until {
            return;
        }
        self.next_sweep = now + self.sweep;
        let lapsed = |job: &Job| job.leased().any(|(_, unit)| matches!(unit.state, job::UnitState::Leased { until, .. } if until <= now));
        let due = |job: &Job| (lapsed(job), job.has_frames_out_of_time(now));
        let due: Vec<(JobId, (bool, bool))> =
            self.open.iter().filter_map(|id| Some((*id, due(self.jobs.get(id)?)))).filter(|(_, due)| *due != (false, false)).collect();
        for (job, (lapsed, _)) in due {
            if lapsed {
                tracing::warn!(%job, "leases ran out");
            }
            self.apply(job, Event::Expired, turn);
        }
        let jobs = &self.jobs;
        let patience = |job: &JobId| jobs.get(job).map(Job::patience);
        for stuck in self.roster.stuck(now, patience) {
            let reason = format!("no progress for {:.0} s, at {} samples", stuck.seconds, stuck.samples);
            tracing::warn!(worker = %stuck.worker, job = %stuck.job, unit = stuck.unit, %reason, "lease taken back");
            self.apply(stuck.job, Event::Stuck { unit: stuck.unit, epoch: stuck.epoch, worker: stuck.worker, reason }, turn);
        }
    }

    /// Gives ready units to workers with credit, one each in turn, until one of the two runs out.
    pub(super) fn assign(&mut self, turn: &mut Turn) {
        if self.draining {
            return;
        }
        let mut hungry = self.roster.hungry();
        if hungry.is_empty() {
            return;
        }
        let now = self.now();
        let mut book = Book::of(&self.jobs, &self.open, &self.roster, &mut self.shares, now);
        while !hungry.is_empty() && !book.is_empty() {
            hungry.retain(|worker| self.assign_one(*worker, &mut book, now, turn));
        }
    }

    /// Gives one unit to a worker; whether there was one, and credit for it.
    fn assign_one(&mut self, worker: WorkerId, book: &mut Book, now: Timestamp, turn: &mut Turn) -> bool {
        let Some(session) = self.roster.get_mut(worker).filter(|session| session.credit > 0) else { return false };
        let queues: &[Queue] = book.queues();
        let jobs = &self.jobs;
        let warm = |position: usize| jobs.get(&book.job(position)).is_some_and(|job| session.scenes.contains(&job.record.scene));
        let offer = |position: usize| book.offer(position, jobs.get(&book.job(position))?, worker, &self.rules);
        let Some((position, unit)) = choose(queues, warm, offer) else { return false };
        let id = book.job(position);
        session.credit -= 1;
        let Some(job) = self.jobs.get(&id) else { return false };
        session.scenes.insert(job.record.scene);
        let charged = self.shares.grant(&job.record.needs.project, job.usual_seconds());
        self.apply(id, Event::Leased { unit, worker, until: now + self.ttl }, turn);
        if let Some(job) = self.jobs.get(&id) {
            self.charged.insert((id, unit), charged);
            book.granted(position, job, &self.shares);
        }
        true
    }

    /// Corrects what a project was charged with for a unit, when it is known what it took.
    pub(super) fn settle_charge(&mut self, change: &Change) {
        match change {
            Change::Delivered { job, unit, result, .. } => {
                let charged = self.charged.remove(&(*job, *unit)).unwrap_or(0.0);
                if let Some(job) = self.jobs.get(job) {
                    self.shares.charge(&job.record.needs.project, result.load + result.compile + result.render - charged);
                }
            }
            // What came to nothing cost as much as it usually does.
            Change::Freed { job, unit, .. } | Change::Witness { job, unit, .. } => drop(self.charged.remove(&(*job, *unit))),
            _ => {}
        }
    }

    /// Open jobs of which a worker holds leases.
    fn jobs_held_by(&self, worker: WorkerId) -> BTreeSet<JobId> {
        let held = |id: &&JobId| self.jobs.get(id).is_some_and(|job| job.leases_of(worker) > 0);
        self.open.iter().filter(held).copied().collect()
    }

    /// Leases of a worker in all open jobs.
    pub(super) fn leases_of(&self, worker: WorkerId) -> Vec<(JobId, u32, u32)> {
        let of = |id: JobId| {
            let held = move |(index, unit): (u32, &job::Unit)| match unit.state {
                job::UnitState::Leased { worker: w, .. } if w == worker => Some((id, index, unit.epoch)),
                _ => None,
            };
            self.jobs.get(&id).into_iter().flat_map(|job| job.leased()).filter_map(held).collect::<Vec<_>>()
        };
        self.jobs_held_by(worker).into_iter().flat_map(of).collect()
    }

    /// How many leases a worker holds.
    pub(super) fn lease_count(&self, worker: WorkerId) -> u64 {
        self.open.iter().filter_map(|id| self.jobs.get(id)).map(|job| u64::from(job.leases_of(worker))).sum()
    }

    /// Workers that were shown to be wrong are set aside, and what they gave unchecked is rendered again where that is still possible.
    pub(super) fn distrust(&mut self, turn: &mut Turn) {
        let now = self.now();
        for (worker, job, unit) in std::mem::take(&mut turn.liars) {
            self.metrics.disagreements.inc();
            self.roster.distrust(worker, now);
            let name = self.roster.name(worker);
            tracing::error!(%worker, name, %job, unit, "worker set aside: others gave another result for a unit of its");
            for open in self.open.clone() {
                self.apply(open, Event::Distrusted { worker }, turn);
            }
        }
    }
}
