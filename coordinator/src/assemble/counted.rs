//! The statistics file of a frame: what was counted while it was traced and how far the image may be from the truth, tile by tile.

use std::collections::BTreeMap;

use gradfarm_core::film::Statistics;
use gradfarm_core::lattice::Tile;
use gradfarm_core::reconstruction::{Reconstructed, SolveReport};
use serde::Serialize;

use crate::job::Attempt;
use crate::schedule::Split;

/// The file.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FrameStatistics {
    /// Frame number.
    frame: u32,
    /// Counters summed over the frame, by name.
    counters: BTreeMap<String, u64>,
    /// How the image was solved for.
    reconstruction: Solve,
    /// Estimated relMSE of the finished image.
    #[serde(skip_serializing_if = "Option::is_none")]
    relmse: Option<f64>,
    /// Units that were given up: the image is made without them, and continues what lies around where a pixel has none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    failed: Vec<Failed>,
    /// The same for each tile, row by row.
    tiles: Vec<TileStatistics>,
}

/// A unit that was given up.
#[derive(Clone, Debug, Serialize)]
struct Failed {
    /// First column and row of its tile [pixels].
    x: u32,
    y: u32,
    /// First sample of each pixel, and how many.
    first_sample: u32,
    samples: u32,
    /// What was tried, in order.
    attempts: Vec<Tried>,
}

/// An attempt that came to nothing.
#[derive(Clone, Debug, Serialize)]
struct Tried {
    worker: String,
    /// When it ended [ms since 1970].
    at_ms: i64,
    ending: &'static str,
    reason: String,
}

/// How a solve went.
#[derive(Clone, Debug, Serialize)]
struct Solve {
    /// Weight of the primal that was taken.
    alpha: f32,
    /// Linear iterations; 0 for direct solves.
    iterations: u32,
    /// Relative residual.
    residual: f64,
}

/// What was counted in a tile.
#[derive(Clone, Debug, Serialize)]
struct TileStatistics {
    /// First column and row [pixels].
    x: u32,
    y: u32,
    /// Size [pixels].
    width: u32,
    height: u32,
    /// Estimated relMSE of the finished image on this tile; a small one may be told below zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    relmse: Option<f64>,
    /// Counters by name; those that are zero are left out.
    counters: BTreeMap<String, u64>,
}

impl FrameStatistics {
    /// What a frame and its tiles counted.
    pub(super) fn of(frame: u32, all: &Statistics, tiles: &[(Tile, Statistics)], image: &Reconstructed) -> Self {
        let error = image.error.as_ref();
        let SolveReport { alpha, iterations, residual } = image.report;
        let tile = |(tile, statistics): &(Tile, Statistics)| {
            let mut counters = statistics.by_name();
            counters.retain(|_, count| *count > 0);
            let relmse = error.map(|error| error.of_tile(*tile));
            TileStatistics { x: tile.x, y: tile.y, width: tile.width, height: tile.height, relmse, counters }
        };
        let relmse = error.map(|error| error.relmse);
        let reconstruction = Solve { alpha, iterations, residual };
        Self { frame, counters: all.by_name(), reconstruction, relmse, failed: Vec::new(), tiles: tiles.iter().map(tile).collect() }
    }
}

impl FrameStatistics {
    /// The same with what is missing.
    pub(super) fn lacking(mut self, split: &Split, left_out: &BTreeMap<u32, Vec<Attempt>>) -> Self {
        let tried = |attempt: &Attempt| Tried {
            worker: attempt.worker.to_string(),
            at_ms: attempt.at.millis(),
            ending: attempt.ending.name(),
            reason: attempt.reason.clone(),
        };
        let failed = |(unit, attempts): (&u32, &Vec<Attempt>)| {
            let work = split.work(*unit);
            let (first_sample, samples) = (work.samples.first, work.samples.count);
            Failed { x: work.tile.x, y: work.tile.y, first_sample, samples, attempts: attempts.iter().map(tried).collect() }
        };
        self.failed = left_out.iter().map(failed).collect();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::film::{Counter, Image};
    use gradfarm_core::lattice::Extent;
    use gradfarm_core::reconstruction::ReconstructionKind;

    #[test]
    fn tiles_name_what_they_counted() {
        let mut statistics = Statistics::default();
        statistics.add(Counter::ShiftOccluded, 7);
        let tile = Tile { x: 8, y: 0, width: 8, height: 4 };
        let black = Image::new(Extent { width: 16, height: 4 }, 3);
        let report = SolveReport { alpha: 0.25, iterations: 7, residual: 0.5 };
        let (kind, why) = (ReconstructionKind::L2, None);
        let image = Reconstructed { image: black.clone(), primal: black, halves: None, error: None, report, kind, why };
        let told = serde_json::to_value(FrameStatistics::of(3, &statistics, &[(tile, statistics)], &image)).unwrap();
        assert_eq!((told["frame"].as_u64(), told["counters"]["shift_occluded"].as_u64()), (Some(3), Some(7)));
        assert_eq!(told["reconstruction"], serde_json::json!({"alpha": 0.25, "iterations": 7, "residual": 0.5}));
        assert_eq!(told["counters"]["samples"].as_u64(), Some(0));
        assert_eq!(told["tiles"][0], serde_json::json!({"x": 8, "y": 0, "width": 8, "height": 4, "counters": {"shift_occluded": 7}}));
    }
}
