//! Makes frames of results: adds the blocks up in their fixed order, reconstructs, writes the files. On the way it makes the guides of
//! frames in rounds, from what is there of them, and says how good frames are that may stop early; and it solves windows of moments that are
//! reconstructed together.
//!
//! The order is that of the unit numbers, whenever the blocks arrived: so a frame has the same bits whoever rendered what.

mod counted;
mod finish;
mod measure;
mod so_far;
mod stitch;
mod window;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use gradfarm_core::plan::Guide;
use tokio::sync::{Semaphore, mpsc};

pub(crate) use so_far::SoFar;

use crate::clock::Clock;
use crate::job::{Assembled, Attempt, Errand, Frame, Job, JobId, JobRecord, Measured, ShareRecord, SolvedWindow};
use crate::metrics::Metrics;
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
    clock: Clock,
    /// The last measured frame, if it seems to be good enough: its files are then all that is left to do.
    measured: Arc<Mutex<Option<measure::Ready>>>,
    /// Moments of the window that was solved last which the next one has, too.
    films: Arc<Mutex<window::Films>>,
    metrics: Arc<Metrics>,
}

/// What is assembled.
#[derive(Clone, Debug)]
struct Task {
    record: JobRecord,
    split: Split,
    /// Position of the frame.
    position: u32,
    /// The frame as it is.
    frame: Frame,
    /// How many of its first passes make it.
    passes: u32,
    /// Units of it that were given up, with what was tried.
    left_out: BTreeMap<u32, Vec<Attempt>>,
    /// What windows say of it, from the first window to the last; empty where it is reconstructed by itself.
    shares: Vec<window::Part>,
}

impl Task {
    fn new(job: &Job, position: u32) -> Self {
        let frame = job.frames[position as usize].clone();
        let passes = job.split.passes_within(frame.goal);
        let part = |(share, solved): (ShareRecord, &SolvedWindow)| window::Part { share, report: solved.report };
        let left_out = job.given_up(position).map(|unit| (unit, job.attempts(unit).to_vec())).collect();
        let shares = job.shares(position).into_iter().map(part).collect();
        Self { record: job.record.clone(), split: job.split.clone(), position, frame, passes, left_out, shares }
    }
}

