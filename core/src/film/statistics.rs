//! Counts of what happened while samples were traced: they tell why gradients are good or bad in a scene.

/// Names of the counters, in storage order.
///
/// `shift_*` count one outcome for each (base path, neighbour); `not_finite` counts contributions that were replaced by zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Counter {
    /// Camera samples (base paths).
    Samples,
    /// Rays traced, shadow rays included.
    Rays,
    /// Vertices of base paths.
    Vertices,
    /// The offset path joined the base path.
    ShiftReconnected,
    /// The offset path followed the base path to its end without joining it.
    ShiftFollowed,
    /// The neighbour lies outside the film.
    ShiftOutsideFilm,
    /// The offset's primary ray met nothing.
    ShiftEscaped,
    /// The segment that would reconnect is blocked.
    ShiftOccluded,
    /// The paths differ in kind: one scatters where the other cannot, or the shift has no inverse there.
    ShiftLobeMismatch,
    /// Refraction copied to the offset is totally reflected.
    ShiftTotalReflection,
    /// Contributions that were NaN or infinite.
    NotFinite,
}

impl Counter {
    /// Every counter, in storage order.
    pub const ALL: [Counter; 11] = [
        Counter::Samples,
        Counter::Rays,
        Counter::Vertices,
        Counter::ShiftReconnected,
        Counter::ShiftFollowed,
        Counter::ShiftOutsideFilm,
        Counter::ShiftEscaped,
        Counter::ShiftOccluded,
        Counter::ShiftLobeMismatch,
        Counter::ShiftTotalReflection,
        Counter::NotFinite,
    ];

    /// Name in reports, JSON and metrics.
    pub fn name(self) -> &'static str {
        match self {
            Counter::Samples => "samples",
            Counter::Rays => "rays",
            Counter::Vertices => "vertices",
            Counter::ShiftReconnected => "shift_reconnected",
            Counter::ShiftFollowed => "shift_followed",
            Counter::ShiftOutsideFilm => "shift_outside_film",
            Counter::ShiftEscaped => "shift_escaped",
            Counter::ShiftOccluded => "shift_occluded",
            Counter::ShiftLobeMismatch => "shift_lobe_mismatch",
            Counter::ShiftTotalReflection => "shift_total_reflection",
            Counter::NotFinite => "not_finite",
        }
    }
}

/// One value for each [`Counter`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    counts: [u64; Counter::ALL.len()],
}

impl Statistics {
    /// Rebuilds statistics from values in storage order; missing ones are zero, surplus ones are dropped (a newer peer's).
    pub fn from_counts(values: &[u64]) -> Self {
        let mut counts = [0; Counter::ALL.len()];
        for (count, value) in counts.iter_mut().zip(values) {
            *count = *value;
        }
        Self { counts }
    }

    /// Values in storage order.
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// One value.
    pub fn get(&self, counter: Counter) -> u64 {
        self.counts[counter as usize]
    }

    /// Adds to one counter.
    #[inline]
    pub fn add(&mut self, counter: Counter, n: u64) {
        self.counts[counter as usize] += n;
    }

    /// Adds every counter of `other`.
    pub fn merge(&mut self, other: &Statistics) {
        for (count, value) in self.counts.iter_mut().zip(other.counts) {
            *count += value;
        }
    }
}
