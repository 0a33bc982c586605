//! A store that forgets with its process: the twin that tests and throw-away jobs use.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use async_trait::async_trait;
use gradfarm_proto::Digest;

use super::records::MemoryRecords;
use super::{Records, Store, StoreError};
use crate::job::{Attempt, Change, DeliveredRecord, FileKind, FileRecord, JobId, JobState, StoredJob, StoredUnit, Witness};

/// Jobs in memory.
#[derive(Debug, Default)]
pub struct Memory {
    tables: Mutex<Tables>,
    records: MemoryRecords,
}

#[derive(Clone, Debug, Default)]
struct Tables {
    jobs: BTreeMap<JobId, StoredJob>,
    units: BTreeMap<(JobId, u32), StoredUnit>,
    attempts: BTreeMap<(JobId, u32), Vec<Attempt>>,
    witnesses: BTreeMap<(JobId, u32), Vec<Witness>>,
    files: BTreeMap<(JobId, u32, FileKind), FileRecord>,
}

impl Memory {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    /// A copy that goes its own way from here on.
    #[cfg(test)]
    pub(crate) fn fork(&self) -> Self {
        Self { tables: Mutex::new(self.tables().clone()), ..Self::default() }
    }

    fn tables(&self) -> MutexGuard<'_, Tables> {
        // Nothing panics between a change and its end.
        self.tables.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[async_trait]
impl Records for Memory {
    async fn record(&self, kind: &str, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        Ok(self.records.record(kind, key))
    }

    async fn records(&self, kind: &str, before: Option<&str>, most: u32) -> Result<Vec<(String, Vec<u8>)>, StoreError> {
        Ok(self.records.records(kind, before, most))
    }

    async fn replace_record(&self, kind: &str, key: &str, old: Option<&[u8]>, new: Option<&[u8]>) -> Result<bool, StoreError> {
        Ok(self.records.replace(kind, key, old, new))
    }
}

#[async_trait]
impl Store for Memory {
    async fn commit(&self, changes: &[Change]) -> Result<(), StoreError> {
        let mut tables = self.tables();
        let mut before = Vec::with_capacity(changes.len());
        for change in changes {
            before.extend(tables.undo(change));
            if tables.make(change).is_none() {
                before.into_iter().rev().for_each(|undo| undo(&mut tables));
                return Err(StoreError::conflict(change));
            }
        }
        Ok(())
    }

    async fn jobs(&self) -> Result<Vec<StoredJob>, StoreError> {
        let tables = self.tables();
        let units = |job: &StoredJob| {
            let all = tables.units.range((job.record.id, 0)..=(job.record.id, u32::MAX)).map(|(_, unit)| *unit);
            let units: Vec<StoredUnit> = all.collect();
            if job.state == JobState::Done && !units.iter().any(|unit| unit.given_up) { Vec::new() } else { units }
        };
        let attempts = |job: &StoredJob| {
            let all = tables.attempts.range((job.record.id, 0)..=(job.record.id, u32::MAX));
            all.flat_map(|((_, unit), list)| list.iter().map(|attempt| (*unit, attempt.clone()))).collect()
        };
        let witnesses = |job: &StoredJob| {
            let all = tables.witnesses.range((job.record.id, 0)..=(job.record.id, u32::MAX));
            all.flat_map(|((_, unit), list)| list.iter().map(|witness| (*unit, *witness))).collect()
        };
        let whole = |job: &StoredJob| StoredJob { units: units(job), attempts: attempts(job), witnesses: witnesses(job), ..job.clone() };
        Ok(tables.jobs.values().map(whole).collect())
    }

    async fn results(&self, job: JobId, units: Range<u32>) -> Result<Vec<(u32, DeliveredRecord)>, StoreError> {
        if units.is_empty() {
            return Ok(Vec::new());
        }
        let tables = self.tables();
        let rows = tables.units.range((job, units.start)..(job, units.end));
        Ok(rows.filter_map(|((_, unit), row)| Some((*unit, row.result?))).collect())
    }

    async fn files(&self) -> Result<Vec<Digest>, StoreError> {
        Ok(self.tables().files.values().map(|file| file.blob).collect())
    }

    async fn file(&self, job: JobId, position: u32, kind: FileKind) -> Result<Option<FileRecord>, StoreError> {
        Ok(self.tables().files.get(&(job, position, kind)).copied())
    }
}

/// Puts back what there was before a change.
type Undo = Box<dyn FnOnce(&mut Tables)>;

/// How to put an entry of a table back to what it is now.
fn undo<K: Ord + Clone + 'static, V: Clone + 'static>(table: fn(&mut Tables) -> &mut BTreeMap<K, V>, key: K, now: Option<V>) -> Undo {
    Box::new(move |tables| {
        match now {
            Some(value) => table(tables).insert(key, value),
            None => table(tables).remove(&key),
        };
    })
}

impl Tables {
    /// How to put back what a change may touch.
    fn undo(&self, change: &Change) -> Vec<Undo> {
        let job = |id: &JobId| undo(|tables| &mut tables.jobs, *id, self.jobs.get(id).cloned());
        let unit = |id: &JobId, number: &u32| undo(|tables| &mut tables.units, (*id, *number), self.units.get(&(*id, *number)).copied());
        let witnesses = |id: &JobId, number: &u32| {
            let key = (*id, *number);
            undo(|tables| &mut tables.witnesses, key, self.witnesses.get(&key).cloned())
        };
        match change {
            Change::Submitted(record) => vec![job(&record.id)],
            Change::Job { job: id, .. }
            | Change::Frame { job: id, .. }
            | Change::Window { job: id, .. }
            | Change::Paused { job: id, .. }
            | Change::Priority { job: id, .. } => vec![job(id)],
            Change::Leased { job, unit: number, .. }
            | Change::Withdrawn { job, unit: number, .. }
            | Change::Delivered { job, unit: number, .. } => vec![unit(job, number)],
            Change::Freed { job, unit: number, .. } | Change::Witness { job, unit: number, .. } => {
                vec![unit(job, number), witnesses(job, number)]
            }
            Change::Attempt { job, unit: number, .. } => {
                let key = (*job, *number);
                vec![undo(|tables| &mut tables.attempts, key, self.attempts.get(&key).cloned())]
            }
            Change::File { job, position, file } => {
                let key = (*job, *position, file.kind);
                vec![undo(|tables| &mut tables.files, key, self.files.get(&key).copied())]
            }
            Change::Worker { .. } => Vec::new(),
            // Rare, and touches everything.
            Change::Forgotten { .. } => {
                let whole = self.clone();
                vec![Box::new(move |tables| *tables = whole)]
            }
        }
    }

