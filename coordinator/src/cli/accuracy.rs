//! `gradfarm accuracy`: what accuracy cost in a frame, and what more of it would cost; and the words for it that others use, too.

use std::path::{Path, PathBuf};

use reqwest::Method;

use super::client::ServerOption;
use super::error::Error;
use super::files::FrameTarget;
use super::terminal;
use crate::api::json::{Accuracy, AccuracyPoint};
use crate::plot::{self, number};
use crate::service::AccuracyView;

/// Arguments of `gradfarm accuracy`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Of a job that was submitted with --error, --seconds or --curve there are several points; of any other there is one, once it is done.

Examples:
  gradfarm accuracy 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11
  gradfarm accuracy 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 -o curve.svg
  gradfarm accuracy 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11 --json | jq .prices")]
pub(super) struct AccuracyCommand {
    /// The job, as `submit` and `status` name it
    job: String,
    /// Which frame
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u32,
    /// Write the curve to this file: a plot if its name ends in .svg, numbers if it ends in .json
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print one JSON object instead
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl AccuracyCommand {
    /// Asks the coordinator, writes the file and prints.
    pub(super) async fn run(self) -> Result<(), Error> {
        let output = self.output.as_deref().map(CurveTarget::check).transpose()?;
        let client = self.server.client()?;
        let path = format!("/jobs/{}/frames/{}/accuracy", self.job, self.frame);
        let accuracy: Accuracy = client.get(&path).await?;
        match &output {
            Some(CurveTarget::Svg(target)) => {
                let response = client.send(client.request(Method::GET, &format!("{path}.svg"))).await?;
                target.write(self.frame, &client.bytes(response).await?)?;
            }
            Some(CurveTarget::Json(target)) => target.write(self.frame, &encoded(&accuracy)?)?,
            None => {}
        }
        if self.json {
            return terminal::json(&accuracy);
        }
        if accuracy.points.is_empty() {
            return terminal::line(format_args!("frame {} is {}: its error was not measured yet", accuracy.frame, accuracy.state));
        }
        terminal::line(format_args!("{:>9}  {:>10}  {:>10}  {:>9}  95 % interval", "samples", "wall [s]", "cpu [s]", "relMSE"))?;
        for point in &accuracy.points {
            let AccuracyPoint { samples, cpu_seconds, wall_seconds, error, .. } = point;
            let interval = format!("{:.2e} to {:.2e}", error.low, error.high);
            terminal::line(format_args!("{samples:>9}  {wall_seconds:>10.2}  {cpu_seconds:>10.2}  {:>9.2e}  {interval}", error.relmse))?;
        }
        lines(&accuracy).into_iter().try_for_each(terminal::line)
    }
}

/// A file for the curve, or one for that of each frame.
#[derive(Clone, Debug)]
pub(super) enum CurveTarget {
    /// The plot.
    Svg(FrameTarget),
    /// The numbers.
    Json(FrameTarget),
}

impl CurveTarget {
    /// Checks that the file may be written, and which form is wanted.
    ///
    /// # Errors
    /// [`Error::Usage`] as [`FrameTarget::check`], and for any other name than `.svg` and `.json`.
    pub(super) fn check(path: &Path) -> Result<Self, Error> {
        match path.extension().map(|extension| extension.to_ascii_lowercase()) {
            Some(extension) if extension == "svg" => Ok(Self::Svg(FrameTarget::check(path)?)),
            Some(extension) if extension == "json" => Ok(Self::Json(FrameTarget::check(path)?)),
            _ => Err(Error::Usage(format!("{} should end in .svg for a plot, or in .json for numbers", path.display()))),
        }
    }

    /// Checks that there is a file for each of so many frames.
    ///
    /// # Errors
    /// As [`FrameTarget::check_count`].
    pub(super) fn check_count(&self, count: u32) -> Result<(), Error> {
        match self {
            Self::Svg(target) | Self::Json(target) => target.check_count(count),
        }
    }