/// Why a frame could not be assembled.
#[derive(Debug, thiserror::Error)]
enum AssembleError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Blob(#[from] BlobError),
    #[error("nothing was added up")]
    Nothing,
    #[error("what window {place} over it says: {source}")]
    Share { place: usize, source: gradfarm_proto::block::DecodeBlockError },
    #[error("what window {place} over it says is no image of a moment")]
    NoShare { place: usize },
    #[error("compressing: {0}")]
    Compress(std::io::Error),
    #[error("the solve gave no finite residual")]
    Diverged,
    #[error("unit {unit} has no result")]
    Absent { unit: u32 },
    #[error("result of unit {unit}: {source}")]
    Block { unit: u32, source: gradfarm_proto::block::DecodeBlockError },
    #[error(transparent)]
    Fold(#[from] gradfarm_core::film::FoldError),
    #[error(transparent)]
    Reconstruct(#[from] gradfarm_core::reconstruction::ReconstructError),
    #[error("reconstruction `oidn`: {0}")]
    Denoiser(String),
    #[error("writing: {0}")]
    Output(#[from] gradfarm_core::output::Error),
    #[error("writing the statistics: {0}")]
    Statistics(serde_json::Error),
    #[error("the computation broke off: {0}")]
    Panicked(#[from] tokio::task::JoinError),
}

impl Workshop {
    /// A workshop that reports to the loop behind `commands`.
    pub(crate) fn new(commands: mpsc::WeakSender<Command>, store: Arc<dyn Store>, blobs: Blobs, metrics: Arc<Metrics>) -> Self {
        Self {
            commands,
            store,
            blobs,
            bench: Arc::new(Semaphore::new(1)),
            clock: Clock::new(),
            measured: Arc::default(),
            films: Arc::default(),
            metrics,
        }
    }

    /// Takes a frame in, whose results are all there, or enough of them for a guide.
    pub(crate) fn take(&self, job: &Job, errand: Errand) {
        let moments = match errand {
            Errand::Assemble { frame } | Errand::Measure { frame } | Errand::Guide { frame, .. } => frame..frame + 1,
            Errand::Release => return self.release(job.record.id),
            Errand::Window { window } => job.windows().map(|windows| windows.layout.moments(window)).unwrap_or_default(),
        };
        let before = job.guides(moments.start).to_vec();
        let layout = job.windows().map(|windows| windows.layout);
        let mut tasks: Vec<Task> = moments.map(|position| Task::new(job, position)).collect();
        let job = job.record.id;
        let shop = self.clone();
        tokio::spawn(async move {
            let Ok(_bench) = shop.bench.acquire().await else { return };
            let begun = Instant::now();
            if let (Errand::Window { window }, Some(layout)) = (errand, layout) {
                let outcome = window::solve(&tasks, layout, window, &shop).await.map_err(|error| error.to_string());
                shop.metrics.assembled("window", begun.elapsed());
                return shop.report(Command::Solved { job, window, outcome }).await;
            }
            let Some(task) = tasks.pop() else { return };
            let (what, done) = match errand {
                Errand::Window { .. } | Errand::Release => return,
                Errand::Assemble { frame } => {
                    let outcome = shop.assemble(task).await.map_err(|error| error.to_string());
                    ("frame", Command::Assembled { job, frame, outcome })
                }
                Errand::Measure { frame } => {
                    let outcome = shop.measure(task).await.map_err(|error| error.to_string());
                    ("measure", Command::Measured { job, frame, outcome })
                }
                Errand::Guide { frame, round } => {
                    let outcome = shop.guide(task, round, before).await.map(Arc::new).map_err(|error| error.to_string());
                    ("guide", Command::Guided { job, frame, round, outcome })
                }
            };
            shop.metrics.assembled(what, begun.elapsed());
            shop.report(done).await;
        });
    }

    /// Lets go of what windows of a job left for the next one, after what is being done now.
    fn release(&self, job: JobId) {
        let shop = self.clone();
        tokio::spawn(async move {
            if let Ok(_bench) = shop.bench.acquire().await {
                drop(shop.films(job));
            }
        });
    }

    async fn report(&self, done: Command) {
        if let Some(commands) = self.commands.upgrade() {
            // If the loop is gone, the next one finds the frame waiting.
            let _stopped = commands.send(done).await;
        }
    }

    /// The guide of a round: a pure function of the results that steer it, so after a crash it is simply made again.
    async fn guide(&self, task: Task, round: u32, before: Vec<Arc<Guide>>) -> Result<Guide, AssembleError> {
        let passes = (round as usize).checked_sub(1).and_then(|at| task.split.steering().get(at)).copied().unwrap_or(0);
        let steers = |pass| task.split.steers(pass, round);
        let (frames, _) = stitch::fold(&task, &[stitch::Part::Whole], passes, steers, self.store.as_ref(), &self.blobs).await?;
        let frame = frames.into_iter().next().ok_or(AssembleError::Nothing)?;
        let make = move || {
            let number = task.split.moments()[task.position as usize].first;
            Ok(Guide::new(&task.record.plan, number, round, &frame.noise()?, &before))
        };
        tokio::task::spawn_blocking(make).await?
    }

    async fn assemble(&self, task: Task) -> Result<Assembled, AssembleError> {
        if !task.shares.is_empty() {
            let (stitched, image) = window::frame(&task, self).await?;
            return finish::finish(task, stitched, image, &self.blobs).await;
        }
        let ready = self.ready(None).filter(|ready| ready.is_of(&task));
        let (stitched, image) = match ready {
            Some(ready) => (ready.stitched, ready.image),
            None => measure::reconstructed(&task, self.store.as_ref(), &self.blobs).await?,
        };
        finish::finish(task, stitched, image, &self.blobs).await
    }

    /// Reconstructs a frame as it is, and says how good it is.
    async fn measure(&self, task: Task) -> Result<Measured, AssembleError> {
        // Room for the new one.
        self.ready(None);
        let (stitched, image) = measure::reconstructed(&task, self.store.as_ref(), &self.blobs).await?;
        let measured = measure::measured(&task, &stitched, &image);
        if measure::seems_good_enough(&task, &measured, self.clock.now()) {
            self.ready(Some(measure::Ready { job: task.record.id, position: task.position, passes: task.passes, stitched, image }));
        }
        Ok(measured)
    }

    /// Takes out the frame that was kept, and keeps another one.
    fn ready(&self, next: Option<measure::Ready>) -> Option<measure::Ready> {
        std::mem::replace(&mut *self.measured.lock().unwrap_or_else(PoisonError::into_inner), next)
    }
}
