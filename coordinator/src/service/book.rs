//! Which jobs have something for somebody in this turn, in the order in which they are served, and how much of each limit is used.
//!
//! It is counted anew from the jobs in every turn in which somebody wants work: there are no counters that could be wrong.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::roster::Roster;
use super::rules::Rules;
use crate::clock::Timestamp;
use crate::job::{Job, JobId, WorkerId};
use crate::schedule::{Queue, Reached, Shares};

/// The book of a turn.
pub(super) struct Book {
    queues: Vec<Queue>,
    entries: Vec<Entry>,
    used: Used,
}

/// A job with units that wait for a worker.
struct Entry {
    id: JobId,
    project: Arc<str>,
    /// Who may render it, in order.
    eligible: Arc<[WorkerId]>,
}

/// How many leases count against which limit.
#[derive(Debug, Default)]
pub(super) struct Used {
    projects: BTreeMap<String, u32>,
    limits: BTreeMap<String, u32>,
}

impl Used {
    /// Counts the leases of all open jobs.
    pub(super) fn of<'a>(jobs: impl Iterator<Item = &'a Job>) -> Self {
        let mut used = Self::default();
        jobs.filter(|job| job.leases() > 0).for_each(|job| used.add(job, job.leases() as u32));
        used
    }

    fn add(&mut self, job: &Job, leases: u32) {
        let needs = &job.record.needs;
        *self.projects.entry(needs.project.clone()).or_insert(0) += leases;
        needs.limits.iter().for_each(|name| *self.limits.entry(name.clone()).or_insert(0) += leases);
    }

    /// The first limit that keeps a job from one more lease, for one of its workers or, without one, for anybody new.
    pub(super) fn reached(&self, job: &Job, worker: Option<WorkerId>, rules: &Rules) -> Option<Reached> {
        let needs = &job.record.needs;
        if let Some(most) = needs.most_workers
            && job.workers() >= most as usize
            && worker.is_none_or(|worker| job.leases_of(worker) == 0)
        {
            return Some(Reached::Workers(most));
        }
        if let Some(most) = rules.project_leases.get(&needs.project)
            && self.projects.get(&needs.project).is_some_and(|used| used >= most)
        {
            return Some(Reached::Project(needs.project.clone(), *most));
        }
        needs.limits.iter().find_map(|name| {
            let most = rules.limits.get(name)?;
            (self.limits.get(name).copied().unwrap_or(0) >= *most).then(|| Reached::Named(name.clone(), *most))
        })
    }
}

impl Book {
    /// Opens the book: says which projects are at work, and puts their jobs in order.
    pub(super) fn of(jobs: &BTreeMap<JobId, Job>, open: &BTreeSet<JobId>, roster: &Roster, shares: &mut Shares, now: Timestamp) -> Self {
        let held: Vec<&Job> = open.iter().filter_map(|id| jobs.get(id)).collect();
        let waiting: Vec<&Job> = held.iter().filter(|job| job.has_open_units()).copied().collect();
        let used = Used::of(held.iter().copied());
        if waiting.is_empty() {
            return Self { queues: Vec::new(), entries: Vec::new(), used };
        }
        let at_work = held.iter().filter(|job| job.leases() > 0).chain(&waiting).map(|job| job.record.needs.project.clone());
        shares.activate(at_work.collect());
        let anybody: Arc<[WorkerId]> = roster.eligible(now, &Default::default()).into();
        let mut rows: Vec<(Queue, Entry)> = waiting
            .into_iter()
            .map(|job| {
                let needs = &job.record.needs;
                let eligible = if needs.any_worker() { anybody.clone() } else { roster.eligible(now, needs).into() };
                let queue = Queue { priority: job.record.priority, share: shares.time(&needs.project), served: job.leases() > 0 };
                (queue, Entry { id: job.record.id, project: needs.project.as_str().into(), eligible })
            })
            .filter(|(_, entry)| !entry.eligible.is_empty())
            .collect();
        rows.sort_by(|(a, one), (b, other)| a.order(b).then(one.id.cmp(&other.id)));
        let (queues, entries) = rows.into_iter().unzip();
        Self { queues, entries, used }
    }

    /// Whether nobody waits for anybody.
    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The jobs in order, for the choice.
    pub(super) fn queues(&self) -> &[Queue] {
        &self.queues
    }

    /// The job at a position.
    pub(super) fn job(&self, position: usize) -> JobId {
        self.entries[position].id
    }

    /// The unit that a job has for a worker, if it has one and no limit is in the way.
    pub(super) fn offer(&self, position: usize, job: &Job, worker: WorkerId, rules: &Rules) -> Option<u32> {
        let eligible = &self.entries[position].eligible;
        if eligible.binary_search(&worker).is_err() || self.used.reached(job, Some(worker), rules).is_some() {
            return None;
        }
        job.next_for(worker, eligible)
    }

    /// A unit of the job at a position was granted.
    pub(super) fn granted(&mut self, position: usize, job: &Job, shares: &Shares) {
        self.used.add(job, 1);
        self.queues[position].served = true;
        let project = self.entries[position].project.clone();
        if !job.has_open_units() {
            self.queues.remove(position);
            self.entries.remove(position);
        }
        let share = shares.time(&project);
        let same = |other: &Entry| other.project == project;
        self.queues.iter_mut().zip(&self.entries).filter(|(_, entry)| same(entry)).for_each(|(queue, _)| queue.share = share);
        let sorted = self.queues.is_sorted_by(|a, b| a.order(b).is_le());
        if !sorted {
            let mut rows: Vec<(Queue, Entry)> = self.queues.drain(..).zip(self.entries.drain(..)).collect();
            rows.sort_by(|(a, one), (b, other)| a.order(b).then(one.id.cmp(&other.id)));
            (self.queues, self.entries) = rows.into_iter().unzip();
        }
    }
}
