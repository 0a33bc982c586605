//! `gradfarm study`: what accuracy costs in time: methods against a reference, at equal time.

use std::path::{Path, PathBuf};

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::png;
use gradfarm_core::plan::{ReconstructionKind, Technique};

use super::contest::{Contest, Shown, read};
use super::error::Error;
use super::method::Method;
use super::peer::Mitsuba;
use super::{scene, terminal};
use crate::request;
use crate::study::page::{self, Views};
use crate::study::{Study as Found, pictures, table};
use crate::telemetry;

/// Arguments of `gradfarm study`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each scene is rendered by path tracing and by every method, with so many samples as a short trial says that each budget of --seconds has \
time for: tracing on all threads, adding up and reconstruction counted. All are compared with a reference of other random numbers, \
rendered by gpt + l2, which has no bias, or with an image of your own. `equal time` says how many times smaller the error is than path \
tracing's in the same time, `time to equal error` how many times sooner the error is reached that path tracing has at the end, by the \
law relMSE = c · seconds^slope fitted to all budgets.

A method is a technique with its reconstruction, and options after colons: gpt+l2, reuse+l1, gpt+l2:shift=replay:rounds=4. \
Options: shift, survival, alpha, clamp, reuse-edge, links, rounds, max-depth. --techniques and --reconstructions name all their pairs at once.

Where Python has the package `mitsuba`, Mitsuba 3 joins on scenes in its format (GRADFARM_PYTHON names another Python).

With -o, the folder gets study.json (everything), study.csv (every run), study.html (plots, tables, images; one file that needs nothing \
else) and an SVG for each scene. Times on a busy machine are noisy: compare rows of one study, not studies.

Examples:
  gradfarm study tests/scenes/hall.json --techniques gpt --reconstructions l2,l1 --seconds 1,2,4 --size 160x120 -o study
  gradfarm study scene.xml --methods gpt+l2,gpt+l2:rounds=4 --seconds 5,10,20,40 --seeds 3 --reference reference.exr --json")]
pub(super) struct Study {
    /// Scenes: gradfarm JSON, Mitsuba XML, glTF or pbrt
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// What to compare with path tracing [default: gpt+l2,gpt+l1]
    #[arg(long, value_name = "METHOD,...", value_delimiter = ',')]
    methods: Vec<Method>,
    /// Techniques to pair with every one of --reconstructions
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = technique)]
    techniques: Vec<Technique>,
    /// Reconstructions to pair with every one of --techniques
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = reconstruction)]
    reconstructions: Vec<ReconstructionKind>,
    /// Budgets of time, from short to long
    #[arg(long, value_name = "S,...", value_delimiter = ',', default_value = "1,2,4", value_parser = seconds)]
    seconds: Vec<f64>,
    /// How many seeds each method is run with
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// First seed; the reference uses another
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// An image of the same size to compare with; for a single scene
    #[arg(long, value_name = "FILE.exr", conflicts_with = "reference_seconds")]
    reference: Option<PathBuf>,
    /// How long to render the reference [default: ten times the longest budget]
    #[arg(long, value_name = "S", value_parser = seconds)]
    reference_seconds: Option<f64>,
    /// Size of the images in pixels [default: the scene's own]
    #[arg(long, value_name = "WxH", value_parser = request::size)]
    size: Option<Extent>,
    /// Leave Mitsuba out
    #[arg(long)]
    alone: bool,
    /// Folder to write study.json, study.csv, study.html and plots to
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Print everything as JSON instead of a table
    #[arg(long)]
    json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    request::check_seconds(text.parse().unwrap_or(f64::NAN))
}

fn technique(text: &str) -> Result<Technique, String> {
    request::technique(text)?.ok_or_else(|| "a study names its techniques".to_owned())
}

fn reconstruction(text: &str) -> Result<ReconstructionKind, String> {
    request::reconstruction(text)?.ok_or_else(|| "a study names its reconstructions".to_owned())
}

