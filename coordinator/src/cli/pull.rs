//! `gradfarm pull`: fetches a finished image.

use std::path::PathBuf;

use reqwest::Method;

use super::client::{Client, ServerOption};
use super::error::Error;
use super::files::{ImageTarget, Target};
use super::terminal;

/// Arguments of `gradfarm pull`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Writes OUT.exr, and OUT.png beside it.

Example:
  gradfarm pull 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 -o cornell.exr")]
pub(super) struct Pull {
    /// The job, as `submit` and `status` name it
    job: String,
    /// The image to write; its name ends in .exr
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Which frame
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u32,
    #[command(flatten)]
    server: ServerOption,
}

impl Pull {
    /// Fetches both files.
    pub(super) async fn run(self) -> Result<(), Error> {
        let output = Target::check_image(&self.output)?;
        fetch(&self.server.client()?, &self.job, self.frame, &output).await
    }
}

/// Fetches the files of a frame and writes them.
///
/// # Errors
/// If there is no such job or frame, or it is not finished, or the files cannot be written.
pub(super) async fn fetch(client: &Client, job: &str, frame: u32, output: &ImageTarget) -> Result<(), Error> {
    for (name, target) in [("frame.exr", &output.exr), ("frame.png", &output.png)] {
        let response = client.send(client.request(Method::GET, &format!("/jobs/{job}/frames/{frame}/{name}"))).await?;
        target.write(&client.bytes(response).await?)?;
    }
    terminal::note(format_args!("wrote {} and {}", output.exr.path().display(), output.png.path().display()));
    Ok(())
}
