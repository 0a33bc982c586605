//! A worker of the farm: takes leases over one outbound stream, renders their units off the async threads, delivers the blocks.
//!
//! `lease_loop` is the heart: it knows every lease that a coordinator granted and what became of it; `crew` runs one for each coordinator. `link` keeps the stream to the
//! coordinator, `execute` owns the rendering threads, `scene_cache` and `asset_cache` keep what units share, `deliver` brings results
//! home,
//! `settings` reads files of settings, `metrics` names what is counted, `dial` opens connections, `credential` and `papers` are what the worker shows on them, `enrolment` gets it a certificate and keeps it good. Async threads never render, rendering threads never wait for the network.

mod asset_cache;
mod backoff;
mod config;
mod credential;
mod crew;
mod deliver;
mod dial;
mod enrolment;
mod error;
mod execute;
mod lease_loop;
mod link;
mod metrics;
mod papers;
mod scene_cache;
pub mod settings;

use std::future::Future;

pub use config::Config;
pub use credential::Credential;
pub use error::Error;

/// Works for a coordinator until `shutdown` is ready: then hands back what it did not begin, delivers what it did, and returns.
/// Survives a coordinator that goes away and comes back: results are kept until it has acknowledged them.
///
/// # Errors
/// If the configuration cannot work, or the coordinator refuses the worker for good.
pub async fn run(config: Config, shutdown: impl Future<Output = ()> + Send) -> Result<(), Error> {
    config.check()?;
    crew::run(config, shutdown).await
}
