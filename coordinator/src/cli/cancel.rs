//! `gradfarm cancel`: calls a job off.

use reqwest::Method;

use super::client::ServerOption;
use super::error::Error;
use super::terminal;
use crate::api::json::Job;

/// Arguments of `gradfarm cancel`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Workers drop what they have of it; what was rendered is not kept. Cancelling a cancelled job changes nothing.

Example:
  gradfarm cancel 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11")]
pub(super) struct Cancel {
    /// The job, as `submit` and `status` name it
    job: String,
    /// Print the job as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Cancel {
    /// Cancels the job.
    pub(super) async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        let response = client.send(client.request(Method::POST, &format!("/jobs/{}/cancel", self.job))).await?;
        let job: Job = client.read(response).await?;
        if self.json {
            return terminal::json(&job);
        }
        terminal::line(format_args!("{} is {}", job.summary.id, job.summary.state))
    }
}
