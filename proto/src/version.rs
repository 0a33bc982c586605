//! Versions of the protocol, and how two peers agree on one.

use std::ops::RangeInclusive;

/// The newest version that this build speaks.
///
/// 1: the first one.
pub const CURRENT: u32 = 1;

/// The versions that this build speaks: the newest one and the one before, so that a farm can be brought to a new release one machine at a
/// time.
pub const SPOKEN: RangeInclusive<u32> = spoken(CURRENT);

const fn spoken(current: u32) -> RangeInclusive<u32> {
    (if current > 1 { current - 1 } else { 1 })..=current
}

/// Two peers have no version in common.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the worker speaks protocol versions {peer_min} to {peer_max}, this coordinator {own_min} to {own_max}: bring both to one release")]
pub struct VersionError {
    peer_min: u32,
    peer_max: u32,
    own_min: u32,
    own_max: u32,
}

/// The newest version that both sides speak.
///
/// # Errors
/// If the ranges do not meet; the error names both.
pub fn agree(peer_min: u32, peer_max: u32) -> Result<u32, VersionError> {
    meet(&SPOKEN, peer_min, peer_max)
}

fn meet(own: &RangeInclusive<u32>, peer_min: u32, peer_max: u32) -> Result<u32, VersionError> {
    let newest = peer_max.min(*own.end());
    if newest >= peer_min && own.contains(&newest) {
        return Ok(newest);
    }
    Err(VersionError { peer_min, peer_max, own_min: *own.start(), own_max: *own.end() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_meet_at_the_newest() {
        assert_eq!(agree(1, CURRENT), Ok(CURRENT));
        assert_eq!(agree(0, CURRENT + 7), Ok(CURRENT));
        assert!(agree(CURRENT + 1, CURRENT + 7).is_err());
        assert!(agree(0, 0).is_err());
        assert!(agree(CURRENT + 3, CURRENT).is_err());
    }

    #[test]
    fn one_release_apart_is_understood_and_two_are_not() {
        for current in 2..6 {
            let own = spoken(current);
            for (peer, agreed) in [(current, Some(current)), (current - 1, Some(current - 1)), (current + 1, Some(current))] {
                let theirs = spoken(peer);
                assert_eq!(meet(&own, *theirs.start(), *theirs.end()).ok(), agreed, "{current} and {peer}");
            }
            for peer in [current + 2, current + 9].into_iter().chain((current > 3).then(|| current - 2)) {
                let theirs = spoken(peer);
                let told = meet(&own, *theirs.start(), *theirs.end()).unwrap_err().to_string();
                assert!(
                    told.contains(&format!("{} to {peer}", peer - 1)) && told.contains(&format!("{} to {current}", current - 1)),
                    "{told}"
                );
            }
        }
    }
}
