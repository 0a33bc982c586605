//! Counts of what happened while samples were traced: they tell why gradients are good or bad in a scene.

use std::collections::BTreeMap;

/// Names of the counters, in storage order.
///
/// `shift_*` count one outcome for each (base path, neighbour); `not_finite_*` count contributions that were replaced by zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Counter {
    /// Camera samples (base paths).
    Samples,
    /// Rays traced, shadow rays included.
    Rays,
    /// Vertices of base paths.
    Vertices,
    /// The offset path joined the base path on a surface.
    ShiftReconnectedSurface,
    /// The offset path joined the base path inside a medium.
    ShiftReconnectedMedium,
    /// Both paths left the scene in the same direction.
    ShiftReconnectedInfinity,
    /// The offset path followed the base path to its end without joining it.
    ShiftFollowed,
    /// Russian roulette decided against the shift.
    ShiftSkipped,
    /// The neighbour lies outside the film.
    ShiftOutsideFilm,
    /// An offset ray met nothing, or another kind of thing than the base ray.
    ShiftEscaped,
    /// The segment that would reconnect is blocked.
    ShiftOccluded,
    /// The offset cannot scatter as the base did.
    ShiftLobeMismatch,
    /// Refraction copied to the offset is totally reflected.
    ShiftTotalReflection,
    /// The shift back would be of another kind.
    ShiftIrreversible,
    /// Steps of offset paths that copied a half vector.
    HalfVectorsCopied,
    /// Steps of offset paths that replayed random numbers.
    StepsReplayed,
    /// Primal contributions that were NaN or infinite.
    NotFinitePrimal,
    /// Directly visible emission that was NaN or infinite.
    NotFiniteDirect,
    /// Differences that were NaN or infinite.
    NotFiniteGradient,
}

impl Counter {
    /// Every counter, in storage order.
    pub const ALL: [Counter; 19] = [
        Counter::Samples,
        Counter::Rays,
        Counter::Vertices,
        Counter::ShiftReconnectedSurface,
        Counter::ShiftReconnectedMedium,
        Counter::ShiftReconnectedInfinity,
        Counter::ShiftFollowed,
        Counter::ShiftSkipped,
        Counter::ShiftOutsideFilm,
        Counter::ShiftEscaped,
        Counter::ShiftOccluded,
        Counter::ShiftLobeMismatch,
        Counter::ShiftTotalReflection,
        Counter::ShiftIrreversible,
        Counter::HalfVectorsCopied,
        Counter::StepsReplayed,
        Counter::NotFinitePrimal,
        Counter::NotFiniteDirect,
        Counter::NotFiniteGradient,
    ];

    /// The counters of values that were not finite.
    pub const NOT_FINITE: [Counter; 3] = [Counter::NotFinitePrimal, Counter::NotFiniteDirect, Counter::NotFiniteGradient];

    /// Name in reports, JSON and metrics.
    pub fn name(self) -> &'static str {
        match self {
            Counter::Samples => "samples",
            Counter::Rays => "rays",
            Counter::Vertices => "vertices",
            Counter::ShiftReconnectedSurface => "shift_reconnected_surface",
            Counter::ShiftReconnectedMedium => "shift_reconnected_medium",
            Counter::ShiftReconnectedInfinity => "shift_reconnected_infinity",
            Counter::ShiftFollowed => "shift_followed",
            Counter::ShiftSkipped => "shift_skipped",
            Counter::ShiftOutsideFilm => "shift_outside_film",
            Counter::ShiftEscaped => "shift_escaped",
            Counter::ShiftOccluded => "shift_occluded",
            Counter::ShiftLobeMismatch => "shift_lobe_mismatch",
            Counter::ShiftTotalReflection => "shift_total_reflection",
            Counter::ShiftIrreversible => "shift_irreversible",
            Counter::HalfVectorsCopied => "half_vectors_copied",
            Counter::StepsReplayed => "steps_replayed",
            Counter::NotFinitePrimal => "not_finite_primal",
            Counter::NotFiniteDirect => "not_finite_direct",
            Counter::NotFiniteGradient => "not_finite_gradient",
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

    /// Contributions that were replaced by zero because they were not finite.
    pub fn not_finite(&self) -> u64 {
        Counter::NOT_FINITE.into_iter().map(|counter| self.get(counter)).sum()
    }

    /// All of them by name.
    pub fn by_name(&self) -> BTreeMap<String, u64> {
        Counter::ALL.into_iter().map(|counter| (counter.name().to_owned(), self.get(counter))).collect()
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
