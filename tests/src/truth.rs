//! Scenes that nobody here wrote, against images that another renderer made, with its standard error for each pixel.
//!
//! The scenes lie beside the workspace, in `../shared/scenes`, one a folder: `scene.xml`, `reference.exr`, `reference_stderr.exr` and
//! `reference.json`. Values are compared as means over blocks of 8 × 8 pixels: single pixels have heavy tails, and their standard errors
//! are too small.
//!
//! Blocks have heavy tails too, where light comes by rare paths: a block that missed them is too dark and knows nothing of its error. The
//! reference traced paths as well, and many more of them; what it says of a block's error at our number of samples is therefore the least that
//! ours is taken for. Reconstructed images are compared by their own spread alone, since gradients make it smaller.

use std::path::{Path, PathBuf};
use std::time::Instant;

use gradfarm_core::film::Image;
use gradfarm_core::output::exr::read_rgb;
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, resolve};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::description::Film;
use gradfarm_core::scene::{Scene, SceneDescription, load};

use crate::frame::render;
use crate::statistics::{Comparison, Estimate, sidak, student_tail};

/// Edge of the blocks [pixels].
const BLOCK: u32 = 8;

/// The folder of the scenes, if it is here.
pub fn scenes() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    folder.is_dir().then_some(folder)
}

/// The names of the scenes that have a reference, in order.
pub fn names(scenes: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(scenes).into_iter().flatten().flatten();
    let has_reference = |folder: &Path| folder.join("scene.xml").is_file() && folder.join("reference.exr").is_file();
    let mut names: Vec<String> =
        entries.filter(|entry| has_reference(&entry.path())).filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
}

/// How much is rendered.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Independent renders, whose spread tells their variance; at least two.
    pub seeds: u64,
    /// Samples per pixel of each.
    pub samples: u32,
}

/// What a comparison of one scene, technique and reconstruction found.
#[derive(Clone, Debug)]
pub struct Row {
    /// How it was reconstructed.
    pub reconstruction: ReconstructionKind,
    /// Mean of our image over its pixels and channels.
    pub ours: f64,
    /// Mean of the reference.
    pub theirs: f64,
    /// Difference of the two means over its standard error.
    pub t: f64,
    /// Chance of a |t| as large, were there no difference [1].
    pub chance: f64,
    /// The blocks, one by one.
    pub blocks: Comparison,
    /// Root of the mean square of the blocks' differences, over the reference's mean [1].
    pub error: f64,
    /// What that root should be, from the standard errors of both sides [1].
    pub expected_error: f64,
    /// Time to render all seeds and, for later rows of one technique, to reconstruct them [s].
    pub seconds: f64,
}

impl Row {
    /// Whether chance explains the mean and every block, at this level for each of the two.
    ///
    /// # Errors
    /// What it does not explain, in words.
    pub fn agrees(&self, level: f64) -> Result<(), String> {
        if self.chance < level {
            return Err(format!("the mean is {:.4} of the reference's, t = {:.2}", self.ours / self.theirs, self.t));
        }
        if !self.blocks.agrees(level) {
            let each = sidak(level, self.blocks.pairs);
            return Err(format!("block {} has a chance of {:e}, below {each:e}", self.blocks.place, self.blocks.chance));
        }
        Ok(())
    }
}

/// Mean of each block, per channel: sums of `value` over its pixels, over their number.
fn blocks(image: &Image, value: impl Fn(f64) -> f64) -> Vec<f64> {
    let extent = image.extent();
    let mut means = Vec::new();
    for channel in 0..3 {
        for block in extent.tiles(BLOCK) {
            let pixels = (0..block.pixels() as u32).map(|k| (block.x + k % block.width, block.y + k / block.width));
            let sum: f64 = pixels.map(|(x, y)| value(f64::from(image.at(x, y, channel)))).sum();
            means.push(sum / block.pixels() as f64);
        }
    }
    means
}

/// The reference: its film and longest path, block means with their standard errors, their pixels, and its samples per pixel.
struct Reference {
    film: Film,
    max_depth: u32,
    blocks: Vec<Estimate>,
    pixels: Vec<f64>,
    samples: f64,
}

impl Reference {
    fn read(folder: &Path) -> Result<Reference, String> {
        let read = |name: &str| {
            let bytes = std::fs::read(folder.join(name)).map_err(|_| format!("no {name} beside the scene"))?;
            read_rgb(&bytes).map_err(|fault| fault.to_string())
        };
        let about = std::fs::read_to_string(folder.join("reference.json")).unwrap_or_default();
        let about: serde_json::Value = serde_json::from_str(&about).unwrap_or_default();
        if about["variant"].as_str().is_some_and(|variant| variant.ends_with("_spectral")) {
            return Err("the reference was made with spectra, which RGB does not equal".to_string());
        }
        let samples = about["spp"].as_f64().ok_or("reference.json tells no samples per pixel")?;
        let max_depth = about["max_depth"].as_u64().and_then(|depth| u32::try_from(depth).ok());
        let max_depth = max_depth.ok_or("reference.json tells no max_depth")?;
        let (image, error) = (read("reference.exr")?, read("reference_stderr.exr")?);
        let squares = blocks(&error, |e| e * e);
        let tiles: Vec<f64> = image.extent().tiles(BLOCK).iter().map(|block| block.pixels() as f64).collect();
        let pixels: Vec<f64> = tiles.iter().cycle().take(squares.len()).copied().collect();
        let means = blocks(&image, |v| v).into_iter().zip(squares.iter().zip(&pixels));
        let blocks = means.map(|(mean, (square, pixels))| Estimate::known(mean, (square / pixels).sqrt())).collect();
        let film = Film::new(image.extent().width, image.extent().height);
        Ok(Reference { film, max_depth, blocks, pixels, samples })
    }

