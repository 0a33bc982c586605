//! One worker for several coordinators of one farm: a lease loop for each, one set of rendering threads for all.
//!
//! When a coordinator is gone, another one takes its jobs over, leases and all. So the leases of a loop whose coordinator is away are named
//! to the others, too, and their results are offered to each in turn until one of them answers.

use std::collections::BTreeSet;
use std::future::Future;
use std::sync::{Arc, Mutex, PoisonError};

use gradfarm_proto::convert::LeaseName;
use tokio::sync::watch;
use tokio::task::{JoinHandle, JoinSet};

use crate::config::Config;
use crate::dial::Dial;
use crate::enrolment;
use crate::error::Error;
use crate::execute::Pool;
use crate::lease_loop;
use crate::metrics::{self, Metrics};

/// What the loops share.
pub(crate) struct Crew {
    /// As its certificate says, or drawn when the process starts; the same for all coordinators.
    pub(crate) worker: [u8; 16],
    pub(crate) pool: Pool,
    pub(crate) metrics: Arc<Metrics>,
    members: Vec<Member>,
}

/// A coordinator, as all loops see it.
struct Member {
    /// Opens connections to it.
    dial: Dial,
    /// The leases of its loop while it is away; none while it is there.
    orphans: Mutex<BTreeSet<LeaseName>>,
}

impl Crew {
    /// For what is sent beside the stream: the loop's own coordinator first, then the others.
    pub(crate) fn dials(&self, own: usize) -> Vec<Dial> {
        let count = self.members.len();
        (0..count).map(|k| self.dial((own + k) % count)).collect()
    }

    /// A loop's own coordinator.
    pub(crate) fn dial(&self, own: usize) -> Dial {
        self.members[own].dial.clone()
    }

    /// Leases of other loops whose coordinators are away.
    pub(crate) fn orphans(&self, own: usize) -> Vec<LeaseName> {
        let others = self.members.iter().enumerate().filter(|(k, _)| *k != own);
        others.flat_map(|(_, member)| member.orphans.lock().unwrap_or_else(PoisonError::into_inner).clone()).collect()
    }

    /// A loop's coordinator is away, and these are the loop's leases; or it is there, and there are none to name elsewhere.
    pub(crate) fn set_orphans(&self, own: usize, leases: impl Iterator<Item = LeaseName>) {
        *self.members[own].orphans.lock().unwrap_or_else(PoisonError::into_inner) = leases.collect();
    }
}

/// Runs a worker.
///
/// # Errors
/// If it cannot start, or a coordinator refuses it for good.
pub(crate) async fn run(config: Config, shutdown: impl Future<Output = ()> + Send) -> Result<(), Error> {
    tokio::pin!(shutdown);
    let (papers, source, trust) = tokio::select! {
        prepared = enrolment::prepare(&config) => prepared?,
        () = &mut shutdown => return Ok(()),
    };
    let worker = papers.as_ref().map_or_else(|| uuid::Uuid::now_v7().into_bytes(), |papers| papers.identity.worker);
    let first = Dial::new(&config.coordinator, config.credential.clone(), papers.clone(), trust)?;
    let urls: Vec<String> = [&config.coordinator].into_iter().chain(&config.others).cloned().collect();
    let dials = urls.iter().map(|url| first.to(url)).collect::<Result<Vec<_>, _>>()?;
    let metrics = Arc::new(Metrics::default());
    metrics.threads.set(config.threads as i64);
    let _shown = match config.metrics {
        Some(address) => Some(AbortOnDrop(tokio::spawn(show(metrics::serve(address, metrics.clone()).await?)))),
        None => None,
    };
    let members = dials.iter().map(|dial| Member { dial: dial.clone(), orphans: Mutex::default() }).collect();
    let crew = Arc::new(Crew { worker, pool: Pool::start(config.threads, metrics.clone())?, metrics, members });
    let renewal = source.zip(papers).map(|(source, papers)| AbortOnDrop(tokio::spawn(enrolment::keep_good(dials, source, papers))));
    let (tell, told) = watch::channel(false);
    let mut loops = JoinSet::new();
    for (own, url) in urls.into_iter().enumerate() {
        let config = Config { coordinator: url, ..config.clone() };
        loops.spawn(lease_loop::run(own, crew.clone(), config, until(told.clone())));
    }
    let draining = crew.metrics.draining.clone();
    drop(crew);
    let mut stopping = false;
    let mut outcome = Ok(());
    loop {
        tokio::select! {
            () = &mut shutdown, if !stopping => stopping = true,
            ended = loops.join_next() => match ended {
                None => break,
                Some(Ok(Ok(()))) => {}
                Some(Ok(Err(error))) => (outcome, stopping) = (Err(error), true),
                Some(Err(broken)) if broken.is_panic() => std::panic::resume_unwind(broken.into_panic()),
                Some(Err(_)) => {}
            },
        }
        if stopping {
            draining.set(1);
            tell.send_replace(true);
        }
    }
    if let Some(mut renewal) = renewal {
        // Waited for, so that the state folder is free when this returns.
        renewal.0.abort();
        let _aborted = (&mut renewal.0).await;
    }
    outcome
}

async fn show(server: impl Future<Output = std::io::Result<()>>) {
    if let Err(problem) = server.await {
        tracing::warn!(%problem, "metrics are shown no longer");
    }
}

/// A task that ends with whoever started it.
struct AbortOnDrop(JoinHandle<()>);

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        self.0.abort();
    }
}

async fn until(mut told: watch::Receiver<bool>) {
    // An error means that nobody can tell any more: a reason to stop, too.
    let _ = told.wait_for(|stop| *stop).await;
}
