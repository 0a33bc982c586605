//! `gradfarm retry`: what failed is tried again, and what is there stays.

use reqwest::Method;
use serde_json::json;

use super::client::ServerOption;
use super::error::Error;
use super::terminal;
use crate::api::json::Job;

/// Arguments of `gradfarm retry`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A job that failed goes on from what it has. Tiles that were given up get new chances, and frames that were made without them are made \
again when they are there. Cancelled jobs stay cancelled.

Examples:
  gradfarm retry 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11
  gradfarm retry 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 --frame 12")]
pub(super) struct Retry {
    /// The job, as `submit` and `status` name it
    job: String,
    /// Only this frame
    #[arg(long, value_name = "N")]
    frame: Option<u32>,
    /// Print the job as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Retry {
    /// Tries again.
    pub(super) async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        let request = client.request(Method::POST, &format!("/jobs/{}/retry", self.job));
        let request = request.json(&json!({ "frame": self.frame }));
        let job: Job = client.read(client.send(request).await?).await?;
        told(&job, self.json)
    }
}

/// Arguments of `gradfarm priority`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Jobs of higher priority get all workers that they can use before the others get any; what is being rendered finishes.

Example:
  gradfarm priority 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 10")]
pub(super) struct Priority {
    /// The job, as `submit` and `status` name it
    job: String,
    /// Higher goes first; 0 is usual
    #[arg(allow_negative_numbers = true)]
    priority: i32,
    /// Print the job as one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Priority {
    /// Changes the priority.
    pub(super) async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        let request = client.request(Method::PATCH, &format!("/jobs/{}", self.job)).json(&json!({ "priority": self.priority }));
        let job: Job = client.read(client.send(request).await?).await?;
        told(&job, self.json)
    }
}

fn told(job: &Job, json: bool) -> Result<(), Error> {
    if json {
        return terminal::json(job);
    }
    let state = if job.summary.paused { "paused" } else { &job.summary.state };
    terminal::line(format_args!("{} is {state}, priority {}", job.summary.id, job.summary.priority))
}
