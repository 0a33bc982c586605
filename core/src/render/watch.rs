//! How far the rendering of a unit has come, and whether it is to go on: shared with whoever waits for it. It decides nothing about the
//! bits of a block, only whether there will be one.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Seen from both sides while a unit is rendered.
#[derive(Debug, Default)]
pub struct Watch {
    samples: AtomicU64,
    stopped: AtomicBool,
}

impl Watch {
    /// Camera samples traced so far.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Tells the renderer to stop at the next pixel; there will be no block.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// Whether somebody told the renderer to stop.
    pub fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// Counts samples; whether to go on.
    pub(super) fn count(&self, samples: u64) -> bool {
        self.samples.fetch_add(samples, Ordering::Relaxed);
        !self.is_stopped()
    }
}
