//! The laws through the points: error falls as a power of the samples, cost rises in proportion to them.

use super::Point;

/// Error against samples: relMSE = exp(`intercept`) · samples^`slope`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Natural logarithm of the error at one sample per pixel.
    pub intercept: f64,
    /// Exponent, < 0. −1 where the error is variance alone; flatter where bias takes part.
    pub slope: f64,
}

impl Fit {
    /// The slope that is expected before anything was measured: variance falls as 1/n.
    const EXPECTED: f64 = -1.0;
    /// How far from it slopes usually lie, one standard deviation.
    const SPREAD: f64 = 0.15;
    /// Standard deviation of ln(relMSE) below which no point is trusted: points share samples with those before.
    const LEAST: f64 = 0.02;
    /// Slopes beyond these are taken for noise.
    const RANGE: (f64, f64) = (-1.5, -0.1);

    /// The line through the logarithms, by least squares weighted with the points' intervals and the slope's expectation: one point
    /// is enough. `None` without a point whose error is above 0.
    pub fn of(points: &[Point]) -> Option<Self> {
        let usable = points.iter().filter(|point| point.is_sound() && point.error.relmse > 0.0);
        let rows: Vec<[f64; 3]> = usable.map(|p| [weight(p), libm::log(f64::from(p.samples)), libm::log(p.error.relmse)]).collect();
        let all: f64 = rows.iter().map(|[w, ..]| w).sum();
        if all <= 0.0 {
            return None;
        }
        let mean = |k: usize| rows.iter().map(|row| row[0] * row[k]).sum::<f64>() / all;
        let (x, y) = (mean(1), mean(2));
        let belief = 1.0 / (Self::SPREAD * Self::SPREAD);
        let across: f64 = rows.iter().map(|[w, a, b]| w * (a - x) * (b - y)).sum();
        let along: f64 = rows.iter().map(|[w, a, _]| w * (a - x) * (a - x)).sum();
        let slope = ((across + belief * Self::EXPECTED) / (along + belief)).clamp(Self::RANGE.0, Self::RANGE.1);
        Some(Self { intercept: y - slope * x, slope })
    }

    /// The error at so many samples per pixel, > 0.
    pub fn relmse_at(&self, samples: f64) -> f64 {
        libm::exp(self.intercept + self.slope * libm::log(samples))
    }

    /// Samples per pixel for an error > 0.
    pub fn samples_for(&self, relmse: f64) -> f64 {
        libm::exp((libm::log(relmse) - self.intercept) / self.slope)
    }
}

/// One over the variance of ln(relMSE), as the interval tells it.
fn weight(point: &Point) -> f64 {
    let error = point.error;
    let spread = if error.low > 0.0 { libm::log(error.high / error.low) / (2.0 * 1.96) } else { error.high / error.relmse / 1.96 };
    let spread = if spread.is_finite() { spread.max(Fit::LEAST) } else { 1.0 };
    1.0 / (spread * spread)
}

/// Seconds against samples, with one reconstruction and no check on the way: `fixed` + `each` · samples per pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// What it takes however few the samples are: start-up and reconstruction [s].
    pub fixed: f64,
    /// What a further sample of every pixel takes [s].
    pub each: f64,
    /// Tracing alone, summed over threads, for a sample of every pixel [s].
    pub cpu_each: f64,
}

impl Cost {
    /// From the first point and the last one. `None` without any.
    pub fn of(points: &[Point]) -> Option<Self> {
        let mut checks = 0.0;
        let mut spans = Vec::with_capacity(points.len());
        for point in points.iter().filter(|point| point.is_sound()) {
            spans.push((f64::from(point.samples), point.wall_seconds - checks, point.cpu_seconds));
            checks += point.check_seconds;
        }
        let ((n, wall, cpu), (first, earlier, _)) = (*spans.last()?, *spans.first()?);
        let each = if n > first { (wall - earlier) / (n - first) } else { 0.0 };
        // Clocks jump, and workers come and go: the mean is always there.
        let each = if each > 0.0 { each.min(wall / n) } else { wall / n };
        Some(Self { fixed: (wall - each * n).max(0.0), each, cpu_each: cpu / n })
    }

    /// Wall-clock time for so many samples per pixel [s].
    pub fn seconds_at(&self, samples: f64) -> f64 {
        self.fixed + self.each * samples
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::Estimate;
    use super::*;

    /// A point on relmse = scale · n^slope, with an interval of ± `spread`.
    pub(crate) fn point(samples: u32, scale: f64, slope: f64, spread: f64) -> Point {
        let relmse = scale * libm::pow(f64::from(samples), slope);
        let seconds = 0.5 + 0.1 * f64::from(samples);
        Point {
            samples,
            cpu_seconds: 0.2 * f64::from(samples),
            wall_seconds: seconds,
            check_seconds: 0.0,
            error: Estimate { relmse, low: relmse * (1.0 - spread), high: relmse * (1.0 + spread) },
        }
    }

    #[test]
    fn a_power_law_is_found_again() {
        let points: Vec<Point> = [32, 64, 128, 512, 4096].map(|n| point(n, 3.0, -0.8, 0.03)).to_vec();
        let fit = Fit::of(&points).unwrap();
        assert!((fit.slope + 0.8).abs() < 0.01, "{fit:?}");
        assert!((fit.relmse_at(1000.0) / points[0].error.relmse - libm::pow(1000.0 / 32.0, -0.8)).abs() < 0.01);
        assert!((fit.samples_for(fit.relmse_at(700.0)) - 700.0).abs() < 1e-6);
    }

    #[test]
    fn one_point_is_carried_on_as_variance_falls() {
        let fit = Fit::of(&[point(64, 1.0, -1.0, 0.5)]).unwrap();
        assert_eq!(fit.slope, -1.0);
        assert!((fit.samples_for(1.0 / 256.0) - 256.0).abs() < 1e-6);
    }

    #[test]
    fn noise_does_not_turn_the_slope_around() {
        let with = |error| Point { error, ..point(64, 1.0, -1.0, 0.8) };
        let worse = [point(32, 1.0, -1.0, 0.8), with(Estimate { relmse: 0.9, low: 0.1, high: 2.0 })];
        assert!(Fit::of(&worse).unwrap().slope < -0.5);
        assert_eq!(Fit::of(&[]), None);
        assert_eq!(Fit::of(&[with(Estimate { relmse: 0.0, low: 0.0, high: 0.0 })]), None);
        assert_eq!(Fit::of(&[with(Estimate { relmse: f64::NAN, low: 0.0, high: 0.0 })]), None);
    }

    #[test]
    fn checks_on_the_way_are_not_part_of_the_price() {
        let mut points = [32, 64, 128].map(|n| point(n, 1.0, -1.0, 0.1));
        let plain = Cost::of(&points).unwrap();
        assert!((plain.each - 0.1).abs() < 1e-9 && (plain.fixed - 0.5).abs() < 1e-9 && (plain.cpu_each - 0.2).abs() < 1e-9);
        // The same with two seconds for every check, of which all but the last one are extra.
        for (before, point) in points.iter_mut().enumerate() {
            point.check_seconds = 2.0;
            point.wall_seconds += 2.0 * (before as f64 + 1.0);
        }
        let checked = Cost::of(&points).unwrap();
        assert!((checked.each - plain.each).abs() < 1e-9 && (checked.fixed - 2.5).abs() < 1e-9, "{checked:?}");
    }
}
