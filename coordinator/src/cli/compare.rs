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
        let (a, b) = (image.extent(), reference.extent());
        if a != b {
            let (image, reference) = (self.image.display(), self.reference.display());
            return Err(Error::Usage(format!(
                "images differ in size: {image} is {} × {}, {reference} is {} × {}",
                a.width, a.height, b.width, b.height
            )));
        }
        let relmse = metrics::rel_mse(&image, &reference);
        let rmse = metrics::rmse(&image, &reference);
        let mean_error = metrics::mean_error(&image, &reference);
        let flip = metrics::flip(&image, &reference);
        if self.json {
            return terminal::json(&json!({
                "relmse": relmse,
                "rmse": rmse,
                "mean_error": mean_error,
                "flip": flip,
                "width": a.width,
                "height": a.height,
            }));
        }
        terminal::line(format_args!("relMSE      {relmse:.6e}"))?;
        terminal::line(format_args!("RMSE        {rmse:.6e}"))?;
        terminal::line(format_args!("mean error  {mean_error:+.6e}"))?;
        terminal::line(format_args!("FLIP        {flip:.6}"))
    }
}

fn read(path: &Path) -> Result<Image, Error> {
    exr::read_rgb(path).map_err(|fault| Error::Usage(format!("{}: {fault}", path.display())))
}
