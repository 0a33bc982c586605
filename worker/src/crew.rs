//! One worker for several coordinators of one farm: a lease loop for each, one set of rendering threads for all.
//!
//! When a coordinator is gone, another one takes its jobs over, leases and all. So the leases of a loop whose coordinator is away are named
//! to the others, too, and their results are offered to each in turn until one of them answers.

use std::collections::BTreeSet;
use std::future::Future;
use std::sync::{Arc, Mutex, PoisonError};

use gradfarm_proto::convert::LeaseName;
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::config::Config;
use crate::credential::Bearer;
use crate::error::Error;
use crate::execute::Pool;
use crate::lease_loop;
use crate::link::{self, Client};

/// What the loops share.
pub(crate) struct Crew {
    /// Drawn when the process starts; the same for all coordinators.
    pub(crate) worker: [u8; 16],
    pub(crate) pool: Pool,
    members: Vec<Member>,
}

/// A coordinator, as all loops see it.
struct Member {
    client: Client,
    /// What it is shown; all calls to it share it.
    bearer: Bearer,
    /// The leases of its loop while it is away; none while it is there.
    orphans: Mutex<BTreeSet<LeaseName>>,
}

impl Crew {
    /// Clients for what is sent beside the stream: the loop's own first, then those of the others.
    pub(crate) fn clients(&self, own: usize) -> Vec<Client> {
        let count = self.members.len();
        (0..count).map(|k| self.members[(own + k) % count].client.clone()).collect()
    }

    /// What a loop's coordinator is shown.
    pub(crate) fn bearer(&self, own: usize) -> Bearer {
        self.members[own].bearer.clone()
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
    let urls: Vec<String> = [&config.coordinator].into_iter().chain(&config.others).cloned().collect();
    let mut members = Vec::with_capacity(urls.len());
    for url in &urls {
        let bearer = Bearer::new(config.credential.clone());
        members.push(Member { client: link::client(url, bearer.clone())?, bearer, orphans: Mutex::default() });
    }
    let crew = Arc::new(Crew { worker: uuid::Uuid::now_v7().into_bytes(), pool: Pool::start(config.threads)?, members });
    let (tell, told) = watch::channel(false);
    let mut loops = JoinSet::new();
    for (own, url) in urls.into_iter().enumerate() {
        let config = Config { coordinator: url, ..config.clone() };
        loops.spawn(lease_loop::run(own, crew.clone(), config, until(told.clone())));
    }
    drop(crew);
    tokio::pin!(shutdown);
    let mut stopping = false;
    let mut outcome = Ok(());
    loop {
        tokio::select! {
            () = &mut shutdown, if !stopping => stopping = true,
            ended = loops.join_next() => match ended {
                None => return outcome,
                Some(Ok(Ok(()))) => {}
                Some(Ok(Err(error))) => (outcome, stopping) = (Err(error), true),
                Some(Err(broken)) if broken.is_panic() => std::panic::resume_unwind(broken.into_panic()),
                Some(Err(_)) => {}
            },
        }
        if stopping {
            tell.send_replace(true);
        }
    }
}

async fn until(mut told: watch::Receiver<bool>) {
    // An error means that nobody can tell any more: a reason to stop, too.
    let _ = told.wait_for(|stop| *stop).await;
}
