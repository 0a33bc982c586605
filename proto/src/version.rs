//! Versions of the protocol, and how two peers agree on one.

use std::ops::RangeInclusive;

/// The versions that this build speaks.
pub const SPOKEN: RangeInclusive<u32> = 1..=1;

/// Two peers have no version in common.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the worker speaks protocol versions {peer_min} to {peer_max}, this coordinator {} to {}: bring both to one release", SPOKEN.start(), SPOKEN.end())]
pub struct VersionError {
    peer_min: u32,
    peer_max: u32,
}

/// The newest version that both sides speak.
///
/// # Errors
/// If the ranges do not meet.
pub fn agree(peer_min: u32, peer_max: u32) -> Result<u32, VersionError> {
    let newest = peer_max.min(*SPOKEN.end());
    if newest >= peer_min && SPOKEN.contains(&newest) { Ok(newest) } else { Err(VersionError { peer_min, peer_max }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_meet_at_the_newest() {
        assert_eq!(agree(1, 1), Ok(1));
        assert_eq!(agree(0, 7), Ok(1));
        assert!(agree(2, 7).is_err());
        assert!(agree(0, 0).is_err());
        assert!(agree(3, 1).is_err());
    }
}
