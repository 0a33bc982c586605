//! `gradfarm watch`: follows a job until it ends.

use super::client::ServerOption;
use super::error::Error;
use super::follow::{Telling, follow};

/// Arguments of `gradfarm watch`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Ends with code 0 when the job is done, and 3 when it failed or was cancelled. A coordinator that is restarted meanwhile is waited \
for. Ctrl-C stops watching, not the job.

Examples:
  gradfarm watch 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11
  gradfarm watch 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 --json    # one JSON object an event")]
pub(super) struct Watch {
    /// The job, as `submit` and `status` name it
    job: String,
    /// Print every event as a line of JSON instead of a progress bar
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Watch {
    /// Follows the job.
    pub(super) async fn run(self) -> Result<(), Error> {
        let telling = if self.json { Telling::Json } else { Telling::Bar };
        follow(&self.server.client()?, &self.job, telling, None).await
    }
}
