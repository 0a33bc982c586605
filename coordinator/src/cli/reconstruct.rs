//! `gradfarm reconstruct`: an image from a primal and its gradients, whoever measured them.

use std::io::Cursor;
use std::path::PathBuf;
use std::time::Instant;

use gradfarm_core::film::Image;
use gradfarm_core::output::{exr, png};
use gradfarm_core::plan::{ReconstructionKind, by_name};
use gradfarm_core::reconstruction::{self, Measurements, SolveReport, Variance};
use serde_json::json;

use super::error::Error;
use super::files::Target;
use super::measured::{Measured, Places};
use super::terminal;
use crate::oidn;
use crate::request;

/// Arguments of `gradfarm reconstruct`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Conventions: dx is I(x+1, y) − I(x, y), dy is I(x, y+1) − I(x, y); there is no pair in the last column of dx and the last row of dy, \
and what stands there is not used. Directly visible light (`direct`) is added at the end; in a file of several layers it is taken out of \
the primal first, in a file of its own it never was in it.

Layers: primal, dx, dy, direct, variance, variance-dx, variance-dy (variances of the means), albedo, normal, depth. A file of one \
layer may have any name.

Examples:
  gradfarm reconstruct kitchen-primal.exr -o kitchen.exr           with kitchen-dx.exr and kitchen-dy.exr beside it
  gradfarm reconstruct kitchen -o kitchen-l1.exr --reconstruction l1
  gradfarm reconstruct layers.exr -o image.exr --reconstruction weighted-l2
  gradfarm reconstruct --primal p.exr --dx x.exr --dy y.exr -o image.exr --alpha 0.2 --json")]
pub(super) struct Reconstruct {
    /// One of the files X-primal.exr, X-dx.exr, X-dy.exr, or their common prefix X, or one file with all layers
    #[arg(value_name = "NAME", required_unless_present_all = ["primal", "dx", "dy"])]
    name: Option<PathBuf>,
    /// The primal
    #[arg(long, value_name = "P.exr", requires_all = ["dx", "dy"], conflicts_with = "name")]
    primal: Option<PathBuf>,
    /// Differences to the next column
    #[arg(long, value_name = "DX.exr", requires = "primal")]
    dx: Option<PathBuf>,
    /// Differences to the next row
    #[arg(long, value_name = "DY.exr", requires = "primal")]
    dy: Option<PathBuf>,
    /// Directly visible light, to be added at the end
    #[arg(long, value_name = "FILE")]
    direct: Option<PathBuf>,
    /// Variances: layers variance, variance-dx and variance-dy
    #[arg(long, value_name = "FILE")]
    variance: Option<PathBuf>,
    /// Features: layers albedo, normal and depth
    #[arg(long, value_name = "FILE")]
    features: Option<PathBuf>,
    /// How the image is made
    #[arg(long, value_name = "NAME", default_value = "l2", value_parser = kind)]
    reconstruction: ReconstructionKind,
    /// Weight of the primal against the gradients, above 0 [default: what the variances call for, else 0.2]
    #[arg(long, value_name = "A", value_parser = alpha)]
    alpha: Option<f32>,
    /// Set negative values of the image to zero; this biases it
    #[arg(long)]
    clamp: bool,
    /// The image to write; a PNG is written beside it
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Any that goes without a second, independent half: files hold one.
fn kind(name: &str) -> Result<ReconstructionKind, String> {
    let alone = |kind: &ReconstructionKind| *kind != ReconstructionKind::Auto && !kind.needs_halves();
    let all: Vec<ReconstructionKind> = ReconstructionKind::ALL.into_iter().filter(alone).collect();
    let known: Vec<&str> = all.iter().map(|kind| kind.name()).collect();
    by_name(&all, ReconstructionKind::name, name).ok_or_else(|| format!("expected one of {}", known.join(", ")))
}

fn alpha(text: &str) -> Result<f32, String> {
    request::check_alpha(text.parse().unwrap_or(f32::NAN))
}

impl Reconstruct {
    /// Reads the measurements, solves, writes the image and tells how it went.
    pub(super) fn run(&self) -> Result<(), Error> {
        let output = Target::check_image(&self.output)?;
        oidn::check(self.reconstruction).map_err(Error::Usage)?;
        let measured = self.places()?.read()?;
        for note in &measured.notes {
            terminal::warn(note);
        }
        let start = Instant::now();
        let (mut image, report) = self.solve(&measured)?;
        let seconds = start.elapsed().as_secs_f64();
        if let Some(direct) = &measured.direct {
            image.data_mut().iter_mut().zip(direct.data()).for_each(|(v, d)| *v += d);
        }
        if self.clamp {
            image.data_mut().iter_mut().for_each(|v| *v = v.max(0.0));
        }
        let unwritable = |fault: &dyn std::fmt::Display| Error::Failed(format!("{}: {fault}", self.output.display()));
        let mut bytes = Cursor::new(Vec::new());
        let metadata = exr::Metadata {
            reconstruction: self.reconstruction.name().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            ..exr::Metadata::default()
        };
        exr::write(&mut bytes, &exr::Layers { image: &image, named: Vec::new() }, &metadata).map_err(|fault| unwritable(&fault))?;
        output.exr.write(&bytes.into_inner())?;
        output.png.write(&png::encode(&image, 1.0).map_err(|fault| unwritable(&fault))?)?;
        self.tell(&image, &report, measured.variance.is_some(), seconds)
    }

