//! What became of a shift, and of a value: counted by cause.

use crate::film::{Counter, Statistics};
use crate::path::{OffsetEnd, OffsetSubpath, ShiftFailure, Subpath};
use crate::shift::ShiftKind;
use crate::spectrum::Spectrum;

/// Counts the outcome of one shift, and the steps that were turned on the way to it.
pub(super) fn tell(kind: ShiftKind, base: &Subpath, offset: &OffsetSubpath, statistics: &mut Statistics) {
    statistics.add(outcome(base, offset), 1);
    let joined = matches!(offset.end, OffsetEnd::Rejoined { .. });
    let turned = offset.steps.len() - usize::from(joined);
    statistics.add(if kind.replays() { Counter::StepsReplayed } else { Counter::HalfVectorsCopied }, turned as u64);
}

fn outcome(base: &Subpath, offset: &OffsetSubpath) -> Counter {
    match offset.end {
        OffsetEnd::Rejoined { at } if base.vertices[at].medium().is_some() => Counter::ShiftReconnectedMedium,
        OffsetEnd::Rejoined { .. } => Counter::ShiftReconnectedSurface,
        // The base left the scene from a vertex where both can join: the offset takes the same direction.
        OffsetEnd::Followed { .. } if offset.steps.len() < base.steps.len() => Counter::ShiftReconnectedInfinity,
        OffsetEnd::Followed { .. } => Counter::ShiftFollowed,
        OffsetEnd::Failed { why, .. } => match why {
            ShiftFailure::Escaped => Counter::ShiftEscaped,
            ShiftFailure::Occluded => Counter::ShiftOccluded,
            ShiftFailure::LobeMismatch => Counter::ShiftLobeMismatch,
            ShiftFailure::TotalReflection => Counter::ShiftTotalReflection,
            ShiftFailure::Irreversible => Counter::ShiftIrreversible,
        },
    }
}

/// The value, or zero and a count where it is not finite.
#[inline]
pub(super) fn finite(value: Spectrum, cause: Counter, statistics: &mut Statistics) -> Spectrum {
    if value.is_finite() {
        value
    } else {
        statistics.add(cause, 1);
        Spectrum::BLACK
    }
}