    /// Makes one change; `None` if it does not fit.
    fn make(&mut self, change: &Change) -> Option<()> {
        match change {
            Change::Submitted(record) => {
                let token_taken = |job: &StoredJob| record.client_token.is_some() && job.record.client_token == record.client_token;
                if self.jobs.contains_key(&record.id) || self.jobs.values().any(token_taken) {
                    return None;
                }
                let job = StoredJob {
                    record: (**record).clone(),
                    state: JobState::Queued,
                    error: None,
                    started: None,
                    finished: None,
                    paused: false,
                    windows: Vec::new(),
                    frames: Vec::new(),
                    units: Vec::new(),
                    attempts: Vec::new(),
                    witnesses: Vec::new(),
                };
                self.jobs.insert(record.id, job);
            }
            Change::Job { job, state, error, started, finished } => {
                let row = self.jobs.get_mut(job)?;
                (row.state, row.error, row.started, row.finished) = (*state, error.clone(), *started, *finished);
            }
            Change::Frame { job, position, frame } => {
                let frames = &mut self.jobs.get_mut(job)?.frames;
                match frames.binary_search_by_key(position, |(p, _)| *p) {
                    Ok(at) => frames[at].1 = (**frame).clone(),
                    Err(at) => frames.insert(at, (*position, (**frame).clone())),
                }
            }
            Change::Leased { job, unit, epoch, worker, .. } => {
                self.jobs.get(job)?;
                let fresh =
                    StoredUnit { unit: *unit, epoch: 0, failures: 0, losses: 0, given_up: false, lease: None, result: None, worker: None };
                let row = self.units.entry((*job, *unit)).or_insert(fresh);
                if row.result.is_some() || row.epoch.checked_add(1) != Some(*epoch) {
                    return None;
                }
                (row.epoch, row.lease) = (*epoch, Some(*worker));
            }
            Change::Freed { job, unit, failures, losses, given_up } => {
                let row = self.units.get_mut(&(*job, *unit))?;
                (row.failures, row.losses, row.lease, row.given_up) = (*failures, *losses, None, *given_up);
                if *given_up {
                    self.witnesses.remove(&(*job, *unit));
                }
            }
            Change::Attempt { job, unit, number, attempt } => {
                self.jobs.get(job)?;
                let attempts = self.attempts.entry((*job, *unit)).or_default();
                if attempts.len() != *number as usize {
                    return None;
                }
                attempts.push(attempt.clone());
            }
            Change::Witness { job, unit, witness } => {
                let row = self.units.get_mut(&(*job, *unit)).filter(|row| row.epoch == witness.epoch)?;
                row.lease = None;
                let witnesses = self.witnesses.entry((*job, *unit)).or_default();
                if witnesses.iter().any(|other| other.epoch == witness.epoch) {
                    return None;
                }
                witnesses.push(*witness);
            }
            Change::Withdrawn { job, unit, epoch } => {
                let row = self.units.get_mut(&(*job, *unit)).filter(|row| row.epoch.checked_add(1) == Some(*epoch))?;
                (row.epoch, row.result, row.worker) = (*epoch, None, None);
            }
            Change::Priority { job, priority } => self.jobs.get_mut(job)?.record.priority = *priority,
            Change::Delivered { job, unit, epoch, worker, result } => {
                let row = self.units.get_mut(&(*job, *unit))?;
                if row.result.is_some() || row.epoch != *epoch {
                    return None;
                }
                (row.lease, row.result, row.worker) = (None, Some(*result), Some(*worker));
            }
            Change::File { job, position, file } => {
                self.jobs.get(job)?;
                self.files.insert((*job, *position, file.kind), *file);
            }
            Change::Window { job, window, solved } => {
                let windows = &mut self.jobs.get_mut(job)?.windows;
                let at = windows.binary_search_by_key(window, |(w, _)| *w).err()?;
                windows.insert(at, (*window, (**solved).clone()));
            }
            Change::Paused { job, paused } => self.jobs.get_mut(job)?.paused = *paused,
            Change::Forgotten { job } => {
                self.jobs.get(job).filter(|row| row.state.is_final())?;
                self.jobs.remove(job);
                self.units.retain(|(of, _), _| of != job);
                self.files.retain(|(of, _, _), _| of != job);
                self.attempts.retain(|(of, _), _| of != job);
                self.witnesses.retain(|(of, _), _| of != job);
            }
            Change::Worker { .. } => {}
        }
        Some(())
    }
}
