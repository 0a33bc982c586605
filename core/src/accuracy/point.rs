//! One point of the curve, and the rule by which a frame stops.

/// An image's error, as far as it can be told without a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Estimated relMSE [1].
    pub relmse: f64,
    /// Lower end of its 95 % confidence interval [1].
    pub low: f64,
    /// Upper end of it [1].
    pub high: f64,
}

impl Estimate {
    /// Whether all of its numbers can be reckoned with.
    pub fn is_sound(&self) -> bool {
        [self.relmse, self.low, self.high].into_iter().all(|value| value.is_finite() && value >= 0.0)
    }

    /// What the error stays below in nine of ten cases. The interval leaves out one in forty above itself, on a logarithmic scale.
    pub fn bound(&self) -> f64 {
        // Quantiles of the normal distribution at 90 and at 97.5 %.
        let share = 1.281_552 / 1.959_964;
        if self.relmse > 0.0 { self.relmse * libm::exp(share * libm::log(self.high / self.relmse)) } else { self.high }
    }
}

/// The error of a frame's image at so many samples, and what it took to get there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples per pixel, ≥ 1.
    pub samples: u32,
    /// Time spent tracing, summed over threads [s].
    pub cpu_seconds: f64,
    /// From the frame's first lease until this image was there [s].
    pub wall_seconds: f64,
    /// Part of `wall_seconds` in which results were added up, and the image was reconstructed and judged [s].
    pub check_seconds: f64,
    /// The image's error.
    pub error: Estimate,
}

impl Point {
    /// Whether all of its numbers can be reckoned with.
    pub fn is_sound(&self) -> bool {
        let seconds = [self.cpu_seconds, self.wall_seconds, self.check_seconds];
        self.samples > 0 && self.error.is_sound() && seconds.into_iter().all(|value| value.is_finite() && value >= 0.0)
    }
}

/// When a frame stops: as soon as one of these is met, and at the plan's samples in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Estimated relMSE to reach, > 0.
    pub error: Option<f64>,
    /// Wall-clock time from the frame's first lease until its image is there, > 0 [s].
    pub seconds: Option<f64>,
    /// Whether the error is measured on the way even if nothing depends on it.
    pub curve: bool,
}

impl Stop {
    /// At what bound of the error a frame may stop, as a multiple of the target.
    pub const SURE: f64 = 1.3;

    /// Whether the error is measured while the frame is being rendered.
    pub fn has_checks(&self) -> bool {
        self.curve || self.ends_early()
    }

    /// Whether a frame may end before it has the plan's samples.
    pub fn ends_early(&self) -> bool {
        self.error.is_some() || self.seconds.is_some()
    }

    /// Whether a point is good enough: the estimate is at the target or below, and its bound not far above.
    pub fn is_met_by(&self, point: &Point) -> bool {
        self.error.is_some_and(|target| point.is_sound() && point.error.relmse <= target && point.error.bound() <= Self::SURE * target)
    }
}