    /// Writes what is known.
    ///
    /// # Errors
    /// If there is nothing to plot, or the file cannot be written.
    pub(super) fn write(&self, view: &AccuracyView) -> Result<(), Error> {
        match self {
            Self::Json(target) => target.write(view.frame, &encoded(&Accuracy::from(view))?),
            Self::Svg(target) => {
                let plot = plot::accuracy(&view.name, view.frame, &view.curve, &view.stop).to_svg();
                target.write(view.frame, plot.map_err(|fault| Error::Failed(fault.to_string()))?.as_bytes())
            }
        }
    }
}

fn encoded(accuracy: &Accuracy) -> Result<Vec<u8>, Error> {
    let mut text = serde_json::to_vec_pretty(accuracy).map_err(|fault| Error::Failed(fault.to_string()))?;
    text.push(b'\n');
    Ok(text)
}

/// What there is to say about a frame's accuracy: how good it is, whether that is what was asked, and what more would cost.
pub(super) fn lines(accuracy: &Accuracy) -> Vec<String> {
    let Some(last) = accuracy.points.last() else { return Vec::new() };
    let mut lines = vec![measured(last)];
    lines.extend(outcome(accuracy));
    let prices: Vec<String> =
        accuracy.prices.iter().map(|price| format!("{} costs {}", number(price.relmse), seconds(price.seconds))).collect();
    let halving = accuracy.next_halving.map(|price| format!("the next halving costs {} more", seconds(price.seconds)));
    let slope = accuracy.fit.map(|fit| format!("relMSE falls as samples^{:.2}", fit.slope));
    let told: Vec<String> = prices.into_iter().chain(halving).chain(slope.filter(|_| accuracy.points.len() > 1)).collect();
    if !told.is_empty() {
        lines.push(format!("relMSE {}", told.join("; ")).replace("; relMSE falls", "; it falls"));
    }
    lines
}

/// A point in words.
pub(super) fn measured(point: &AccuracyPoint) -> String {
    let (error, samples) = (point.error, point.samples);
    format!("estimated relMSE {:.2e} ({:.2e} to {:.2e}) with {samples} samples per pixel", error.relmse, error.low, error.high)
}

/// Whether the frame is what was asked for; nothing if no error was asked for.
fn outcome(accuracy: &Accuracy) -> Option<String> {
    let (target, reached) = (accuracy.target?, accuracy.reached?);
    let target = number(target);
    if reached {
        return Some(format!("the error asked for, {target}, is reached"));
    }
    let why = match accuracy.stopped.as_deref() {
        Some("seconds") => "the time was up",
        Some(_) => "all samples were used",
        None => "the frame is not finished",
    };
    let more = accuracy.to_target.filter(|price| price.samples >= 1.0).map_or_else(String::new, |price| {
        format!("; by the law it takes {} more ({} samples per pixel more)", seconds(price.seconds), number(price.samples.ceil()))
    });
    Some(format!("the error asked for, {target}, is NOT reached: {why}{more}"))
}

/// A time for people.
pub(super) fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{} s", number((s * 100.0).round() / 100.0)),
        s if s < 6000.0 => format!("{:.0} s", s),
        s if s < 360_000.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::accuracy::{Curve, Estimate, Point, Reason, Stop};

    use crate::job::FrameState;

    fn view(target: f64, stopped: Option<Reason>) -> AccuracyView {
        let point = |samples: u32| {
            let (n, relmse) = (f64::from(samples), 4.0 / f64::from(samples));
            let error = Estimate { relmse, low: 0.9 * relmse, high: 1.1 * relmse };
            Point { samples, cpu_seconds: n, wall_seconds: 0.1 * n, check_seconds: 0.0, error }
        };
        AccuracyView {
            name: "door".into(),
            frame: 0,
            state: FrameState::Done,
            stop: Stop { error: Some(target), ..Stop::default() },
            most_samples: 1000,
            expected_samples: 256,
            stopped,
            curve: Curve::of([32, 64, 256].map(point).to_vec()),
        }
    }

    #[test]
    fn it_says_how_far_it_got() {
        let reached = lines(&Accuracy::from(&view(0.02, Some(Reason::Error)))).join("\n");
        assert!(reached.contains("1.56e-2 (1.41e-2 to 1.72e-2) with 256 samples") && reached.contains("0.02, is reached"), "{reached}");
        assert!(reached.contains("relMSE 0.1 costs 4 s; 0.01 costs 40 s") && reached.contains("halving costs 25.6 s more"), "{reached}");
        let short = lines(&Accuracy::from(&view(0.01, Some(Reason::Seconds)))).join("\n");
        assert!(short.contains("NOT reached: the time was up; by the law it takes 14.4 s more (144 samples"), "{short}");
        let short = lines(&Accuracy::from(&view(0.01, Some(Reason::Samples)))).join("\n");
        assert!(short.contains("all samples were used"), "{short}");
    }

    #[test]
    fn curves_are_plots_or_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let fault = CurveTarget::check(&folder.path().join("curve.png")).unwrap_err().to_string();
        assert!(fault.contains("end in .svg"), "{fault}");
        for (name, part) in [("a.svg", "<svg"), ("a.JSON", "\"slope\"")] {
            let path = folder.path().join(name);
            CurveTarget::check(&path).unwrap().write(&view(0.01, None)).unwrap();
            assert!(std::fs::read_to_string(path).unwrap().contains(part));
        }
    }
}
