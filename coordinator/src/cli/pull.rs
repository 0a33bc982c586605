//! `gradfarm pull`: fetches finished frames, and makes movies of them.

use std::collections::BTreeSet;
use std::ops::Range;

use bytes::Bytes;
use gradfarm_core::plan::Timeline;
use reqwest::Method;

use super::client::{Client, ServerOption};
use super::error::Error;
use super::follow::{Telling, follow};
use super::outputs::{FrameWriter, OutputOptions, Outputs};
use super::terminal;
use super::time::FrameRange;
use crate::api::json::Job;
use crate::job::FrameState;
use crate::service::Frames;

/// Arguments of `gradfarm pull`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
OUT.exr is the image, with OUT.png beside it; out.%04d.exr is one for each frame; out.mp4 and out.webm are movies, where ffmpeg is \
installed; out.png is an animated PNG.

Examples:
  gradfarm pull 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 -o cornell.exr
  gradfarm pull 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 -o dance.%04d.exr --frames 0..48
  gradfarm pull 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 -o dance.mp4 --follow")]
pub(super) struct Pull {
    /// The job, as `submit` and `status` name it
    job: String,
    #[command(flatten)]
    output: OutputOptions,
    /// Which frames, such as 0..48 (48 is left out), 0..=47 or 12 [default: all of the job]
    #[arg(long, visible_alias = "frame", value_name = "A..B", value_parser = super::time::frames)]
    frames: Option<FrameRange>,
    /// Wait for the job, and write frames as they become ready
    #[arg(long)]
    follow: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Pull {
    /// Fetches the frames.
    pub(super) async fn run(self) -> Result<(), Error> {
        let outputs = self.output.check_some()?;
        let client = self.server.client()?;
        let job: Job = client.get(&format!("/jobs/{}", self.job)).await?;
        let frames = match &self.frames {
            Some(range) => range.frames(),
            None => all(&job),
        };
        let puller = Puller::new(client, &job, frames, outputs)?;
        if self.follow { puller.follow().await } else { puller.finish().await }
    }
}

/// The frames of a job.
pub(super) fn all(job: &Job) -> Frames {
    let first = job.frames.first().map_or(0, |frame| frame.number);
    Frames { first, count: job.frames.len() as u32 }
}

/// Fetches frames as they become ready.
#[derive(Debug)]
pub(super) struct Puller {
    client: Client,
    job: String,
    missing: BTreeSet<u32>,
    writer: FrameWriter,
}

impl Puller {
    /// Gets ready for these frames of a job.
    ///
    /// # Errors
    /// If the job has not all of them, or there is no room for them in what is to be written.
    pub(super) fn new(client: Client, job: &Job, frames: Frames, outputs: Outputs) -> Result<Self, Error> {
        let (has, wanted) = (all(job).range(), frames.range());
        if wanted.start < has.start || wanted.end > has.end {
            let found = format!("{}..{}", wanted.start, wanted.end);
            return Err(Error::Usage(format!(
                "frames {found} are not all in job {}, which has {}..{}",
                job.summary.id, has.start, has.end
            )));
        }
        let fps = job.plan.timeline.map_or(Timeline::FPS, |timeline| timeline.fps);
        let writer = outputs.open(frames, fps)?;
        Ok(Self { client, job: job.summary.id.clone(), missing: wanted.collect(), writer })
    }

    /// Fetches those of these frames that are wanted and were not fetched yet.
    ///
    /// # Errors
    /// If they are not finished, or cannot be written.
    pub(super) async fn ready(&mut self, frames: Range<u32>) -> Result<(), Error> {
        while let Some(number) = self.missing.range(frames.clone()).next().copied() {
            let exr = if self.writer.takes_exr() { self.file(number, "frame.exr").await? } else { Bytes::new() };
            let png = self.file(number, "frame.png").await?;
            self.writer.write(number, &exr, &png)?;
            self.missing.remove(&number);
        }
        Ok(())
    }

    /// Follows the job, fetches its frames as they become ready, and ends what holds all frames.
    ///
    /// # Errors
    /// As [`follow`] and [`finish`](Self::finish); frames of a job that is done without some of its units are written all the same.
    pub(super) async fn follow(mut self) -> Result<(), Error> {
        let (client, job) = (self.client.clone(), self.job.clone());
        let ended = follow(&client, &job, Telling::Bar, Some(&mut self)).await;
        if matches!(ended, Ok(()) | Err(Error::Flawed(_))) {
            self.finish().await?;
        }
        ended
    }

    /// Fetches the rest, and ends what holds all frames.
    ///
    /// # Errors
    /// If frames are not finished, or a file cannot be written.
    pub(super) async fn finish(mut self) -> Result<(), Error> {
        if let [first, .., last] = self.missing.iter().copied().collect::<Vec<_>>()[..] {
            // Told at once, not after half of them.
            self.check(first, last).await?;
        }
        self.ready(self.writer.frames().range()).await?;
        let names = self.writer.written();
        self.writer.finish()?;
        terminal::note(format_args!("wrote {names}"));
        Ok(())
    }

    async fn check(&self, first: u32, last: u32) -> Result<(), Error> {
        let job: Job = self.client.get(&format!("/jobs/{}", self.job)).await?;
        let late = job.frames.iter().find(|frame| (first..=last).contains(&frame.number) && frame.state != FrameState::Done.name());
        late.map_or(Ok(()), |frame| {
            Err(Error::Usage(format!("frame {} of job {} is {}: --follow waits for it", frame.number, self.job, frame.state)))
        })
    }

    async fn file(&self, number: u32, name: &str) -> Result<Bytes, Error> {
        let path = format!("/jobs/{}/frames/{number}/{name}", self.job);
        let response = self.client.send(self.client.request(Method::GET, &path)).await?;
        self.client.bytes(response).await
    }
}
