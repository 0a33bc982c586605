//! What a client sends to submit a job: one JSON body, or one form with the scene and its files.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::Path;

use axum::body::Bytes;
use axum::extract::multipart::{Field, Multipart};
use gradfarm_core::plan::{Request, Stop, Timeline};
use gradfarm_core::scene::SceneDescription;
use gradfarm_core::scene::read::Format;
use gradfarm_proto::Digest;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use serde_json::{Map, Value};

use super::imported;
use super::problem::Problem;
use crate::job::{Needs, needs};
use crate::request;
use crate::service::{Frames, Handle, Submission};

/// The JSON body of a submission.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JobRequest {
    /// The scene description.
    #[schemars(with = "Value")]
    pub scene: Box<RawValue>,
    /// Digest of every file that the scene refers to, by the name it uses. Each must have been uploaded.
    #[serde(default)]
    pub assets: BTreeMap<String, String>,
    /// What to ask of the renderer and of the farm.
    #[serde(default)]
    pub options: JobOptions,
}

/// What may be asked for; everything left out is chosen from the scene. In a form, each is a field of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JobOptions {
    /// The job's name for people; otherwise that of the scene's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// `auto` or a technique.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub technique: Option<String>,
    /// `auto` or a reconstruction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reconstruction: Option<String>,
    /// Samples per pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u32>,
    /// Film size, such as `640x480` [pixels].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<String>,
    /// Seed of all randomness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Weight of the primal in the reconstruction; without it the one that the measured noise calls for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f32>,
    /// Whether negative values of the finished image become zero, which biases it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clamp: Option<bool>,
    /// Longest path [edges].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_depth: Option<u32>,
    /// `auto` or a shift.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<String>,
    /// Least probability with which Russian roulette lets a shift happen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift_survival: Option<f32>,
    /// Edge of the groups of pixels that reuse one another's paths [pixels].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reuse_edge: Option<u32>,
    /// Most links of a pixel to similar ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub links: Option<u32>,
    /// Rounds in which samples are placed; 1 places them evenly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounds: Option<u32>,
    /// Estimated relMSE at which a frame stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Wall-clock time of a frame at which it stops, with the reconstruction [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// `true` to measure the error on the way even if nothing depends on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curve: Option<bool>,
    /// Frames per second of an animated scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Share of a frame's time in which the shutter is open, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shutter: Option<f64>,
    /// Instants at which an open shutter sees the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instants: Option<u32>,
    /// Whether frames are reconstructed together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temporal: Option<bool>,
    /// Moments of a window that is reconstructed as a whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<u32>,
    /// Moments from window to window.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stride: Option<u32>,
    /// Whether differences in time follow what moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<bool>,
    /// Edge of the tiles [pixels].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tile: Option<u32>,
    /// First frame number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_frame: Option<u32>,
    /// How many frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_count: Option<u32>,
    /// Higher goes first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub priority: Option<i32>,
    /// Names this submission: sending it again with the same token gives the same job.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub client_token: Option<String>,
    /// The project that it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub project: Option<String>,
    /// Pools whose workers may render it, with commas between them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pool: Option<String>,
    /// What a worker must have: tags and amounts with commas between them, such as `gpu,memory=8G,threads=16`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub require: Option<String>,
    /// Named limits that its leases count against, with commas between them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<String>,
    /// Most workers at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_workers: Option<u32>,
    /// Share of its units that are rendered by two workers and compared, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verify: Option<f64>,
    /// Whether it waits until somebody resumes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paused: Option<bool>,
}

/// The fields of a form that stay text even if they look like numbers.
const TEXT_FIELDS: [&str; 10] =
    ["name", "technique", "reconstruction", "shift", "size", "client_token", "project", "pool", "require", "limit"];

/// Reads a JSON body.
///
/// # Errors
/// Where it is malformed, or what is wrong with the scene.
pub fn from_json(body: &[u8]) -> Result<Submission, Problem> {
    let mut json = serde_json::Deserializer::from_slice(body);
    let body: JobRequest = serde_path_to_error::deserialize(&mut json)
        .map_err(|fault| Problem::field(&fault.path().to_string(), fault.inner().to_string()))?;
    json.end().map_err(|fault| Problem::malformed(fault.to_string()))?;
    // Read here, and again where it is planned: only here the fault's place can be told in terms of what was sent.
    let scene = SceneDescription::from_json(body.scene.get(), "scene")?;
    let assets = body.assets.into_iter().map(|(name, digest)| match digest.parse::<Digest>() {
        Ok(digest) => Ok((name, digest)),
        Err(fault) => Err(Problem::field(&format!("assets.{name}"), fault.to_string())),
    });
    let assets: BTreeMap<String, Digest> = assets.collect::<Result<_, _>>()?;
    complete(&scene, body.scene.get().to_owned(), assets, &body.options, "unnamed")
}

