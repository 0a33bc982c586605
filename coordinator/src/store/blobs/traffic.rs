//! How many bytes went in and out, and how many there were when somebody last counted.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Counters that all copies of a storage's handle share.
#[derive(Clone, Debug, Default)]
pub struct Traffic {
    /// Written, read, contents, bytes of these.
    counters: Arc<[AtomicU64; 4]>,
}

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counted {
    /// Bytes put, also where they were there before.
    pub written: u64,
    /// Bytes read.
    pub read: u64,
    /// Contents that there were at the last count.
    pub stock: u64,
    /// Their bytes.
    pub stock_bytes: u64,
}

impl Traffic {
    /// What was counted so far.
    pub fn counted(&self) -> Counted {
        let [written, read, stock, stock_bytes] = self.counters.each_ref().map(|counter| counter.load(Relaxed));
        Counted { written, read, stock, stock_bytes }
    }

    pub(super) fn wrote(&self, bytes: usize) {
        self.counters[0].fetch_add(bytes as u64, Relaxed);
    }

    pub(super) fn read(&self, bytes: usize) {
        self.counters[1].fetch_add(bytes as u64, Relaxed);
    }

    pub(super) fn stocked(&self, count: u64, bytes: u64) {
        self.counters[2].store(count, Relaxed);
        self.counters[3].store(bytes, Relaxed);
    }
}