impl Study {
    /// Renders everything, prints the table and writes the files.
    pub(super) fn run(self) -> Result<(), Error> {
        telemetry::start("warn", telemetry::Format::Text).map_err(Error::Usage)?;
        if self.reference.is_some() && self.scenes.len() > 1 {
            return Err(Error::Usage(format!("--reference is an image of one scene, found {} scenes", self.scenes.len())));
        }
        if self.seconds.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(Error::Usage("--seconds must grow from budget to budget".to_owned()));
        }
        let methods = self.compared()?;
        let loaded: Vec<_> = self.scenes.iter().map(|path| Ok((path, scene::read(path)?))).collect::<Result<_, Error>>()?;
        if let Some(folder) = &self.output {
            std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
        }
        let peer = if self.alone || !self.scenes.iter().any(|path| Mitsuba::reads(path)) { None } else { Mitsuba::find() };
        let runtime = super::runtime()?;
        if !self.json {
            table::HEAD.into_iter().try_for_each(terminal::line)?;
        }
        let (mut found, mut views) = (self.described(peer.as_ref()), Vec::new());
        for (path, loaded) in &loaded {
            let size = self.size.unwrap_or_else(|| {
                let (width, height) = loaded.description.film.rendered();
                Extent { width, height }
            });
            let contest = Contest {
                name: scene::job_name(path),
                path,
                loaded,
                size,
                methods: &methods,
                peer: peer.as_ref().filter(|_| Mitsuba::reads(path)),
                budgets: &self.seconds,
                seeds: (0..u64::from(self.seeds)).map(|k| self.seed.wrapping_add(k)).collect(),
                reference: self.reference.as_deref().map(|file| read(file, size)).transpose()?,
                reference_seconds: self.reference_seconds.unwrap_or(10.0 * self.seconds.last().copied().unwrap_or(1.0)),
            };
            let (scene, shown) = runtime.block_on(contest.hold())?;
            if !self.json {
                table::rows(&scene).into_iter().try_for_each(terminal::line)?;
            }
            found.scenes.push(scene);
            views.push(seen(&shown)?);
            // What is there is written after each scene, so that an interrupted study is not lost.
            if let Some(folder) = &self.output {
                write(folder, &found, &views)?;
            }
        }
        if self.json { terminal::json(&found) } else { Ok(()) }
    }

    /// Everything that is compared, path tracing first.
    fn compared(&self) -> Result<Vec<Method>, Error> {
        if self.techniques.is_empty() != self.reconstructions.is_empty() {
            return Err(Error::Usage("--techniques and --reconstructions make pairs: name both or neither".to_owned()));
        }
        let all = self.techniques.iter().flat_map(|technique| self.reconstructions.iter().map(|kind| (*technique, *kind)));
        let pairs = all.filter(|(technique, kind)| technique.takes(*kind)).map(|(technique, kind)| Method::pair(technique, kind));
        let mut named: Vec<Method> = self.methods.iter().cloned().chain(pairs).collect();
        if named.is_empty() {
            named.extend([ReconstructionKind::L2, ReconstructionKind::L1].map(|kind| Method::pair(Technique::Gpt, kind)));
        }
        let mut methods = vec![Method::path_tracing()];
        for method in named {
            if !methods.contains(&method) && method != Method::pair(Technique::Pt, ReconstructionKind::None) {
                methods.push(method);
            }
        }
        Ok(methods)
    }

    fn described(&self, peer: Option<&Mitsuba>) -> Found {
        let command: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
        let peer = peer.map_or(String::new(), |mitsuba| format!(", beside Mitsuba {} ({})", mitsuba.version, mitsuba.variant));
        Found {
            version: format!("{}{peer}", env!("CARGO_PKG_VERSION")),
            command: command.join(" "),
            machine: machine(),
            scenes: Vec::new(),
        }
    }
}

/// Processor, where the system tells it, and threads.
fn machine() -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = told.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, model)| model.trim().to_owned()));
    let model = model.unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    format!("{model}, {threads} threads, {}", std::env::consts::OS)
}

/// The reference and what each method shows, as PNG files.
fn seen(shown: &Shown) -> Result<Vec<Views>, Error> {
    let exposure = pictures::exposure(&shown.reference);
    let telling = shown.images.first().map_or(&shown.reference, |(_, image)| image);
    let tile = pictures::telling_part(telling, &shown.reference);
    let encode = |image: &Image, exposure: f32| png::encode(image, exposure).map_err(|fault| Error::Failed(fault.to_string()));
    let view = |name: &str, image: &Image, error: Option<Image>| {
        Ok::<_, Error>(Views {
            method: name.to_owned(),
            image: encode(image, exposure)?,
            part: encode(&pictures::part(image, tile), exposure)?,
            error: error.map(|error| encode(&error, 1.0)).transpose()?,
        })
    };
    let mut views = vec![view("reference", &shown.reference, None)?];
    for (name, image) in &shown.images {
        views.push(view(name, image, Some(pictures::error_map(image, &shown.reference)))?);
    }
    Ok(views)
}

fn write(folder: &Path, study: &Found, views: &[Vec<Views>]) -> Result<(), Error> {
    let failed = |fault: String| Error::Failed(format!("the study cannot be written: {fault}"));
    let json = serde_json::to_string_pretty(study).map_err(|fault| failed(fault.to_string()))?;
    let html = page::page(study, views).map_err(|fault| failed(fault.to_string()))?;
    let mut files = vec![("study.json".to_owned(), json), ("study.csv".to_owned(), table::csv(study)), ("study.html".to_owned(), html)];
    for (k, scene) in study.scenes.iter().enumerate() {
        let svg = page::plot(scene).to_svg().map_err(|fault| failed(fault.to_string()))?;
        // Scenes of one name in different folders must not overwrite each other.
        let twins = study.scenes[..k].iter().filter(|other| other.name == scene.name).count();
        let name = if twins == 0 { scene.name.clone() } else { format!("{}-{}", scene.name, twins + 1) };
        files.push((format!("{name}.svg"), svg));
    }
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|source| Error::Write { path, source })?;
    }
    Ok(())
}
