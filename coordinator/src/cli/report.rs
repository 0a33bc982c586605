//! Where the time of a render went.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use gradfarm_core::film::Counter;
use gradfarm_core::plan::Timeline;
use serde::Serialize;

use super::accuracy;
use super::error::Error;
use super::outputs::FrameWriter;
use super::progress::rate;
use super::terminal;
use crate::api::json::{Accuracy, Frame, Job, Moment, PlanView};
use crate::service::{AccuracyView, JobView};

/// The spans that this process measures itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    started: Instant,
    load: Duration,
    write: Duration,
}

impl Clock {
    /// Starts to measure.
    pub(super) fn start() -> Self {
        Self { started: Instant::now(), load: Duration::ZERO, write: Duration::ZERO }
    }

    /// The scene is read: everything so far was loading.
    pub(super) fn loaded(&mut self) {
        self.load = self.started.elapsed();
    }

    /// Writing the images took so long.
    pub(super) fn wrote(&mut self, span: Duration) {
        self.write += span;
    }
}

/// What there is to say about a finished render.
#[derive(Debug)]
pub(super) struct Report {
    job: Job,
    workers: usize,
    threads: usize,
    seconds: Phases,
    /// Of the only frame.
    accuracy: Option<Accuracy>,
    files: Files,
}

impl Report {
    /// Units that were given up.
    pub(super) fn failed_units(&self) -> u64 {
        self.job.summary.failed_units
    }
}

/// What was written.
#[derive(Clone, Debug)]
pub(super) struct Files {
    /// As it was asked for.
    names: Vec<PathBuf>,
    /// The same for people.
    written: String,
    /// The EXR file of each frame, where there are such.
    exr: BTreeMap<u32, PathBuf>,
}

impl Files {
    /// What this writer writes.
    pub(super) fn of(writer: &FrameWriter) -> Self {
        let exr = writer.frames().range().filter_map(|frame| Some((frame, writer.exr_path(frame)?))).collect();
        Self { names: writer.names().to_vec(), written: writer.written(), exr }
    }

    /// The image, of several frames what was asked for first.
    fn output(&self) -> PathBuf {
        let only = if self.exr.len() == 1 { self.exr.values().next() } else { None };
        only.or(self.names.first()).cloned().unwrap_or_default()
    }

    /// What quick viewers can show of it.
    fn preview(&self) -> PathBuf {
        let output = self.output();
        if output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
            output.with_extension("png")
        } else {
            output
        }
    }
}

/// Spans of wall-clock time, one after the other [s]; what they leave of `total` is start-up and waiting.
#[derive(Clone, Copy, Debug, Serialize)]
struct Phases {
    /// Reading the scene here, and fetching it in the workers (mean over workers).
    load: f64,
    /// Compiling the scene (mean over workers).
    build: f64,
    /// From the first lease to the last result, without loading, building and checking.
    render: f64,
    /// Measuring the error on the way.
    check: f64,
    /// Adding the tiles up.
    stitch: f64,
    /// Reconstruction.
    reconstruct: f64,
    /// Encoding and writing files.
    write: f64,
    /// From start to end.
    total: f64,
}

/// What programs read of it.
#[derive(Debug, Serialize)]
pub(super) struct ReportJson<'a> {
    /// Camera samples of the primal over the wall-clock time spent tracing.
    samples_per_second: f64,
    seconds: Phases,
    /// Time spent tracing, summed over threads [s].
    render_thread_seconds: f64,
    #[serde(flatten)]
    plan: PlanView,
    estimated_relmse: Option<f64>,
    choice: Option<&'a str>,
    /// Of the only frame; of several each has its error below.
    accuracy: Option<&'a Accuracy>,
    frames: Vec<FrameJson<'a>>,
    statistics: &'a BTreeMap<String, u64>,
    workers: usize,
    threads: usize,
    output: String,
    preview: String,
    outputs: Vec<String>,
    version: &'static str,
}

/// What programs read of a frame.
#[derive(Debug, Serialize)]
struct FrameJson<'a> {
    number: u32,
    /// The frames that show the same image.
    moment: Option<Moment>,
    samples: u32,
    estimated_relmse: Option<f64>,
    choice: Option<&'a str>,
    stopped: Option<&'a str>,
    output: Option<String>,
}

impl Report {
    /// Puts together what the job and this process measured, with the accuracy of every frame. `threads` has one entry for each worker.
    pub(super) fn new(view: JobView, frames: &[AccuracyView], threads: &[usize], clock: Clock, files: Files) -> Self {
        let measured = view.seconds;
        // Frames of one moment were checked once. The last check of each made the image.
        let moments: BTreeSet<u32> = view.frames.iter().map(|frame| frame.moment.first).collect();
        let checked = frames.iter().filter(|frame| moments.contains(&frame.frame));
        let check: f64 = checked
            .flat_map(|frame| frame.curve.points.iter().rev().skip(1))
            .map(|point| point.check_seconds)
            .fold(0.0, |sum, one| sum + one);
        // Workers load and build at the same time as each other, and trace only then.
        let workers = threads.len().max(1) as f64;
        let (load, build) = (measured.load / workers, measured.compile / workers);
        let seconds = Phases {
            load: clock.load.as_secs_f64() + load,
            build,
            // One worker may load while another traces; it took no less than the tracing itself.
            render: (measured.render_span - load - build - check).max(measured.render / threads.iter().sum::<usize>().max(1) as f64),
            check,
            stitch: measured.stitch,
            reconstruct: measured.reconstruct,
            write: measured.write + clock.write.as_secs_f64(),
            total: clock.started.elapsed().as_secs_f64(),
        };
        Self {
            job: view.into(),
            workers: threads.len(),
            threads: threads.iter().sum(),
            seconds,
            accuracy: if let [only] = frames { Some(only.into()) } else { None },
            files,
        }
    }

