//! `gradfarm compare`: how far one image is from another.

use std::path::{Path, PathBuf};

use gradfarm_core::film::Image;
use gradfarm_core::metrics;
use gradfarm_core::output::exr;
use serde_json::json;

use super::error::Error;
use super::terminal;

/// Arguments of `gradfarm compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Measures:
  relMSE      mean over pixels and channels of (A − B)² / (grey(B)² + 0.001), nothing clamped
  RMSE        square root of the mean squared difference
  mean error  mean of A − B: how much brighter A is as a whole
  FLIP        mean perceived difference, 0 to 1, as seen when one flips between the two images

Examples:
  gradfarm compare cornell.exr reference.exr
  gradfarm compare cornell.exr reference.exr --json | jq .relmse")]
pub(super) struct Compare {
    /// The image to judge (EXR; its default layer is read)
    #[arg(value_name = "A.exr")]
    image: PathBuf,
    /// The reference (EXR of the same size)
    #[arg(value_name = "B.exr")]
    reference: PathBuf,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

impl Compare {
    /// Reads both images and prints the measures.
    pub(super) fn run(&self) -> Result<(), Error> {
        let image = read(&self.image)?;
        let reference = read(&self.reference)?;
        let measure = |measure: fn(&Image, &Image) -> Result<f64, metrics::MetricError>| {
            let differ = |fault| Error::Usage(format!("{} and {}: {fault}", self.image.display(), self.reference.display()));
            measure(&image, &reference).map_err(differ)
        };
        let relmse = measure(metrics::rel_mse)?;
        let rmse = measure(metrics::rmse)?;
        let mean_error = measure(metrics::mean_error)?;
        let flip = measure(metrics::flip)?;
        let extent = image.extent();
        if self.json {
            return terminal::json(&json!({
                "relmse": relmse,
                "rmse": rmse,
                "mean_error": mean_error,
                "flip": flip,
                "width": extent.width,
                "height": extent.height,
            }));
        }
        terminal::line(format_args!("relMSE      {relmse:.6e}"))?;
        terminal::line(format_args!("RMSE        {rmse:.6e}"))?;
        terminal::line(format_args!("mean error  {mean_error:+.6e}"))?;
        terminal::line(format_args!("FLIP        {flip:.6}"))
    }
}

fn read(path: &Path) -> Result<Image, Error> {
    let unreadable = |fault: &dyn std::fmt::Display| Error::Usage(format!("{}: {fault}", path.display()));
    let bytes = std::fs::read(path).map_err(|fault| unreadable(&fault))?;
    exr::read_rgb(&bytes).map_err(|fault| unreadable(&fault))
}
