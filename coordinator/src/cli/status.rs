//! `gradfarm status`: the list of jobs, or one job in full.

use std::time::{SystemTime, UNIX_EPOCH};

use super::client::{Client, ServerOption};
use super::error::Error;
use super::{span, terminal};
use crate::api::json::{Frame, Job, JobPage, JobSummary};
use crate::job::{FrameState, WindowState};

/// Arguments of `gradfarm status`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gradfarm status
  gradfarm status --limit 500 --json | jq '.jobs[] | select(.state == \"running\") | .id'
  gradfarm status 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11")]
pub(super) struct Status {
    /// The job; without it, all jobs are listed
    job: Option<String>,
    /// How many jobs to list, newest first
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=500))]
    limit: u32,
    /// Print JSON as the coordinator sends it
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Status {
    /// Asks and prints.
    pub(super) async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        let path = match &self.job {
            Some(job) => format!("/jobs/{job}"),
            None => format!("/jobs?limit={}", self.limit),
        };
        match (self.json, self.job.is_some()) {
            (true, _) => terminal::json(&client.get::<serde_json::Value>(&path).await?),
            (false, true) => print(&client.get(&path).await?),
            (false, false) => list(&client, &path).await,
        }
    }
}

async fn list(client: &Client, path: &str) -> Result<(), Error> {
    let page: JobPage = client.get(path).await?;
    if page.jobs.is_empty() {
        return terminal::line(format_args!("no jobs at {}", client.server()));
    }
    terminal::line(format_args!("{:36}  {:9}  {:>6}  {:>9}  {:>8}  name", "job", "state", "done", "frames", "age"))?;
    for job in &page.jobs {
        let done = job.progress.units.fraction() * 100.0;
        let frames = format!("{}/{}", job.frames_done, job.frames_total);
        terminal::line(format_args!("{:36}  {:9}  {done:5.1}%  {frames:>9}  {:>8}  {}", job.id, state(job), age(job), job.name))?;
    }
    if page.next.is_some() {
        terminal::line("… and older ones: --limit shows more")?;
    }
    Ok(())
}

fn print(job: &Job) -> Result<(), Error> {
    let (summary, plan) = (&job.summary, &job.plan);
    terminal::line(format_args!("job      {}", summary.id))?;
    terminal::line(format_args!("name     {}", summary.name))?;
    terminal::line(format_args!("state    {}{}", summary.state, if summary.paused { ", paused" } else { "" }))?;
    if let Some(error) = &summary.error {
        terminal::line(format_args!("because  {error}"))?;
    }
    if let Some(waiting) = &job.waiting {
        terminal::line(format_args!("waiting  {}", waiting.detail))?;
    }
    if !job.needs.project.is_empty() {
        terminal::line(format_args!("project  {}", job.needs.project))?;
    }
    terminal::line(format_args!("age      {}", age(summary)))?;
    terminal::line(format_args!(
        "plan     {} × {} pixels, {} samples each, {}, reconstruction {}",
        plan.width, plan.height, plan.samples, plan.technique, plan.reconstruction
    ))?;
    let units = summary.progress.units;
    terminal::line(format_args!("units    {} of {} ({:.1} %)", units.done, units.total, units.fraction() * 100.0))?;
    if summary.frames_total > 1 {
        terminal::line(format_args!("frames   {} of {} done", summary.frames_done, summary.frames_total))?;
    }
    if !job.windows.is_empty() {
        let solved = job.windows.iter().filter(|window| window.seconds.is_some()).count();
        let now = job.windows.iter().find(|window| window.state == WindowState::Solving.name());
        let now = now.map(|window| format!(", solving frames {}–{} together", window.first, window.end.max(1) - 1)).unwrap_or_default();
        terminal::line(format_args!("windows  {solved} of {} solved{now}", job.windows.len()))?;
    }
    for run in job.frames.chunk_by(alike) {
        terminal::line(format_args!("frame    {}", describe(run)))?;
        for failed in run.first().map_or(&[][..], |frame| &frame.failed) {
            terminal::line(format_args!("missing  {}", failed.told()))?;
        }
    }
    if summary.failed_units > 0 {
        terminal::line(format_args!("         `gradfarm retry {}` tries what is missing again", summary.id))?;
    }
    Ok(())
}

/// Whether there is nothing else to say of two frames: they show the same image, or both wait.
fn alike(one: &Frame, other: &Frame) -> bool {
    let waits = |frame: &Frame| frame.state == FrameState::Waiting.name();
    one.moment.is_some() && one.moment == other.moment || waits(one) && waits(other)
}

/// A run of frames that are alike.
fn describe(run: &[Frame]) -> String {
    let [frame, ..] = run else { return String::new() };
    let last = if run.len() > 1 { format!("–{}", run[run.len() - 1].number) } else { String::new() };
    let percent = frame.progress.units.fraction() * 100.0;
    let error = match frame.error {
        Some(error) => format!(", estimated relMSE {:.2e} ({:.2e} to {:.2e})", error.relmse, error.low, error.high),
        None => String::new(),
    };
    let stopped = frame.stopped.as_deref().map(|why| format!(", stopped by {why} at {} samples", frame.samples_per_pixel));
    let failure = frame.failure.as_deref().map(|why| format!(", {why}")).unwrap_or_default();
    let suspect = match frame.suspect_units {
        0 => String::new(),
        units => format!(", {units} units from a worker that was found to be wrong"),
    };
    let choice = frame.choice.as_deref().map(|choice| format!(", reconstruction {choice}"));
    let (stopped, choice) = (stopped.unwrap_or_default(), choice.unwrap_or_default());
    format!("{}{last}: {} ({percent:.1} %){error}{stopped}{choice}{failure}{suspect}", frame.number, frame.state)
}

fn state(job: &JobSummary) -> &str {
    if job.paused { "paused" } else { &job.state }
}

fn age(job: &JobSummary) -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |span| span.as_millis() as i64);
    span::tell(now - job.created_ms)
}
