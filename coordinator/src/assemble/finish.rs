//! Reconstructs a stitched frame and writes its files, off the async threads.

use std::io::Cursor;
use std::time::Instant;

use bytes::Bytes;
use gradfarm_core::film::{Film, Statistics};
use gradfarm_core::lattice::Tile;
use gradfarm_core::output::{self, exr, png};
use gradfarm_core::reconstruction::{Reconstructed, reconstruct};

use super::counted::FrameStatistics;
use super::stitch::Stitched;
use super::{AssembleError, Task};
use crate::job::{Assembled, FileKind, FileRecord, JobRecord, Seconds};
use crate::store::Blobs;

/// A reconstructed frame as files.
struct Written {
    files: Vec<(FileKind, Bytes)>,
    reconstruct: f64,
    write: f64,
    estimated_relmse: Option<f64>,
    film: Film,
}

/// Reconstructs, writes, and stores the files.
pub(super) async fn finish(task: Task, stitched: Stitched, blobs: &Blobs) -> Result<Assembled, AssembleError> {
    let Stitched { film, tiles, seconds: stitch } = stitched;
    let written = tokio::task::spawn_blocking(move || work(&task, film, &tiles)).await??;
    let start = Instant::now();
    let mut files = Vec::with_capacity(written.files.len());
    for (kind, bytes) in written.files {
        let size = bytes.len() as u64;
        files.push(FileRecord { kind, blob: blobs.put(bytes).await?, size });
    }
    let write = written.write + start.elapsed().as_secs_f64();
    Ok(Assembled {
        files,
        seconds: Seconds { stitch, reconstruct: written.reconstruct, write, ..Seconds::default() },
        estimated_relmse: written.estimated_relmse,
        statistics: written.film.statistics,
    })
}

fn work(task: &Task, film: Film, tiles: &[(Tile, Statistics)]) -> Result<Written, AssembleError> {
    let record = &task.record;
    let start = Instant::now();
    let reconstructed = reconstruct(&film, record.plan.reconstruction, record.plan.alpha)?;
    let reconstruct = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let (exr, png) = rayon::join(|| encode_exr(record, &film, &reconstructed), || png::encode(&reconstructed.image, 1.0));
    let counted = FrameStatistics::of(record.first_frame + task.position, &film.statistics, tiles, reconstructed.error.as_ref());
    let counted = serde_json::to_vec(&counted).map_err(AssembleError::Statistics)?;
    let files = vec![(FileKind::Exr, exr?.into()), (FileKind::Png, png?.into()), (FileKind::Statistics, counted.into())];
    Ok(Written {
        files,
        reconstruct,
        write: start.elapsed().as_secs_f64(),
        estimated_relmse: reconstructed.error.map(|error| error.relmse),
        film,
    })
}

fn encode_exr(record: &JobRecord, film: &Film, reconstructed: &Reconstructed) -> Result<Vec<u8>, output::Error> {
    let both = film.combined();
    let mut named = vec![("primal", &reconstructed.primal)];
    if let Some(gradients) = &both.gradients {
        named.extend([("dx", &gradients.dx), ("dy", &gradients.dy)]);
    }
    named.push(("variance", &both.primal_variance));
    named.extend(reconstructed.error.as_ref().map(|error| ("error", &error.squared)));
    let features = &film.features;
    named.extend(film.counts.as_ref().map(|counts| ("samples", counts)));
    named.extend([("albedo", &features.albedo), ("normal", &features.normal), ("depth", &features.depth)]);
    let metadata = exr::Metadata {
        job: record.id.to_string(),
        seed: record.plan.seed,
        technique: record.plan.technique.name().to_owned(),
        reconstruction: record.plan.reconstruction.name().to_owned(),
        samples: record.plan.samples,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let mut out = Cursor::new(Vec::new());
    exr::write(&mut out, &exr::Layers { image: &reconstructed.image, named }, &metadata)?;
    Ok(out.into_inner())
}
