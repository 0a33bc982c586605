//! `gradfarm pause` and `gradfarm resume`: a job that waits, and goes on where it stopped.

use reqwest::Method;

use super::client::ServerOption;
use super::error::Error;
use super::terminal;
use crate::api::json::Job;

/// Arguments of `gradfarm pause` and `gradfarm resume`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A paused job gets no leases; what is being rendered finishes and counts. It stays paused over a restart of the coordinator, and goes on \
where it stopped. Pausing a paused job changes nothing, nor does resuming another one.

Examples:
  gradfarm pause 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11
  gradfarm resume 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11")]
pub(super) struct Pause {
    /// The job, as `submit` and `status` name it
    job: String,
    /// Print the job as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Pause {
    /// Pauses the job, or resumes it.
    pub(super) async fn run(self, paused: bool) -> Result<(), Error> {
        let client = self.server.client()?;
        let what = if paused { "pause" } else { "resume" };
        let response = client.send(client.request(Method::POST, &format!("/jobs/{}/{what}", self.job))).await?;
        let job: Job = client.read(response).await?;
        if self.json {
            return terminal::json(&job);
        }
        let state = if job.summary.paused { "paused" } else { &job.summary.state };
        terminal::line(format_args!("{} is {state}", job.summary.id))
    }
}