    fn places(&self) -> Result<Places, Error> {
        let named = match (&self.name, &self.primal, &self.dx, &self.dy) {
            (Some(name), ..) => Places::named(name)?,
            (None, Some(primal), Some(dx), Some(dy)) => {
                Places { primal: primal.clone(), dx: dx.clone(), dy: dy.clone(), direct: None, variance: None, features: None }
            }
            _ => return Err(Error::Usage("expected a name, or --primal, --dx and --dy".to_owned())),
        };
        Ok(Places {
            direct: self.direct.clone().or(named.direct),
            variance: self.variance.clone().or(named.variance),
            features: self.features.clone().or(named.features),
            ..named
        })
    }

    fn solve(&self, measured: &Measured) -> Result<(Image, SolveReport), Error> {
        let mut m = Measurements::new(&measured.primal, &measured.dx, &measured.dy);
        m.variance = measured.variance.as_ref().map(|[primal, dx, dy]| Variance { primal, dx, dy });
        m.features = measured.features.as_ref();
        reconstruction::solve(&m, self.reconstruction, self.alpha).map_err(|fault| Error::Usage(fault.to_string()))
    }

    fn tell(&self, image: &Image, report: &SolveReport, by_noise: bool, seconds: f64) -> Result<(), Error> {
        let extent = image.extent();
        let because = match (self.alpha, by_noise) {
            (Some(_), _) => "asked for",
            (None, true) => "by the noise of primal and gradients",
            (None, false) => "the usual one: nothing tells of noise",
        };
        if self.json {
            return terminal::json(&json!({
                "width": extent.width,
                "height": extent.height,
                "reconstruction": self.reconstruction.name(),
                "alpha": report.alpha,
                "alpha_because": because,
                "clamped": self.clamp,
                "iterations": report.iterations,
                "residual": report.residual,
                "seconds": seconds,
                "output": self.output.display().to_string(),
            }));
        }
        terminal::line(format_args!("film            {} × {} pixels", extent.width, extent.height))?;
        terminal::line(format_args!("reconstruction  {}", self.reconstruction.name()))?;
        terminal::line(format_args!("alpha           {} ({because})", report.alpha))?;
        if report.iterations > 0 {
            terminal::line(format_args!("iterations      {}", report.iterations))?;
            terminal::line(format_args!("residual        {:.2e}", report.residual))?;
        }
        if self.clamp {
            terminal::line("clamped         negative values are zero, which biases the image")?;
        }
        terminal::line(format_args!("time            {seconds:.3} s"))?;
        terminal::line(format_args!("written         {}", self.output.display()))
    }
}