    /// The mean over all pixels of numbers that are means of blocks.
    fn mean(&self, values: impl Iterator<Item = f64>) -> f64 {
        values.zip(&self.pixels).map(|(value, pixels)| value * pixels).sum::<f64>() / self.pixels.iter().sum::<f64>()
    }
}

/// Compares one scene, of which `file` is one form, with its reference, by one technique: a row without reconstruction, and one with `l2`
/// where there are gradients. Film, filter (box) and longest path are those of the reference, whatever this form of the scene says.
///
/// # Errors
/// Why the scene is out of reach: what the importer, the compiler or the plan refused, or what the reference lacks.
pub fn measure(folder: &Path, file: &str, technique: Technique, effort: Effort) -> Result<Vec<Row>, String> {
    measure_changed(folder, file, |_| {}, technique, effort)
}

/// The same for a scene that is changed before it is rendered.
///
/// # Errors
/// As [`measure`].
pub fn measure_changed(
    folder: &Path,
    file: &str,
    change: impl FnOnce(&mut SceneDescription),
    technique: Technique,
    effort: Effort,
) -> Result<Vec<Row>, String> {
    let reference = Reference::read(folder)?;
    let mut loaded = load(folder.join(file)).map_err(|fault| short(&fault.to_string(), folder))?;
    change(&mut loaded.description);
    loaded.description.film = reference.film;
    loaded.description.integrator.max_depth = reference.max_depth;
    let scene = Scene::compile(&loaded.description, &loaded.assets).map_err(|fault| short(&fault.to_string(), folder))?;
    let plan = |seed| -> Result<Plan, String> {
        let request = Request { technique: Some(technique), samples: Some(effort.samples), seed, ..Request::default() };
        resolve(&loaded.description, &request).map_err(|fault| fault.to_string())
    };
    let mut started = Instant::now();
    let films = (0..effort.seeds).map(|seed| render(&scene, &plan(seed)?).map_err(|fault| fault.to_string()));
    let films = films.collect::<Result<Vec<_>, String>>()?;
    let unbiased = |kind: &ReconstructionKind| kind.is_unbiased() && technique.takes(*kind);
    let kinds: Vec<_> = ReconstructionKind::ALL.into_iter().filter(unbiased).collect();
    let mut rows = Vec::new();
    for kind in &kinds {
        let images = films.iter().map(|film| reconstruct(film, *kind, 0.2).map(|solved| blocks(&solved.image, |v| v)));
        let runs = images.collect::<Result<Vec<_>, _>>().map_err(|fault| fault.to_string())?;
        if runs.iter().any(|run| run.len() != reference.blocks.len()) {
            return Err("the film has not the size of the reference".to_string());
        }
        rows.push(row(&runs, &reference, *kind, effort, started.elapsed().as_secs_f64()));
        started = Instant::now();
    }
    Ok(rows)
}

fn row(runs: &[Vec<f64>], reference: &Reference, reconstruction: ReconstructionKind, effort: Effort, seconds: f64) -> Row {
    let fewer = reference.samples / (effort.seeds as f64 * f64::from(effort.samples));
    let block = |(k, theirs): (usize, &Estimate)| {
        let ours = Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<_>>());
        let least = Estimate { mean: ours.mean, variance: theirs.variance * fewer, freedom: f64::INFINITY };
        if reconstruction == ReconstructionKind::None && least.variance > ours.variance { least } else { ours }
    };
    let estimates: Vec<Estimate> = reference.blocks.iter().enumerate().map(block).collect();
    let frames: Vec<f64> = runs.iter().map(|run| reference.mean(run.iter().copied())).collect();
    let ours = Estimate::of(&frames);
    let all: f64 = reference.pixels.iter().sum();
    let spread =
        reference.blocks.iter().zip(&reference.pixels).map(|(block, pixels)| block.variance * pixels * pixels).sum::<f64>().sqrt() / all;
    let theirs = Estimate::known(reference.mean(reference.blocks.iter().map(|block| block.mean)), spread);
    let (t, freedom) = ours.t(&theirs).unwrap_or((0.0, 1.0));
    let squares = reference.mean(estimates.iter().zip(&reference.blocks).map(|(a, b)| (a.mean - b.mean) * (a.mean - b.mean)));
    let variances = reference.mean(estimates.iter().zip(&reference.blocks).map(|(a, b)| a.variance + b.variance));
    Row {
        reconstruction,
        ours: ours.mean,
        theirs: theirs.mean,
        t,
        chance: student_tail(t, freedom),
        blocks: Comparison::of(estimates.iter().copied().zip(reference.blocks.iter().copied())),
        error: squares.sqrt() / theirs.mean,
        expected_error: variances.sqrt() / theirs.mean,
        seconds,
    }
}

/// A refusal without the way to the scene's folder.
fn short(message: &str, folder: &Path) -> String {
    message.replace(&format!("{}/", folder.display()), "")
}
