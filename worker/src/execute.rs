//! The rendering threads: each takes one unit at a time, renders it, encodes the block, and says how it went. A unit that panics fails
//! alone.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use gradfarm_core::plan::{Plan, TileGuide, WorkUnit};
use gradfarm_core::render::{Watch, render_watched};
use gradfarm_core::scene::Exposure;
use gradfarm_proto::block::{self, EncodedBlock};
use gradfarm_proto::convert::LeaseName;
use tokio::sync::mpsc::UnboundedSender;

use crate::error::Error;
use crate::metrics::Metrics;

/// A unit with all it needs.
#[derive(Clone)]
pub(crate) struct Task {
    pub(crate) lease: LeaseName,
    pub(crate) unit: WorkUnit,
    pub(crate) guide: Option<Arc<TileGuide>>,
    pub(crate) plan: Arc<Plan>,
    pub(crate) exposure: Arc<Exposure>,
    /// Who is told what becomes of it.
    pub(crate) reports: UnboundedSender<Report>,
    pub(crate) watch: Arc<Watch>,
}

/// What a rendering thread reports.
#[derive(Debug)]
pub(crate) enum Report {
    /// It took the unit up.
    Started { lease: LeaseName },
    /// It is through with it.
    Finished { lease: LeaseName, outcome: Result<EncodedBlock, String>, render_seconds: f64 },
}

/// The threads and their queue, shared by all who hand them units.
#[derive(Clone)]
pub(crate) struct Pool {
    shared: Arc<Shared>,
    /// Closes the queue when nobody can hand in units any more.
    _open: Arc<Open>,
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

#[derive(Default)]
struct Queue {
    tasks: VecDeque<Task>,
    closed: bool,
}

impl Pool {
    /// Starts the threads; they work until every copy of the pool is dropped.
    ///
    /// # Errors
    /// If the system gives no more threads.
    pub(crate) fn start(threads: usize, metrics: Arc<Metrics>) -> Result<Self, Error> {
        let shared = Arc::<Shared>::default();
        let pool = Self { shared: shared.clone(), _open: Arc::new(Open(shared.clone())) };
        for k in 0..threads {
            let (shared, metrics) = (shared.clone(), metrics.clone());
            let spawned = thread::Builder::new().name(format!("render-{k}")).spawn(move || work(&shared, &metrics));
            spawned.map_err(|source| Error::Io { what: format!("rendering thread {k}"), source })?;
        }
        Ok(pool)
    }

    /// Adds a unit at the end of the queue.
    pub(crate) fn push(&self, task: Task) {
        self.shared.lock().tasks.push_back(task);
        self.shared.changed.notify_one();
    }

    /// Takes a unit out of the queue; whether it was still there.
    pub(crate) fn remove(&self, lease: LeaseName) -> bool {
        let mut queue = self.shared.lock();
        let before = queue.tasks.len();
        queue.tasks.retain(|task| task.lease != lease);
        queue.tasks.len() < before
    }
}

/// The queue, as long as somebody can hand in units.
struct Open(Arc<Shared>);

impl Drop for Open {
    /// Threads end after the unit they are at.
    fn drop(&mut self) {
        let mut queue = self.0.lock();
        queue.closed = true;
        queue.tasks.clear();
        self.0.changed.notify_all();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        // Nothing panics while the queue is half changed.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn next(&self) -> Option<Task> {
        let mut queue = self.lock();
        loop {
            if queue.closed {
                return None;
            }
            if let Some(task) = queue.tasks.pop_front() {
                return Some(task);
            }
            queue = self.changed.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

fn work(shared: &Shared, metrics: &Metrics) {
    while let Some(task) = shared.next() {
        if task.reports.send(Report::Started { lease: task.lease }).is_err() {
            // Who wanted it is gone.
            continue;
        }
        metrics.rendering.inc();
        let start = Instant::now();
        // `render_unit` keeps nothing between calls, so a panic leaves nothing half done behind.
        let rendered =
            catch_unwind(AssertUnwindSafe(|| render_watched(&*task.exposure, &task.plan, &task.unit, task.guide.as_deref(), &task.watch)));
        let render_seconds = start.elapsed().as_secs_f64();
        metrics.rendering.dec();
        let outcome = match rendered {
            Ok(_) if task.watch.is_stopped() => Err("it was told to stop".to_owned()),
            Ok(block) => block::encode(&block).map_err(|error| format!("encoding the block: {error}")),
            Err(panic) => Err(format!("rendering panicked: {}", words(panic.as_ref()))),
        };
        let counted = match &outcome {
            Ok(_) => "rendered",
            Err(_) if task.watch.is_stopped() => "stopped",
            Err(_) => "failed",
        };
        metrics.unit(counted, task.watch.samples(), render_seconds);
        // Who wanted it may be gone.
        let _gone = task.reports.send(Report::Finished { lease: task.lease, outcome, render_seconds });
    }
}

fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("without a message")
}
