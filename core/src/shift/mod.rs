//! Shifts of base paths to neighbouring pixels: `reconnection` and `half_vector` are the local rules, `hybrid` picks one at each vertex.

mod half_vector;
mod hybrid;
mod reconnection;

pub use half_vector::half_vector;
pub use hybrid::HybridShift;
pub use reconnection::reconnect;

use crate::path::ShiftMap;

/// The shift by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShiftKind {
    /// Reconnection at the first chance, half-vector copy until then (Kettunen et al. 2015).
    Hybrid,
}

impl ShiftKind {
    /// Every shift.
    pub const ALL: [ShiftKind; 1] = [ShiftKind::Hybrid];

    /// Its name on the command line and on the wire.
    pub fn name(self) -> &'static str {
        match self {
            ShiftKind::Hybrid => "hybrid",
        }
    }

    /// Roughness at and above which a vertex is connectable, where nothing else is asked.
    pub fn threshold(self) -> f32 {
        match self {
            // The published experiments of Kettunen et al. 2015.
            ShiftKind::Hybrid => 0.001,
        }
    }

    /// Whether offset paths take the base path's random numbers until they join it, instead of its half vectors.
    pub fn replays(self) -> bool {
        match self {
            ShiftKind::Hybrid => false,
        }
    }
}

/// The registry: one line each.
pub fn build(kind: ShiftKind, threshold: f32) -> Box<dyn ShiftMap> {
    match kind {
        ShiftKind::Hybrid => Box::new(HybridShift { threshold }),
    }
}

#[cfg(test)]
mod tests;
