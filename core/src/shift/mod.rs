//! Shifts of base paths to neighbouring pixels.
//!
//! `chain` is the walk that they share, `reconnection`, `half_vector` and `replay` are local rules, and a shift says which of them holds where.

mod chain;
mod half_vector;
mod hybrid;
mod reconnection;
mod replay;
mod replay_reconnection;

pub use half_vector::half_vector;
pub use hybrid::{Chance, HybridShift};
pub use reconnection::{ReconnectionShift, reconnect};
pub use replay::ReplayShift;
pub use replay_reconnection::ReplayReconnectionShift;

use crate::path::ShiftMap;

/// The shift by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShiftKind {
    /// Reconnection at the first chance, half-vector copy until then (Kettunen et al. 2015).
    Hybrid,
    /// Reconnection at the first vertex, or none.
    Reconnection,
    /// Random replay from end to end.
    Replay,
    /// Random replay until the paths are rough and far enough to reconnect (after Lin et al. 2022).
    ReplayReconnection,
    /// As hybrid, with a chance that each path has by itself: such shifts compose, so that many pixels can share one path.
    Composable,
}

impl ShiftKind {
    /// Every shift.
    pub const ALL: [ShiftKind; 5] =
        [ShiftKind::Hybrid, ShiftKind::Reconnection, ShiftKind::Replay, ShiftKind::ReplayReconnection, ShiftKind::Composable];

    /// Its name on the command line and on the wire.
    pub fn name(self) -> &'static str {
        match self {
            ShiftKind::Hybrid => "hybrid",
            ShiftKind::Reconnection => "reconnection",
            ShiftKind::Replay => "replay",
            ShiftKind::ReplayReconnection => "replay-reconnection",
            ShiftKind::Composable => "composable",
        }
    }

    /// Roughness at and above which a vertex is connectable, where nothing else is asked.
    pub fn threshold(self) -> f32 {
        match self {
            // The published experiments of Kettunen et al. 2015.
            ShiftKind::Hybrid | ShiftKind::Reconnection | ShiftKind::Replay | ShiftKind::Composable => 0.001,
            // Below the 0.2 of Lin et al. 2022: never worse here, and twice as good where floors are glossy.
            ShiftKind::ReplayReconnection => 0.05,
        }
    }

    /// Whether offset paths take the base path's random numbers until they join it, instead of its half vectors.
    pub fn replays(self) -> bool {
        matches!(self, ShiftKind::Replay | ShiftKind::ReplayReconnection)
    }

    /// Whether shifts compose: from i to k and on to m leads where i to m does. Weights over more than two pixels need that.
    pub fn composes(self) -> bool {
        self == ShiftKind::Composable
    }
}

/// Length over displacement from which edges are joined.
const STRETCH: f32 = 2.0;

/// The registry: one line each.
pub fn build(kind: ShiftKind, threshold: f32) -> Box<dyn ShiftMap> {
    match kind {
        ShiftKind::Hybrid => Box::new(HybridShift { threshold, chance: Chance::Common }),
        ShiftKind::Reconnection => Box::new(ReconnectionShift { threshold }),
        ShiftKind::Replay => Box::new(ReplayShift { threshold }),
        ShiftKind::ReplayReconnection => Box::new(ReplayReconnectionShift { threshold, stretch: STRETCH }),
        ShiftKind::Composable => Box::new(HybridShift { threshold, chance: Chance::Own }),
    }
}

#[cfg(test)]
mod tests;
