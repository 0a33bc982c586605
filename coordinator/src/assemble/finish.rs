//! Writes the files of a reconstructed frame, off the async threads.

use std::io::Cursor;
use std::time::Instant;

use bytes::Bytes;
use gradfarm_core::film::{Film, Statistics};
use gradfarm_core::lattice::Tile;
use gradfarm_core::output::{self, exr, png};
use gradfarm_core::reconstruction::Reconstructed;

use super::counted::FrameStatistics;
use super::measure::{self, Solved};
use super::stitch::Stitched;
use super::{AssembleError, Task};
use crate::job::{Assembled, FileKind, FileRecord, Seconds};
use crate::store::Blobs;

/// Writes and stores the files.
pub(super) async fn finish(task: Task, stitched: Stitched, image: Solved, blobs: &Blobs) -> Result<Assembled, AssembleError> {
    let Stitched { film, tiles, seconds: stitch } = stitched;
    let (reconstruct, error, statistics) = (image.seconds, measure::error(&image), film.statistics);
    let choice = image.reconstructed.why.clone();
    let (start, units) = (Instant::now(), task.frame.units);
    let encoded = tokio::task::spawn_blocking(move || encode(&task, &film, &tiles, &image.reconstructed)).await??;
    let mut files = Vec::with_capacity(encoded.len());
    for (kind, bytes) in encoded {
        let size = bytes.len() as u64;
        files.push(FileRecord { kind, blob: blobs.put(bytes).await?, size });
    }
    let write = start.elapsed().as_secs_f64();
    Ok(Assembled { files, units, seconds: Seconds { stitch, reconstruct, write, ..Seconds::default() }, error, choice, statistics })
}

fn encode(
    task: &Task,
    film: &Film,
    tiles: &[(Tile, Statistics)],
    reconstructed: &Reconstructed,
) -> Result<Vec<(FileKind, Bytes)>, AssembleError> {
    let (exr, png) = rayon::join(|| encode_exr(task, film, reconstructed), || png::encode(&reconstructed.image, 1.0));
    let counted = {
        let number = task.split.moments()[task.position as usize].first;
        FrameStatistics::of(number, &film.statistics, tiles, reconstructed).lacking(&task.split, &task.left_out)
    };
    let counted = serde_json::to_vec(&counted).map_err(AssembleError::Statistics)?;
    Ok(vec![(FileKind::Exr, exr?.into()), (FileKind::Png, png?.into()), (FileKind::Statistics, counted.into())])
}

fn encode_exr(task: &Task, film: &Film, reconstructed: &Reconstructed) -> Result<Vec<u8>, output::Error> {
    let record = &task.record;
    let both = film.combined();
    let mut named = vec![("primal", &reconstructed.primal)];
    if let Some(gradients) = &both.gradients {
        named.extend([("dx", &gradients.dx), ("dy", &gradients.dy)]);
    }
    named.push(("variance", &both.primal_variance));
    if let Some(gradients) = &both.gradients {
        // What it takes to reconstruct this very film again.
        named.extend([("variance-dx", &gradients.dx_variance), ("variance-dy", &gradients.dy_variance), ("direct", &both.direct)]);
    }
    named.extend(reconstructed.error.as_ref().map(|error| ("error", &error.squared)));
    let features = &film.features;
    named.extend(film.counts.as_ref().map(|counts| ("samples", counts)));
    named.extend([("albedo", &features.albedo), ("normal", &features.normal), ("depth", &features.depth)]);
    let metadata = exr::Metadata {
        job: record.id.to_string(),
        seed: record.plan.seed,
        technique: record.plan.technique.name().to_owned(),
        reconstruction: reconstructed.kind.name().to_owned(),
        choice: reconstructed.why.clone(),
        samples: task.frame.goal,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let mut out = Cursor::new(Vec::new());
    exr::write(&mut out, &exr::Layers { image: &reconstructed.image, named }, &metadata)?;
    Ok(out.into_inner())
}
