//! What happens on the whole farm, as server-sent events: jobs that changed, and the workers.

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::State;
use axum::response::sse::{Event, KeepAlive, Sse};
use futures::{Stream, stream};

use super::json::{FarmJobs, Workers};
use super::problem::Problem;
use crate::service::{Handle, Seen};

/// How often the farm is looked at for each listener.
const EVERY: Duration = Duration::from_secs(1);
/// Most jobs in one event.
const JOBS: usize = 500;

struct Watch {
    service: Handle,
    seen: Seen,
    workers: Workers,
    began: bool,
    waiting: Vec<Event>,
}

/// `GET /events`: `jobs` with those that changed since the stream began, and `workers` with all of them whenever one changed.
pub(super) async fn stream(State(service): State<Handle>) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let seen = service.seen().await?;
    let watch = Watch { service, seen, workers: Workers { workers: Vec::new() }, began: false, waiting: Vec::new() };
    let events = stream::unfold(watch, |mut watch| async move {
        loop {
            if let Some(event) = watch.waiting.pop() {
                return Some((Ok(event), watch));
            }
            if watch.began {
                tokio::time::sleep(EVERY).await;
            }
            // The stream ends with the service.
            watch.look().await?;
        }
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(Duration::from_secs(10))))
}

impl Watch {
    async fn look(&mut self) -> Option<()> {
        let (seen, changed) = self.service.changed(std::mem::take(&mut self.seen), JOBS).await.ok()?;
        self.seen = seen;
        if !changed.is_empty() {
            let jobs = FarmJobs { jobs: changed.into_iter().map(Into::into).collect() };
            self.waiting.extend(event("jobs", &jobs));
        }
        let workers = Workers { workers: self.service.workers().await.ok()?.into_iter().map(Into::into).collect() };
        if !self.began || workers != self.workers {
            self.waiting.extend(event("workers", &workers));
            self.workers = workers;
        }
        self.began = true;
        Some(())
    }
}

fn event(name: &str, data: &impl serde::Serialize) -> Option<Event> {
    Some(Event::default().event(name).data(serde_json::to_string(data).ok()?))
}
