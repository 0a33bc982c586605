//! How long the units of a job take as a rule: what tells a slow one from one that is stuck.

use std::time::Duration;

/// The mean time of a job's units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pace {
    units: u64,
    seconds: f64,
}

impl Pace {
    /// A unit took so long to trace [s].
    pub(super) fn note(&mut self, seconds: f64) {
        self.units += 1;
        self.seconds += seconds;
    }

    /// The mean [s]; 0 before the first.
    pub(super) fn usual(self) -> f64 {
        if self.units == 0 { 0.0 } else { self.seconds / self.units as f64 }
    }
}

impl super::Job {
    /// For how long a lease may show no progress before it is taken back.
    pub fn patience(&self) -> Duration {
        const LEAST: Duration = Duration::from_secs(60);
        Duration::try_from_secs_f64(10.0 * self.pace.usual()).unwrap_or(LEAST).max(LEAST)
    }

    /// Tracing time of a unit, as a rule [s]; 0 before the first result.
    pub fn usual_seconds(&self) -> f64 {
        self.pace.usual()
    }
}
