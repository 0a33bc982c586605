//! The plot of a frame: error against seconds, the law through it, the target, and prices.

use gradfarm_core::accuracy::{Curve, Stop};

use super::{Level, Mark, Plot, Series, Stroke, number};

/// Shortest time on the axis [s].
const SHORTEST: f64 = 1e-3;
/// How far beyond the last point prices are marked, as a ratio of seconds.
const REACH: f64 = 30.0;

/// What is known of a frame's accuracy, for people. Without a point the plot is empty.
pub fn accuracy(name: &str, frame: u32, curve: &Curve, stop: &Stop) -> Plot {
    let points: Vec<(f64, &gradfarm_core::accuracy::Point)> =
        curve.seconds().map(|seconds| seconds.max(SHORTEST)).zip(&curve.points).collect();
    let measured = Series {
        name: "measured, with 95 % interval".to_owned(),
        points: points.iter().map(|(seconds, point)| (*seconds, point.error.relmse)).collect(),
        band: points.iter().map(|(seconds, point)| (*seconds, point.error.low, point.error.high)).collect(),
        stroke: Stroke::Line,
        colour: Some(0),
    };
    let last = points.last().map_or(SHORTEST, |(seconds, _)| *seconds);
    let mut marks: Vec<Mark> = curve
        .prices()
        .into_iter()
        .map(|price| Mark { x: price.seconds, y: price.relmse, text: format!("{}: {} s", number(price.relmse), number(price.seconds)) })
        .collect();
    if let (Some(halving), Some(cost), Some(point)) = (curve.next_halving(), curve.cost, curve.last()) {
        let x = cost.seconds_at(f64::from(point.samples) + halving.samples);
        marks.push(Mark { x, y: halving.relmse, text: format!("half of it: {} s more", number(halving.seconds)) });
    }
    marks.retain(|mark| mark.x <= last * REACH && mark.x >= SHORTEST);
    let law = law(curve, marks.iter().map(|mark| mark.x).fold(last, f64::max));
    let levels = stop.error.map(|target| Level { name: format!("target {}", number(target)), y: target });
    Plot {
        title: format!("{name}, frame {frame}: what accuracy costs"),
        x: "wall-clock time with one reconstruction [s]".to_owned(),
        y: "estimated relMSE [1]".to_owned(),
        series: std::iter::once(measured).chain(law).collect(),
        levels: levels.into_iter().collect(),
        marks,
    }
}

/// The law from the first point on, up to so many seconds.
fn law(curve: &Curve, until: f64) -> Option<Series> {
    let (fit, cost, first) = (curve.fit?, curve.cost?, curve.points.first()?);
    let from = f64::from(first.samples);
    let to = ((until - cost.fixed) / cost.each).max(from * 1.5);
    // The law is straight in samples, and bends in seconds where there is a fixed cost.
    let steps = 32;
    let samples = (0..=steps).map(|step| from * (to / from).powf(f64::from(step) / f64::from(steps)));
    let points = samples.map(|n| (cost.seconds_at(n).max(SHORTEST), fit.relmse_at(n))).collect();
    let name = format!("law: relMSE ∝ samples^{:.2}", fit.slope);
    Some(Series { name, points, stroke: Stroke::Dashed, colour: Some(1), ..Series::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::accuracy::{Estimate, Point};

    #[test]
    fn target_law_and_prices_are_told() {
        let point = |samples: u32| {
            let (n, relmse) = (f64::from(samples), 4.0 / f64::from(samples));
            let error = Estimate { relmse, low: 0.8 * relmse, high: 1.2 * relmse };
            Point { samples, cpu_seconds: n, wall_seconds: 0.1 * n, check_seconds: 0.0, error }
        };
        let curve = Curve::of([32, 64, 128, 256].map(point).to_vec());
        let stop = Stop { error: Some(0.01), ..Stop::default() };
        let svg = accuracy("door", 3, &curve, &stop).to_svg().unwrap();
        for part in ["door, frame 3", "target 0.01", "samples^-1.00", "0.1: 4 s", "0.01: 40 s", "half of it: 25.6 s more", "95 % interval"]
        {
            assert!(svg.contains(part), "{part} is missing from {svg}");
        }
        assert!(accuracy("door", 3, &Curve::of(Vec::new()), &stop).to_svg().is_err());
    }
}
