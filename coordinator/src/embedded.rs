//! A coordinator and workers in one process, speaking gRPC over loopback like any others. The only file that knows both.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::num::NonZero;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::{JoinHandle, JoinSet};

/// Files of settings, which both programs read in the same way.
pub use gradfarm_worker::settings;

use crate::error::Error;
use crate::service::{self, Handle, Service};

/// Most workers in one process.
pub const WORKERS_MOST: u16 = 256;
/// Most threads of one of them.
pub const THREADS_MOST: u16 = 1024;

/// Rendering threads of each of `workers` workers: `each` if it is given, otherwise the cores of this machine shared out.
/// A worker without a core of its own gets a thread all the same.
pub fn threads(workers: u16, each: Option<u16>) -> Vec<usize> {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    share_out(cores, usize::from(workers), each.map(usize::from))
}

fn share_out(cores: usize, workers: usize, each: Option<usize>) -> Vec<usize> {
    (0..workers).map(|k| each.unwrap_or((cores / workers + usize::from(k < cores % workers)).max(1))).collect()
}

/// A running coordinator with workers of its own.
#[derive(Debug)]
pub struct Farm {
    handle: Handle,
    grpc: SocketAddr,
    stop_workers: watch::Sender<bool>,
    stop_service: watch::Sender<bool>,
    service: JoinHandle<Result<(), Error>>,
    broken: bool,
    workers: JoinSet<Result<(), gradfarm_worker::Error>>,
}

impl Farm {
    /// Opens the state and starts the service on a listener, with one worker for each entry of `threads`.
    ///
    /// # Errors
    /// If the state cannot be opened, or the listener has no address.
    pub async fn start(config: service::Config, listener: TcpListener, threads: &[usize]) -> Result<Self, Error> {
        let io = |source| Error::Io { what: "address of the workers' listener".to_owned(), source };
        let grpc = listener.local_addr().map_err(io)?;
        let drain = config.drain;
        let service = Service::open(config).await?;
        let handle = service.handle();
        let token = handle.gate().in_process_worker().expose().to_owned();
        let authority = handle.secured().map(|secured| secured.registry.authority().pem().to_owned());
        let url = url(grpc, authority.is_some());
        let (stop_service, stopping) = watch::channel(false);
        let service = tokio::spawn(service.run(listener, wait(stopping)));
        let (stop_workers, stopping) = watch::channel(false);
        let mut workers = JoinSet::new();
        for (k, threads) in threads.iter().enumerate() {
            let mut config = gradfarm_worker::Config::new(&url, format!("embedded-{}", k + 1), *threads);
            config.credential = gradfarm_worker::Credential::InProcess { token: token.clone(), authority: authority.clone() };
            config.drain = drain;
            workers.spawn(gradfarm_worker::run(config, wait(stopping.clone())));
        }
        Ok(Self { handle, grpc, stop_workers, stop_service, service, broken: false, workers })
    }

    /// The same on a free port of loopback, with a state that need not survive a power cut: for one render.
    ///
    /// # Errors
    /// As [`start`](Self::start), and if no port can be had.
    pub async fn start_for_one_job(state: PathBuf, threads: &[usize]) -> Result<Self, Error> {
        let listener = service::listen((Ipv4Addr::LOCALHOST, 0).into()).await?;
        Self::start(service::Config { durable: false, ..service::Config::new(state) }, listener, threads).await
    }

    /// Speaks to the service.
    pub fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// Where workers connect.
    pub fn grpc(&self) -> SocketAddr {
        self.grpc
    }

    /// Waits until the service or a worker ends by itself, which neither should: the reason.
    pub async fn broken(&mut self) -> String {
        let worker = async {
            match self.workers.join_next().await {
                Some(ended) => ended,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            ended = &mut self.service => {
                self.broken = true;
                format!("the coordinator ended: {}", reason(ended))
            }
            ended = worker => format!("a worker ended: {}", reason(ended)),
        }
    }

    /// Goes off duty: grants nothing any more, lets the workers of this process finish what they are at, and waits for requests that change
    /// something, at most so long.
    ///
    /// # Errors
    /// Only [`Error::Stopped`].
    pub async fn drain(&mut self, most: Duration) -> Result<(), Error> {
        self.handle.drain().await?;
        self.stop_workers.send_replace(true);
        let handle = self.handle.clone();
        let finished = async {
            while self.workers.join_next().await.is_some() {}
            handle.idle().await;
        };
        if tokio::time::timeout(most, finished).await.is_err() {
            tracing::warn!(seconds = most.as_secs(), "out of time: not everything under way was finished");
        }
        Ok(())
    }

    /// Stops workers and service, in this order, and waits for them.
    ///
    /// # Errors
    /// If the service could not write its state at the end.
    pub async fn stop(mut self) -> Result<(), Error> {
        self.stop_workers.send_replace(true);
        while self.workers.join_next().await.is_some() {}
        self.stop_service.send_replace(true);
        if self.broken {
            return Ok(());
        }
        match self.service.await {
            Ok(ended) => ended,
            Err(_panicked) => Err(Error::Stopped),
        }
    }
}

/// Where somebody on this machine finds a listener.
pub fn url(address: SocketAddr, encrypted: bool) -> String {
    let scheme = if encrypted { "https" } else { "http" };
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    format!("{scheme}://{}", SocketAddr::new(ip, address.port()))
}

async fn wait(mut stopping: watch::Receiver<bool>) {
    // An error means that the farm itself is gone: a reason to stop, too.
    let _ = stopping.wait_for(|stop| *stop).await;
}

fn reason<E: std::fmt::Display>(ended: Result<Result<(), E>, tokio::task::JoinError>) -> String {
    match ended {
        Ok(Ok(())) => "without a reason".to_owned(),
        Ok(Err(error)) => error.to_string(),
        Err(panicked) => panicked.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_shared_out() {
        assert_eq!(share_out(2, 2, None), [1, 1]);
        assert_eq!(share_out(7, 3, None), [3, 2, 2]);
        assert_eq!(share_out(1, 2, None), [1, 1]);
        assert_eq!(share_out(2, 3, Some(4)), [4, 4, 4]);
        assert!(share_out(2, 0, None).is_empty());
    }
}
