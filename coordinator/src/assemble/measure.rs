//! Reconstructs a frame and says how good the image is, off the async threads.

use std::time::Instant;

use gradfarm_core::accuracy::{Estimate, Verdict, verdict};
use gradfarm_core::reconstruction::{Reconstructed, reconstruct};

use super::stitch::{Stitched, stitch};
use super::{AssembleError, Task};
use crate::clock::Timestamp;
use crate::job::{JobId, Measured};
use crate::oidn;
use crate::store::{Blobs, Store};

/// An image with what it took.
#[derive(Debug)]
pub(super) struct Solved {
    /// The image.
    pub(super) reconstructed: Reconstructed,
    /// Reconstruction [s].
    pub(super) seconds: f64,
}

/// A reconstructed frame whose files are not made.
#[derive(Debug)]
pub(super) struct Ready {
    pub(super) job: JobId,
    pub(super) position: u32,
    pub(super) passes: u32,
    pub(super) stitched: Stitched,
    pub(super) image: Solved,
}

impl Ready {
    /// Whether it is what this task needs.
    pub(super) fn is_of(&self, task: &Task) -> bool {
        (self.job, self.position, self.passes) == (task.record.id, task.position, task.passes) && task.left_out.is_empty()
    }
}

/// Adds a frame's passes up and reconstructs it.
pub(super) async fn reconstructed(task: &Task, store: &dyn Store, blobs: &Blobs) -> Result<(Stitched, Solved), AssembleError> {
    let stitched = stitch(task, store, blobs).await?;
    let (kind, alpha, clamp) = (task.record.plan.reconstruction, task.record.plan.alpha, task.record.plan.clamp);
    let solve = move || {
        oidn::check(kind).map_err(AssembleError::Denoiser)?;
        let start = Instant::now();
        let mut reconstructed = reconstruct(&stitched.film, kind, alpha)?;
        if clamp {
            reconstructed.clamp();
        }
        Ok((stitched, Solved { reconstructed, seconds: start.elapsed().as_secs_f64() }))
    };
    tokio::task::spawn_blocking(solve).await?
}

/// How far an estimate may be off where the frame is too small to tell, as a factor.
const UNKNOWN: f64 = 4.0;

/// The image's error, where its halves can tell.
pub(super) fn error(image: &Solved) -> Option<Estimate> {
    let error = image.reconstructed.error.as_ref()?;
    let relmse = error.relmse;
    let [low, high] = error.interval.unwrap_or([relmse / UNKNOWN, relmse * UNKNOWN]);
    Some(Estimate { relmse, low, high })
}

/// What the job is told.
pub(super) fn measured(task: &Task, stitched: &Stitched, image: &Solved) -> Measured {
    Measured { samples: task.frame.goal, error: error(image), seconds: stitched.seconds + image.seconds }
}

/// Whether the job will stop here, as far as one can tell before it has decided.
pub(super) fn seems_good_enough(task: &Task, measured: &Measured, now: Timestamp) -> bool {
    let (plan, frame) = (&task.record.plan, &task.frame);
    let Some(error) = measured.error else { return frame.goal >= plan.samples };
    let mut points = frame.points.clone();
    points.push(frame.point(error, measured.seconds, now));
    matches!(verdict(&plan.stop, plan.samples, plan.batch, &points), Verdict::Stop(_))
}