    fn samples_per_second(&self) -> f64 {
        let samples = self.job.summary.progress.samples.done as f64;
        if self.seconds.render > 0.0 { samples / self.seconds.render } else { 0.0 }
    }

    /// Samples per pixel of the image.
    fn samples(&self) -> u32 {
        self.job.frames.first().map_or(self.job.plan.samples, |frame| frame.samples_per_pixel)
    }

    /// Mean over the frames, where each can tell.
    fn estimated_relmse(&self) -> Option<f64> {
        let errors: Option<Vec<f64>> = self.job.frames.iter().map(|frame| frame.estimated_relmse).collect();
        errors.filter(|errors| !errors.is_empty()).map(|errors| errors.iter().sum::<f64>() / errors.len() as f64)
    }

    fn choice(&self) -> Option<&str> {
        self.job.frames.first().and_then(|frame| frame.choice.as_deref())
    }

    fn frames(&self) -> Vec<FrameJson<'_>> {
        let told = |frame: &'_ Frame| self.files.exr.get(&frame.number).map(|path| path.display().to_string());
        let frames = self.job.frames.iter().map(|frame| FrameJson {
            number: frame.number,
            moment: frame.moment,
            samples: frame.samples_per_pixel,
            estimated_relmse: frame.estimated_relmse,
            choice: frame.choice.as_deref(),
            stopped: frame.stopped.as_deref(),
            output: told(frame),
        });
        frames.collect()
    }

    /// How many images were rendered for the frames: those that show the same share one.
    fn moments(&self) -> usize {
        let first = |frame: &Frame| frame.moment.map_or(frame.number, |moment| moment.first);
        self.job.frames.iter().map(first).collect::<BTreeSet<_>>().len()
    }

    /// For programs.
    pub(super) fn json(&self) -> ReportJson<'_> {
        ReportJson {
            samples_per_second: self.samples_per_second(),
            seconds: self.seconds,
            render_thread_seconds: self.job.seconds.render,
            // What the image has, which may be less than what it might have had.
            plan: PlanView { samples: self.samples(), ..self.job.plan.clone() },
            estimated_relmse: self.estimated_relmse(),
            choice: self.choice(),
            accuracy: self.accuracy.as_ref(),
            frames: self.frames(),
            statistics: &self.job.statistics,
            workers: self.workers,
            threads: self.threads,
            output: self.files.output().display().to_string(),
            preview: self.files.preview().display().to_string(),
            outputs: self.files.names.iter().map(|name| name.display().to_string()).collect(),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// For people.
    pub(super) fn print(&self) -> Result<(), Error> {
        let plan = &self.job.plan;
        let frames = self.job.frames.len();
        if frames > 1 {
            let (moments, fps) = (self.moments(), plan.timeline.map_or(Timeline::FPS, |timeline| timeline.fps));
            let shown = if moments < frames { format!(", which show {}", plural(moments, "moment")) } else { String::new() };
            terminal::line(format_args!("{frames} frames{shown}, {fps} a second"))?;
        }
        terminal::line(format_args!(
            "{} × {} pixels, {} samples each, {}, reconstruction {}, {} on {}",
            plan.width,
            plan.height,
            self.samples(),
            plan.technique,
            plan.reconstruction,
            plural(self.workers, "worker"),
            plural(self.threads, "thread"),
        ))?;
        let phases = self.seconds;
        let spans = [
            ("load", phases.load),
            ("build", phases.build),
            ("render", phases.render),
            ("check", phases.check),
            ("stitch", phases.stitch),
            ("reconstruct", phases.reconstruct),
            ("write", phases.write),
        ];
        for (name, seconds) in spans.into_iter().filter(|(name, seconds)| *name != "check" || *seconds > 0.0) {
            let note = if name == "render" { format!("   {}", rate(self.samples_per_second())) } else { String::new() };
            terminal::line(format_args!("  {name:12} {seconds:9.3} s{note}"))?;
        }
        terminal::line(format_args!("  {:12} {:9.3} s", "in all", phases.total))?;
        if let Some(told) = shifts(&self.job.statistics) {
            terminal::line(told)?;
        }
        if let Some(choice) = self.choice() {
            terminal::line(format_args!("reconstruction {choice}"))?;
        }
        if let Some(accuracy) = &self.accuracy {
            accuracy::lines(accuracy).into_iter().try_for_each(terminal::line)?;
        } else if let Some(error) = self.estimated_relmse() {
            terminal::line(format_args!("estimated relMSE {error:.2e}, mean of all frames"))?;
        }
        terminal::line(&self.files.written)
    }
}

/// What became of the shifts, in shares of all that were tried; `None` where there were none.
fn shifts(statistics: &BTreeMap<String, u64>) -> Option<String> {
    // Pairs that reach beyond the film were never tried.
    let tried = |name: &str| name.starts_with("shift_") && name != Counter::ShiftOutsideFilm.name();
    let mut outcomes: Vec<(&str, u64)> =
        statistics.iter().filter(|(name, count)| tried(name) && **count > 0).map(|(name, count)| (name.as_str(), *count)).collect();
    let all: u64 = outcomes.iter().map(|(_, count)| count).sum();
    outcomes.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let told: Vec<String> = outcomes
        .iter()
        .map(|(name, count)| {
            let words = name.trim_start_matches("shift_").replace('_', " ");
            format!("{words} {:.1} %", 100.0 * *count as f64 / all as f64)
        })
        .collect();
    (all > 0).then(|| format!("shifts: {}", told.join(", ")))
}

fn plural(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
