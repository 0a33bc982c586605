//! `gradfarm submit`: hands a scene and its files to a coordinator.

use std::collections::BTreeMap;
use std::path::PathBuf;

use gradfarm_core::plan;
use gradfarm_core::scene::Loaded;
use gradfarm_proto::Digest;
use reqwest::{Method, StatusCode};
use serde_json::value::RawValue;

use super::client::{Client, ServerOption};
use super::error::Error;
use super::follow::{Telling, follow};
use super::options::RenderOptions;
use super::outputs::OutputOptions;
use super::placing::PlacingOptions;
use super::pull::{self, Puller};
use super::{scene, terminal};
use crate::api::json::{DryRun, Job};
use crate::api::submission::{JobOptions, JobRequest};

/// Arguments of `gradfarm submit`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Prints the job's name. Files that the coordinator has already are not sent again. With -o or --contact-sheet it waits for the job, and
from there all is as in `pull --follow`.

Examples:
  gradfarm submit tests/scenes/cornell-box.json --samples 256
  gradfarm submit scene.xml -o image.exr
  gradfarm submit dance.glb --frames 0..48 -o dance.%04d.exr -o dance.mp4
  job=$(gradfarm submit scene.json); gradfarm watch \"$job\"")]
pub(super) struct Submit {
    /// The scene: gradfarm JSON, Mitsuba XML, glTF or pbrt
    scene: PathBuf,
    #[command(flatten)]
    options: RenderOptions,
    /// Edge of the tiles in pixels; changes how work is shared, never the image
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    tile: Option<u32>,
    /// The job's name for people [default: the scene's]
    #[arg(long)]
    name: Option<String>,
    /// Jobs of higher priority go first
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    priority: i32,
    /// Names this submission: sending it again with the same token gives the same job
    #[arg(long, value_name = "TOKEN")]
    client_token: Option<String>,
    #[command(flatten)]
    placing: PlacingOptions,
    /// Only check everything and tell what would be done; nothing is sent but the scene, and nothing is stored
    #[arg(long, conflicts_with_all = ["wait", "output", "contact_sheet"])]
    dry_run: bool,
    /// Wait until the job is done
    #[arg(long)]
    wait: bool,
    #[command(flatten)]
    output: OutputOptions,
    /// Print the job as one JSON object instead of its name
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl Submit {
    /// Uploads what is missing, submits, and waits if asked to.
    pub(super) async fn run(self) -> Result<(), Error> {
        let outputs = self.output.check()?;
        let client = self.server.client()?;
        let loaded = scene::read(&self.scene)?;
        // The coordinator plans again; this only tells what it would refuse before anything is uploaded.
        let asked = self.options.request_for(&loaded.description);
        plan::resolve(&loaded.description, &asked)?;
        outputs.as_ref().map(|outputs| outputs.check_count(asked.frames)).transpose()?;
        let request = JobRequest {
            assets: if self.dry_run { digests(&loaded).await? } else { upload(&client, &loaded).await? },
            scene: RawValue::from_string(loaded.description.to_json()).map_err(|fault| Error::Failed(fault.to_string()))?,
            options: self.placing.ask(JobOptions {
                name: Some(self.name.clone().unwrap_or_else(|| scene::job_name(&self.scene))),
                tile: self.tile,
                priority: Some(self.priority),
                client_token: self.client_token.clone(),
                first_frame: Some(self.options.frames(&loaded.description).first),
                ..JobOptions::of(&asked)
            }),
        };
        if self.dry_run {
            let response = client.send(client.request(Method::POST, "/jobs?dry_run=true").json(&request)).await?;
            return tell(&client.read(response).await?, self.json);
        }
        let response = client.send(client.request(Method::POST, "/jobs").json(&request)).await?;
        let job: Job = client.read(response).await?;
        let id = job.summary.id.clone();
        if self.json {
            terminal::json(&job)?;
        } else {
            terminal::line(&id)?;
        }
        let Some(outputs) = outputs else {
            return if self.wait { follow(&client, &id, Telling::Bar, None).await } else { Ok(()) };
        };
        Puller::new(client, &job, pull::all(&job), outputs)?.follow().await
    }
}

/// Tells what would be done.
fn tell(run: &DryRun, json: bool) -> Result<(), Error> {
    if json {
        return terminal::json(run);
    }
    let plan = &run.plan;
    terminal::line(format_args!(
        "plan     {} × {} pixels, {} samples each, {}, reconstruction {}",
        plan.width, plan.height, plan.samples, plan.technique, plan.reconstruction
    ))?;
    terminal::line(format_args!("frames   {}, {} different images, {} units at most", run.frames, run.moments, run.units))?;
    terminal::line(format_args!("files    {} to be uploaded first", run.missing.len()))?;
    terminal::line(format_args!("workers  {} of {} may render it", run.fitting, run.workers))?;
    if !run.lacks.is_empty() {
        terminal::line(format_args!("         the others lack {}", run.lacks.join(", ")))?;
    }
    Ok(())
}

/// The digests of a scene's files.
async fn digests(loaded: &Loaded) -> Result<BTreeMap<String, String>, Error> {
    let mut digests = BTreeMap::new();
    for name in loaded.description.assets() {
        let bytes = scene::read_asset(&loaded.assets, &name).await?;
        digests.insert(name, Digest::of(&bytes).to_string());
    }
    Ok(digests)
}

/// Sends the files that the coordinator does not have yet; the digests of all.
async fn upload(client: &Client, loaded: &Loaded) -> Result<BTreeMap<String, String>, Error> {
    let mut digests = BTreeMap::new();
    for name in loaded.description.assets() {
        let bytes = scene::read_asset(&loaded.assets, &name).await?;
        let digest = Digest::of(&bytes).to_string();
        let there = client.request(Method::HEAD, &format!("/assets/{digest}")).send().await.map_err(|fault| client.unreachable(&fault))?;
        if there.status() == StatusCode::NOT_FOUND {
            client.send(client.request(Method::POST, "/assets").body(bytes)).await?;
        }
        digests.insert(name, digest);
    }
    Ok(digests)
}
