//! The JSON shape of a frame's accuracy: what it cost, and what more of it would cost.

use gradfarm_core::accuracy::{Estimate, Point, Price};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::json::ErrorEstimate;
use crate::service::AccuracyView;

/// The error of a frame against samples and seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Accuracy {
    /// Frame number.
    pub frame: u32,
    /// `waiting`, `rendering`, `assembling` or `done`.
    pub state: String,
    /// The relMSE to reach.
    pub target: Option<f64>,
    /// The wall-clock time that the frame may take [s].
    pub seconds: Option<f64>,
    /// Most samples per pixel.
    pub most_samples: u32,
    /// With how many samples per pixel it will stop, as far as one can tell.
    pub expected_samples: u32,
    /// Why it stopped, where it might have gone on: `error`, `seconds` or `samples`.
    pub stopped: Option<String>,
    /// Whether the last point is as good as was asked; absent if no error was asked for.
    pub reached: Option<bool>,
    /// What was measured, by samples.
    pub points: Vec<AccuracyPoint>,
    /// Error against samples: relmse = exp(intercept) · samples^slope.
    pub fit: Option<AccuracyFit>,
    /// Seconds against samples.
    pub cost: Option<AccuracyCost>,
    /// What the powers of ten of relMSE cost from the beginning.
    pub prices: Vec<AccuracyPrice>,
    /// What half of the present error costs on top of what was spent.
    pub next_halving: Option<AccuracyPrice>,
    /// What the target costs on top of what was spent.
    pub to_target: Option<AccuracyPrice>,
}

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccuracyPoint {
    /// Samples per pixel.
    pub samples: u32,
    /// Time spent tracing, summed over threads [s].
    pub cpu_seconds: f64,
    /// From the frame's first lease until this image was there, with the checks before it [s].
    pub wall_seconds: f64,
    /// Part of that in which this image was added up, reconstructed and judged [s].
    pub check_seconds: f64,
    /// The error with its interval.
    #[serde(flatten)]
    pub error: ErrorEstimate,
}

/// The law of the error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccuracyFit {
    /// Natural logarithm of the relMSE at one sample.
    pub intercept: f64,
    /// Exponent.
    pub slope: f64,
}

/// The law of the cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccuracyCost {
    /// However few the samples are [s].
    pub fixed_seconds: f64,
    /// For a further sample of every pixel [s].
    pub seconds_per_sample: f64,
    /// The same in time spent tracing, summed over threads [s].
    pub cpu_seconds_per_sample: f64,
}

/// What an error costs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccuracyPrice {
    /// The error.
    pub relmse: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// Wall-clock time, with one reconstruction where it counts from the beginning [s].
    pub seconds: f64,
    /// Time spent tracing, summed over threads [s].
    pub cpu_seconds: f64,
}

impl From<Estimate> for ErrorEstimate {
    fn from(Estimate { relmse, low, high }: Estimate) -> Self {
        Self { relmse, low, high }
    }
}

impl From<ErrorEstimate> for Estimate {
    fn from(ErrorEstimate { relmse, low, high }: ErrorEstimate) -> Self {
        Self { relmse, low, high }
    }
}

impl From<Point> for AccuracyPoint {
    fn from(point: Point) -> Self {
        Self {
            samples: point.samples,
            cpu_seconds: point.cpu_seconds,
            wall_seconds: point.wall_seconds,
            check_seconds: point.check_seconds,
            error: point.error.into(),
        }
    }
}

impl From<Price> for AccuracyPrice {
    fn from(Price { relmse, samples, seconds, cpu_seconds }: Price) -> Self {
        Self { relmse, samples, seconds, cpu_seconds }
    }
}

impl From<&AccuracyView> for Accuracy {
    fn from(view: &AccuracyView) -> Self {
        let curve = &view.curve;
        Self {
            frame: view.frame,
            state: view.state.name().to_owned(),
            target: view.stop.error,
            seconds: view.stop.seconds,
            most_samples: view.most_samples,
            expected_samples: view.expected_samples,
            stopped: view.stopped.map(|reason| reason.name().to_owned()),
            reached: view.stop.error.zip(curve.last()).map(|(_, last)| view.stop.is_met_by(last)),
            points: curve.points.iter().copied().map(Into::into).collect(),
            fit: curve.fit.map(|fit| AccuracyFit { intercept: fit.intercept, slope: fit.slope }),
            cost: curve.cost.map(|cost| AccuracyCost {
                fixed_seconds: cost.fixed,
                seconds_per_sample: cost.each,
                cpu_seconds_per_sample: cost.cpu_each,
            }),
            prices: curve.prices().into_iter().map(Into::into).collect(),
            next_halving: curve.next_halving().map(Into::into),
            to_target: view.stop.error.and_then(|target| curve.on_top(target)).map(Into::into),
        }
    }
}
