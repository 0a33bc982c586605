//! Reconstructs a stitched frame, off the async threads.

use std::time::Instant;

use gradfarm_core::reconstruction::reconstruct;

use super::stitch::Stitched;
use super::{AssembleError, Task};
use crate::job::{Assembled, Seconds};

/// Reconstructs.
pub(super) async fn finish(task: Task, stitched: Stitched) -> Result<Assembled, AssembleError> {
    let start = Instant::now();
    let plan = task.record.plan.clone();
    let Stitched { film, seconds: stitch } = stitched;
    let (film, reconstructed) = tokio::task::spawn_blocking(move || {
        let reconstructed = reconstruct(&film, plan.reconstruction, plan.alpha)?;
        Ok::<_, AssembleError>((film, reconstructed))
    })
    .await??;
    let reconstruct_seconds = start.elapsed().as_secs_f64();
    Ok(Assembled {
        files: Vec::new(),
        seconds: Seconds { stitch, reconstruct: reconstruct_seconds, ..Seconds::default() },
        estimated_relmse: reconstructed.estimated_relmse,
        statistics: film.statistics,
    })
}