/// Reads a form: a part `scene` with the description (or a scene of another format that can be imported), parts `asset` whose file names are those that the scene uses, and one part
/// for each option. The files are stored as they come.
///
/// # Errors
/// Which part is wrong, and how.
pub async fn from_form(mut form: Multipart, service: &Handle) -> Result<Submission, Problem> {
    let mut scene: Option<(String, Bytes)> = None;
    let mut assets = BTreeMap::new();
    let mut options = Map::new();
    while let Some(field) = form.next_field().await? {
        let part = field.name().unwrap_or_default().to_owned();
        match part.as_str() {
            "scene" => {
                let file = field.file_name().unwrap_or("scene.json").to_owned();
                scene = Some((file, field.bytes().await?));
            }
            "asset" => {
                let name = field.file_name().map(str::to_owned);
                let name = name.ok_or_else(|| Problem::field("asset", "a part without a file name; with curl: -F asset=@FILE"))?;
                assets.insert(name, service.put_asset(field.bytes().await?).await?);
            }
            _ => {
                let value = option_value(&part, field).await?;
                options.insert(part, value);
            }
        }
    }
    let options: JobOptions = serde_path_to_error::deserialize(Value::Object(options))
        .map_err(|fault| Problem::field(&fault.path().to_string(), fault.inner().to_string()))?;
    let (file, bytes) = scene.ok_or_else(|| Problem::field("scene", "the form has no part `scene`; with curl: -F scene=@scene.json"))?;
    let stem = file.rsplit('/').next().unwrap_or(&file);
    if let Some(format) = Format::of(Path::new(&file), &bytes).filter(|format| *format != Format::Native) {
        let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
        let (description, text) = imported::import(format, &file, bytes, &mut assets, service).await?;
        return complete(&description, text, assets, &options, stem);
    }
    let text = String::from_utf8(bytes.into()).map_err(|fault| Problem::field("scene", format!("{file} is not UTF-8: {fault}")))?;
    let description = SceneDescription::from_json(&text, &file)?;
    complete(&description, text, assets, &options, stem.strip_suffix(".json").unwrap_or(stem))
}

async fn option_value(name: &str, field: Field<'_>) -> Result<Value, Problem> {
    let text = field.text().await?;
    let plain = if TEXT_FIELDS.contains(&name) { None } else { serde_json::from_str::<Value>(text.trim()).ok() };
    Ok(plain.filter(|value| value.is_number() || value.is_boolean()).unwrap_or(Value::String(text)))
}

fn complete(
    scene: &SceneDescription,
    description: String,
    mut assets: BTreeMap<String, Digest>,
    options: &JobOptions,
    name: &str,
) -> Result<Submission, Problem> {
    let names = scene.assets();
    let missing: Vec<String> = names.iter().filter(|name| !assets.contains_key(*name)).cloned().collect();
    if !missing.is_empty() {
        return Err(Problem::missing_assets(&missing));
    }
    // A folder uploaded whole may hold more than the scene uses; what it does not use is no part of it.
    assets.retain(|name, _| names.contains(name));
    Ok(Submission {
        name: options.name.clone().unwrap_or_else(|| name.to_owned()),
        description,
        assets,
        request: options.request()?,
        tile: options.tile.unwrap_or(Submission::TILE),
        frames: options.frames(scene),
        priority: options.priority.unwrap_or(0),
        client_token: options.client_token.clone(),
        needs: options.needs()?,
        verify: options.verify,
        paused: options.paused.unwrap_or(false),
    })
}

impl JobOptions {
    /// The part of the options that is the schedule's.
    fn needs(&self) -> Result<Needs, Problem> {
        let wrong = |path: &'static str| move |fault: String| Problem::field(path, format!("options.{path} is {fault}"));
        let names = |path, text: &Option<String>| needs::names(text.as_deref().unwrap_or_default()).map_err(wrong(path));
        let required: Needs = self.require.as_deref().unwrap_or_default().parse().map_err(wrong("require"))?;
        Ok(Needs {
            project: self.project.as_deref().map(needs::name).transpose().map_err(wrong("project"))?.unwrap_or_default(),
            pools: names("pool", &self.pool)?,
            limits: names("limit", &self.limit)?,
            most_workers: self.max_workers,
            ..required
        })
    }

