//! Small records beside the jobs: tokens, certificates, and what else is about access.
//!
//! A record is a few bytes under a kind and a key, replaced only by whoever knows what is there: that is enough for what must
//! happen once (a join token that is used up), and it is the same in every store.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::{Mutex, PoisonError};

use async_trait::async_trait;

use super::StoreError;

/// Keeps records.
#[async_trait]
pub trait Records: Debug + Send + Sync {
    /// A record.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn record(&self, kind: &str, key: &str) -> Result<Option<Vec<u8>>, StoreError>;

    /// Records of a kind, the largest key first, at most so many; with `before` only those of smaller keys.
    ///
    /// # Errors
    /// If the store cannot be read.
    async fn records(&self, kind: &str, before: Option<&str>, most: u32) -> Result<Vec<(String, Vec<u8>)>, StoreError>;

    /// Puts `new` in place of `old` (`None`: nothing), durably. `false`, and nothing is changed, if something else is there.
    ///
    /// # Errors
    /// If the store cannot be written.
    async fn replace_record(&self, kind: &str, key: &str, old: Option<&[u8]>, new: Option<&[u8]>) -> Result<bool, StoreError>;
}

/// Records that are forgotten with their process.
#[derive(Debug, Default)]
pub(super) struct MemoryRecords {
    rows: Mutex<BTreeMap<(String, String), Vec<u8>>>,
}

impl MemoryRecords {
    pub(super) fn record(&self, kind: &str, key: &str) -> Option<Vec<u8>> {
        self.with(|rows| rows.get(&(kind.to_owned(), key.to_owned())).cloned())
    }

    pub(super) fn records(&self, kind: &str, before: Option<&str>, most: u32) -> Vec<(String, Vec<u8>)> {
        self.with(|rows| {
            let of_kind = rows.iter().rev().filter(|((its, _), _)| its == kind);
            let wanted = of_kind.filter(|((_, key), _)| before.is_none_or(|before| key.as_str() < before));
            wanted.map(|((_, key), row)| (key.clone(), row.clone())).take(most as usize).collect()
        })
    }

    pub(super) fn replace(&self, kind: &str, key: &str, old: Option<&[u8]>, new: Option<&[u8]>) -> bool {
        self.with(|rows| {
            let place = (kind.to_owned(), key.to_owned());
            let fits = rows.get(&place).map(Vec::as_slice) == old;
            if fits {
                match new {
                    Some(new) => drop(rows.insert(place, new.to_vec())),
                    None => drop(rows.remove(&place)),
                }
            }
            fits
        })
    }

    fn with<T>(&self, look: impl FnOnce(&mut BTreeMap<(String, String), Vec<u8>>) -> T) -> T {
        // Rows are inserted and removed whole.
        look(&mut self.rows.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
