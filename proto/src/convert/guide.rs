//! The guided samples of a tile's pixels.

use gradfarm_core::lattice::{SampleRange, Tile};
use gradfarm_core::plan::TileGuide;

use super::ConvertError;
use crate::{limits, v1};

impl From<&TileGuide> for v1::TileGuide {
    fn from(guide: &TileGuide) -> Self {
        let [a, b] = &guide.halves;
        let first = |runs: &[SampleRange]| runs.iter().map(|run| run.first).collect();
        let count = |runs: &[SampleRange]| runs.iter().map(|run| run.count).collect();
        Self { first_a: first(a), count_a: count(a), first_b: first(b), count_b: count(b) }
    }
}

/// The guide of a tile from its message.
///
/// # Errors
/// If a list has another length than the tile has pixels, or samples lie beyond the largest index.
pub fn tile_guide(message: v1::TileGuide, tile: Tile) -> Result<TileGuide, ConvertError> {
    let v1::TileGuide { first_a, count_a, first_b, count_b } = message;
    Ok(TileGuide { halves: [runs(&first_a, &count_a, tile)?, runs(&first_b, &count_b, tile)?] })
}

fn runs(first: &[u32], count: &[u32], tile: Tile) -> Result<Vec<SampleRange>, ConvertError> {
    if first.len() != tile.pixels() || count.len() != tile.pixels() {
        let found = format!("{} and {} entries", first.len(), count.len());
        return Err(ConvertError::range("lease.guide", found, format!("one for each of the {} pixels", tile.pixels())));
    }
    let run = |(first, count): (&u32, &u32)| match first.checked_add(*count) {
        Some(end) if end <= limits::SAMPLES => Ok(SampleRange { first: *first, count: *count }),
        _ => Err(ConvertError::range("lease.guide", format!("{count} from {first}"), format!("samples below {}", limits::SAMPLES))),
    };
    first.iter().zip(count).map(run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn round_trip(runs in prop::collection::vec((0u32..1 << 20, 0u32..1000), 12)) {
            let tile = Tile { x: 3, y: 1, width: 4, height: 3 };
            let a: Vec<SampleRange> = runs.iter().map(|(first, count)| SampleRange { first: *first, count: *count }).collect();
            let b = a.iter().rev().copied().collect();
            let guide = TileGuide { halves: [a, b] };
            prop_assert_eq!(tile_guide((&guide).into(), tile), Ok(guide));
        }

        #[test]
        fn anything_may_be_sent(first in prop::collection::vec(any::<u32>(), 0..5), count in prop::collection::vec(any::<u32>(), 0..5)) {
            let tile = Tile { x: 0, y: 0, width: 2, height: 2 };
            let message = v1::TileGuide { first_a: first.clone(), count_a: count.clone(), first_b: first, count_b: count };
            if let Ok(guide) = tile_guide(message, tile) {
                for run in guide.halves.iter().flatten() {
                    prop_assert!(run.end() <= limits::SAMPLES);
                }
            }
        }
    }
}