    /// The part of the options that is the renderer's.
    fn request(&self) -> Result<Request, Problem> {
        fn read<T: Copy + Debug, R>(path: &str, value: Option<T>, parse: impl Fn(T) -> Result<R, String>) -> Result<Option<R>, Problem> {
            let fault = |value: T, expected: String| Problem::field(path, format!("options.{path} is {value:?}, {expected}"));
            value.map(|value| parse(value).map_err(|expected| fault(value, expected))).transpose()
        }
        Ok(Request {
            technique: read("technique", self.technique.as_deref(), request::technique)?.flatten(),
            reconstruction: read("reconstruction", self.reconstruction.as_deref(), request::reconstruction)?.flatten(),
            samples: self.samples,
            extent: read("size", self.size.as_deref(), request::size)?,
            seed: self.seed.unwrap_or(0),
            alpha: read("alpha", self.alpha, request::check_alpha)?,
            clamp: self.clamp.unwrap_or(false),
            max_depth: self.max_depth,
            shift: read("shift", self.shift.as_deref(), request::shift)?.flatten(),
            shift_survival: read("shift_survival", self.shift_survival, request::check_survival)?,
            reuse_edge: self.reuse_edge,
            links: self.links,
            rounds: self.rounds,
            stop: Stop {
                error: read("error", self.error, request::check_error)?,
                seconds: read("seconds", self.seconds, request::check_seconds)?,
                curve: self.curve.unwrap_or(false),
            },
            frames: self.frame_count.unwrap_or(0),
            timeline: self.timeline(),
            temporal: self.temporal,
            window: self.window,
            stride: self.stride,
            motion: self.motion,
        })
    }

    /// The frames that are asked for; without any, those of the whole animation from the first one on.
    fn frames(&self, scene: &SceneDescription) -> Frames {
        let whole = Frames::of(scene, self.timeline());
        let first = self.first_frame.unwrap_or(if self.frame_count.is_some() { 0 } else { whole.first });
        Frames { first, count: self.frame_count.unwrap_or_else(|| whole.range().end.saturating_sub(first).max(1)) }
    }

    fn timeline(&self) -> Option<Timeline> {
        let default = Timeline::default();
        let (fps, shutter) = (self.fps.unwrap_or(default.fps), self.shutter.unwrap_or(default.shutter));
        let asked = self.fps.is_some() || self.shutter.is_some() || self.instants.is_some();
        asked.then(|| Timeline { fps, shutter, instants: self.instants.unwrap_or(default.instants) })
    }

    /// The options that make this request.
    pub fn of(asked: &Request) -> Self {
        Self {
            technique: asked.technique.map(|technique| technique.name().to_owned()),
            reconstruction: asked.reconstruction.map(|kind| kind.name().to_owned()),
            samples: asked.samples,
            size: asked.extent.map(request::size_text),
            seed: Some(asked.seed),
            alpha: asked.alpha,
            clamp: asked.clamp.then_some(true),
            max_depth: asked.max_depth,
            shift: asked.shift.map(|kind| kind.name().to_owned()),
            shift_survival: asked.shift_survival,
            reuse_edge: asked.reuse_edge,
            links: asked.links,
            rounds: asked.rounds,
            error: asked.stop.error,
            seconds: asked.stop.seconds,
            curve: asked.stop.curve.then_some(true),
            fps: asked.timeline.map(|time| time.fps),
            shutter: asked.timeline.map(|time| time.shutter),
            instants: asked.timeline.map(|time| time.instants),
            temporal: asked.temporal,
            window: asked.window,
            stride: asked.stride,
            motion: asked.motion,
            frame_count: (asked.frames > 0).then_some(asked.frames),
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::lattice::Extent;
    use gradfarm_core::plan::{ReconstructionKind, ShiftKind, Technique};

    const SCENE: &str = r#"{"version": 1, "camera": {"perspective": {"to_world": [], "fov": 40}}}"#;

    #[test]
    fn options_and_requests_are_inverse() {
        let asked = Request {
            technique: Some(Technique::Gpt),
            reconstruction: Some(ReconstructionKind::L1),
            samples: Some(3),
            extent: Some(Extent { width: 5, height: 6 }),
            seed: u64::MAX,
            alpha: Some(0.25),
            clamp: true,
            max_depth: Some(4),
            shift: Some(ShiftKind::Hybrid),
            shift_survival: Some(0.5),
            reuse_edge: Some(3),
            links: Some(5),
            rounds: Some(2),
            stop: Stop { error: Some(0.01), seconds: Some(7.5), curve: true },
            frames: 48,
            timeline: Some(Timeline { fps: 25.0, shutter: 0.5, instants: 4 }),
            temporal: Some(true),
            window: Some(4),
            stride: Some(2),
            motion: Some(false),
        };
        assert_eq!(JobOptions::of(&asked).request().unwrap(), asked);
        assert_eq!(JobOptions::default().request().unwrap(), Request::default());
    }

    #[test]
    fn faults_name_their_place() {
        let path = |body: &str| from_json(body.as_bytes()).unwrap_err().more["path"].as_str().unwrap().to_owned();
        assert_eq!(path(r#"{"scene": {}, "options": {"samples": "many"}}"#), "options.samples");
        assert_eq!(path(&format!(r#"{{"scene": {SCENE}, "assets": {{"a.obj": "12"}}}}"#)), "assets.a.obj");
        let problem = from_json(br#"{"scene": {"version": 1, "camera": 7}}"#).unwrap_err();
        assert_eq!((problem.status, problem.more["path"].as_str()), (422, Some("camera")));
    }
}
