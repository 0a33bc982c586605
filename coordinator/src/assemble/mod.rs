//! Makes frames of results: adds the blocks up in their fixed order, reconstructs, writes the files.
//!
//! The order is that of the unit numbers, whenever the blocks arrived: so a frame has the same bits whoever rendered what.

mod counted;
mod finish;
mod stitch;

use std::sync::Arc;

use tokio::sync::{Semaphore, mpsc};

use crate::job::{Assembled, Job, JobRecord};
use crate::schedule::Split;
use crate::service::command::Command;
use crate::store::{BlobError, Blobs, Store, StoreError};

/// Assembles frames beside the loop, one after the other: each one uses all cores and a frame's memory.
#[derive(Clone, Debug)]
pub(crate) struct Workshop {
    /// Weak, so that frames in the making do not keep a stopped service alive.
    commands: mpsc::WeakSender<Command>,
    store: Arc<dyn Store>,
    blobs: Blobs,
    bench: Arc<Semaphore>,
}

/// What is assembled.
#[derive(Clone, Debug)]
struct Task {
    record: JobRecord,
    split: Split,
    /// Position of the frame.
    position: u32,
}

/// Why a frame could not be assembled.
#[derive(Debug, thiserror::Error)]
enum AssembleError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Blob(#[from] BlobError),
    #[error("unit {unit} has no result")]
    Absent { unit: u32 },
    #[error("result of unit {unit}: {source}")]
    Block { unit: u32, source: gradfarm_proto::block::DecodeBlockError },
    #[error(transparent)]
    Fold(#[from] gradfarm_core::film::FoldError),
    #[error(transparent)]
    Reconstruct(#[from] gradfarm_core::reconstruction::ReconstructError),
    #[error("writing: {0}")]
    Output(#[from] gradfarm_core::output::Error),
    #[error("writing the statistics: {0}")]
    Statistics(serde_json::Error),
    #[error("the computation broke off: {0}")]
    Panicked(#[from] tokio::task::JoinError),
}

impl Workshop {
    /// A workshop that reports to the loop behind `commands`.
    pub(crate) fn new(commands: mpsc::WeakSender<Command>, store: Arc<dyn Store>, blobs: Blobs) -> Self {
        Self { commands, store, blobs, bench: Arc::new(Semaphore::new(1)) }
    }

    /// Takes a frame in, whose results are all there.
    pub(crate) fn take(&self, job: &Job, position: u32) {
        let task = Task { record: job.record.clone(), split: job.split.clone(), position };
        let shop = self.clone();
        tokio::spawn(async move {
            let Ok(_bench) = shop.bench.acquire().await else { return };
            let id = task.record.id;
            let outcome = shop.assemble(task).await.map_err(|error| error.to_string());
            if let Some(commands) = shop.commands.upgrade() {
                // If the loop is gone, the next one finds the frame waiting.
                let _stopped = commands.send(Command::Assembled { job: id, frame: position, outcome }).await;
            }
        });
    }

    async fn assemble(&self, task: Task) -> Result<Assembled, AssembleError> {
        let stitched = stitch::stitch(&task, self.store.as_ref(), &self.blobs).await?;
        finish::finish(task, stitched, &self.blobs).await
    }
}
