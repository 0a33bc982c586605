//! Reconstructs a frame from the passes that every tile has, for people who look while it is made.

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;

use super::{AssembleError, Task, measure};
use crate::job::Job;
use crate::schedule::Place;
use crate::store::{Blobs, Store};

/// A frame as far as it is.
#[derive(Clone, Debug)]
pub(crate) struct SoFar(Task);

impl SoFar {
    /// The frame at a position of a job.
    pub(crate) fn of(job: &Job, position: u32) -> Self {
        Self(Task::new(job, position))
    }

    /// Its size [pixels].
    pub(crate) fn extent(&self) -> Extent {
        self.0.record.plan.extent
    }

    /// Its size [pixels].
    pub(crate) fn pixels(&self) -> usize {
        self.extent().pixels()
    }

    /// The image that whole passes make by themselves; `None` where they make none yet. Windows are left out: what they add is seen at the end.
    pub(crate) async fn reconstruct(self, store: &dyn Store, blobs: &Blobs) -> Option<Image> {
        let (job, position) = (self.0.record.id, self.0.position);
        // What cannot be read will fail the frame, and be told there; too few samples for two halves are no fault.
        let told = |fault: &AssembleError| tracing::debug!(%job, position, %fault, "no reconstruction for a preview");
        self.attempt(store, blobs).await.inspect_err(told).ok().flatten()
    }

    async fn attempt(mut self, store: &dyn Store, blobs: &Blobs) -> Result<Option<Image>, AssembleError> {
        let Task { split, position, record, .. } = &self.0;
        let first = split.units_per_frame() * position;
        let results = store.results(record.id, first..first + split.units_per_frame()).await?;
        let there = |pass: u32, tile: u32| {
            let unit = split.unit(Place { frame: *position, pass, tile });
            results.binary_search_by_key(&unit, |(unit, _)| *unit).is_ok()
        };
        let passes = (0..split.passes().len() as u32).take_while(|pass| (0..split.units_per_pass()).all(|tile| there(*pass, tile))).count();
        if passes == 0 {
            return Ok(None);
        }
        self.0.passes = passes as u32;
        let (_, solved) = measure::reconstructed(&self.0, store, blobs).await?;
        Ok(Some(solved.reconstructed.image))
    }
}
