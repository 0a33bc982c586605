//! Pieces of the film's lattice: extents, tiles and sample ranges.

use gradfarm_core::lattice::{Extent, SampleRange, Tile};

use super::ConvertError;
use crate::{limits, v1};

impl From<Extent> for v1::Extent {
    fn from(extent: Extent) -> Self {
        Self { width: extent.width, height: extent.height }
    }
}

impl TryFrom<v1::Extent> for Extent {
    type Error = ConvertError;

    fn try_from(message: v1::Extent) -> Result<Self, ConvertError> {
        let v1::Extent { width, height } = message;
        let edges = 1..=limits::EDGE;
        if !edges.contains(&width) || !edges.contains(&height) || u64::from(width) * u64::from(height) > limits::PIXELS {
            let expected = format!("edges of 1 to {} and at most {} pixels", limits::EDGE, limits::PIXELS);
            return Err(ConvertError::range("extent", format!("{width} × {height}"), expected));
        }
        Ok(Self { width, height })
    }
}

impl From<Tile> for v1::Tile {
    fn from(tile: Tile) -> Self {
        Self { x: tile.x, y: tile.y, width: tile.width, height: tile.height }
    }
}

impl TryFrom<v1::Tile> for Tile {
    type Error = ConvertError;

    fn try_from(message: v1::Tile) -> Result<Self, ConvertError> {
        let tile = Self { x: message.x, y: message.y, width: message.width, height: message.height };
        let whole = Extent { width: limits::EDGE, height: limits::EDGE };
        if !tile.lies_on(whole) || tile.pixels() as u64 > limits::PIXELS {
            return Err(ConvertError::range("tile", format!("{tile:?}"), format!("a tile within {} × {0} pixels", limits::EDGE)));
        }
        Ok(tile)
    }
}

impl From<SampleRange> for v1::SampleRange {
    fn from(range: SampleRange) -> Self {
        Self { first: range.first, count: range.count }
    }
}

impl TryFrom<v1::SampleRange> for SampleRange {
    type Error = ConvertError;

    fn try_from(message: v1::SampleRange) -> Result<Self, ConvertError> {
        let v1::SampleRange { first, count } = message;
        if count == 0 || first.checked_add(count).is_none_or(|end| end > limits::SAMPLES) {
            let expected = format!("at least one sample, ending at {} or before", limits::SAMPLES);
            return Err(ConvertError::range("samples", format!("{count} from {first}"), expected));
        }
        Ok(Self { first, count })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn round_trips(width in 1u32..16_384, height in 1u32..16_384, x in 0u32..100, first in 0u32..1000, count in 1u32..1000) {
            let extent = Extent { width, height };
            prop_assert_eq!(Extent::try_from(v1::Extent::from(extent)), Ok(extent));
            let tile = Tile { x, y: first, width, height };
            prop_assert_eq!(Tile::try_from(v1::Tile::from(tile)), Ok(tile));
            let range = SampleRange { first, count };
            prop_assert_eq!(SampleRange::try_from(v1::SampleRange::from(range)), Ok(range));
        }

        #[test]
        fn anything_may_be_sent(x: u32, y: u32, width: u32, height: u32) {
            if let Ok(tile) = Tile::try_from(v1::Tile { x, y, width, height }) {
                prop_assert!(tile.pixels() as u64 <= limits::PIXELS);
            }
            if let Ok(extent) = Extent::try_from(v1::Extent { width, height }) {
                prop_assert!(extent.pixels() as u64 <= limits::PIXELS);
            }
            if let Ok(range) = SampleRange::try_from(v1::SampleRange { first: x, count: y }) {
                prop_assert!(range.end() <= limits::SAMPLES);
            }
        }
    }
}
