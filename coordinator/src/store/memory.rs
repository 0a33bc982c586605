//! A store that forgets with its process: the twin that tests and throw-away jobs use.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use async_trait::async_trait;
use gradfarm_proto::Digest;

use super::records::MemoryRecords;
use super::{Records, Store, StoreError};
use crate::job::{Change, DeliveredRecord, FileKind, FileRecord, JobId, JobState, StoredJob, StoredUnit};

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
    files: BTreeMap<(JobId, u32, FileKind), FileRecord>,
}

impl Memory {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    fn tables(&self) -> MutexGuard<'_, Tables> {
        // The tables are replaced whole, so a panic elsewhere cannot have left them half changed.
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
        let mut next = tables.clone();
        for change in changes {
            next.make(change).ok_or_else(|| StoreError::conflict(change))?;
        }
        *tables = next;
        Ok(())
    }

    async fn jobs(&self) -> Result<Vec<StoredJob>, StoreError> {
        let tables = self.tables();
        let units = |job: &StoredJob| {
            let all = tables.units.range((job.record.id, 0)..=(job.record.id, u32::MAX)).map(|(_, unit)| *unit);
            if job.state == JobState::Done { Vec::new() } else { all.collect() }
        };
        Ok(tables.jobs.values().map(|job| StoredJob { units: units(job), ..job.clone() }).collect())
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

impl Tables {
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
                let fresh = StoredUnit { unit: *unit, epoch: 0, failures: 0, losses: 0, lease: None, result: None };
                let row = self.units.entry((*job, *unit)).or_insert(fresh);
                if row.result.is_some() || row.epoch.checked_add(1) != Some(*epoch) {
                    return None;
                }
                (row.epoch, row.lease) = (*epoch, Some(*worker));
            }
            Change::Freed { job, unit, failures, losses } => {
                let row = self.units.get_mut(&(*job, *unit))?;
                (row.failures, row.losses, row.lease) = (*failures, *losses, None);
            }
            Change::Delivered { job, unit, epoch, result } => {
                let row = self.units.get_mut(&(*job, *unit))?;
                if row.result.is_some() || row.epoch != *epoch {
                    return None;
                }
                (row.lease, row.result) = (None, Some(*result));
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
            }
            Change::Worker { .. } => {}
        }
        Some(())
    }
}
