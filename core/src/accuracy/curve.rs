//! What the points of a frame say about prices.

use super::{Cost, Fit, Point};

/// The points of a frame with the laws through them.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The points, by their samples.
    pub points: Vec<Point>,
    /// Error against samples; `None` where no error could be told.
    pub fit: Option<Fit>,
    /// Seconds against samples; `None` without points.
    pub cost: Option<Cost>,
}

/// What an error costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Price {
    /// The error, as relMSE [1].
    pub relmse: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// Wall-clock time, with the reconstruction [s].
    pub seconds: f64,
    /// Time spent tracing, summed over threads [s].
    pub cpu_seconds: f64,
}

impl Curve {
    /// Decades below the best point that still get a price: further on the law is a guess.
    const BEYOND: i32 = 1;

    /// The curve through these points, sorted by their samples.
    pub fn of(mut points: Vec<Point>) -> Self {
        points.sort_by_key(|point| point.samples);
        let (fit, cost) = (Fit::of(&points), Cost::of(&points));
        Self { points, fit, cost }
    }

    /// The best that there is.
    pub fn last(&self) -> Option<&Point> {
        self.points.last()
    }

    /// For each point what it would have taken alone, without the checks before it [s].
    pub fn seconds(&self) -> impl Iterator<Item = f64> {
        self.points.iter().scan(0.0, |checks, point| {
            let own = (point.wall_seconds - *checks).max(0.0);
            *checks += point.check_seconds;
            Some(own)
        })
    }

    /// What an error > 0 costs from the beginning. `None` where there is no fit.
    pub fn price(&self, relmse: f64) -> Option<Price> {
        let (fit, cost) = (self.fit?, self.cost?);
        let samples = fit.samples_for(relmse);
        let price = Price { relmse, samples, seconds: cost.seconds_at(samples), cpu_seconds: cost.cpu_each * samples };
        (samples.is_finite() && price.seconds.is_finite()).then_some(price)
    }

    /// Prices of the powers of ten from the first point's error to one decade below the last one's, largest error first.
    pub fn prices(&self) -> Vec<Price> {
        let Some(fit) = self.fit else { return Vec::new() };
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return Vec::new() };
        let decade = |samples: u32| libm::log10(fit.relmse_at(f64::from(samples)));
        let (from, to) = (libm::floor(decade(first.samples)) as i32, libm::floor(decade(last.samples)) as i32 - Self::BEYOND);
        (to..=from).rev().filter_map(|exponent| self.price(libm::pow(10.0, f64::from(exponent)))).collect()
    }

    /// What half of the present error costs *on top* of what was spent: the difference of two prices. Its `relmse` is that half.
    pub fn next_halving(&self) -> Option<Price> {
        let now = self.fit?.relmse_at(f64::from(self.last()?.samples));
        self.on_top(0.5 * now)
    }

    /// What it costs to get from here to an error, on top of what was spent; nothing if the law says that it is reached.
    pub fn on_top(&self, relmse: f64) -> Option<Price> {
        let (price, cost) = (self.price(relmse)?, self.cost?);
        let more = (price.samples - f64::from(self.last()?.samples)).max(0.0);
        Some(Price { relmse, samples: more, seconds: cost.each * more, cpu_seconds: cost.cpu_each * more })
    }
}

#[cfg(test)]
mod tests {
    use super::super::fit::tests::point;
    use super::*;

    #[test]
    fn prices_follow_the_laws() {
        let curve = Curve::of([256, 16, 64].map(|n| point(n, 1.0, -1.0, 0.05)).to_vec());
        assert!(curve.seconds().zip([2.1, 6.9, 26.1]).all(|(found, expected)| (found - expected).abs() < 1e-9));
        assert_eq!(curve.last().unwrap().samples, 256);
        let price = curve.price(0.01).unwrap();
        assert!((price.samples - 100.0).abs() < 1e-6 && (price.seconds - 10.5).abs() < 1e-6 && (price.cpu_seconds - 20.0).abs() < 1e-6);
        // Errors from 1/16 to 1/256: decades 10⁻² and 10⁻³, and one beyond.
        let decades: Vec<f64> = curve.prices().iter().map(|price| libm::log10(price.relmse)).collect();
        assert!(decades.iter().zip([-2.0, -3.0, -4.0]).all(|(found, expected)| (found - expected).abs() < 1e-9), "{decades:?}");
        let halving = curve.next_halving().unwrap();
        assert!((halving.samples - 256.0).abs() < 1e-6 && (halving.seconds - 25.6).abs() < 1e-6, "{halving:?}");
        assert!((halving.relmse - 1.0 / 512.0).abs() < 1e-12);
        assert_eq!(curve.on_top(0.5).unwrap().seconds, 0.0);
    }

    #[test]
    fn nothing_measured_costs_nobody_knows_what() {
        let curve = Curve::of(Vec::new());
        assert!(curve.prices().is_empty() && curve.next_halving().is_none() && curve.price(0.1).is_none());
    }
}
