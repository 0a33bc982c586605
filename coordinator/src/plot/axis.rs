//! A logarithmic axis with few and round numbers, however long it is.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::number;

/// An axis from one number above 0 to a larger one.
#[derive(Clone, Debug)]
pub(super) struct Logarithmic {
    from: f64,
    to: f64,
}

impl Logarithmic {
    /// Least span, as a ratio: so that a single point has room.
    const SPAN: f64 = 4.0;
    /// Free room at both ends, as a ratio.
    const ROOM: f64 = 1.15;

    /// An axis that holds these numbers; `None` if none of them is above 0.
    pub(super) fn over(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut from, mut to) = (f64::INFINITY, 0.0f64);
        for value in values.filter(|value| has_logarithm(*value)) {
            (from, to) = (from.min(value), to.max(value));
        }
        if to <= 0.0 {
            return None;
        }
        let lacking = (Self::SPAN / (to / from)).max(1.0).sqrt() * Self::ROOM;
        Some(Self { from: from / lacking, to: to * lacking })
    }

    /// Its lower end.
    pub(super) fn from(&self) -> f64 {
        self.from
    }

    /// Its upper end.
    pub(super) fn to(&self) -> f64 {
        self.to
    }

    /// Round numbers on it: with each decade these multiples of it.
    fn round(&self, multiples: &[f64]) -> Vec<f64> {
        let decades = (self.from.log10().floor() as i32)..=(self.to.log10().ceil() as i32);
        let all = decades.flat_map(|exponent| multiples.iter().map(move |m| m * 10f64.powi(exponent)));
        all.filter(|value| (self.from..=self.to).contains(value)).collect()
    }
}

/// Whether a number can be on a logarithmic axis.
pub(super) fn has_logarithm(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

impl Ranged for Logarithmic {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let place = (value.max(self.from * 1e-3) / self.from).ln() / (self.to / self.from).ln();
        first + (place * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let most = hint.max_num_points().max(2);
        let choices: [&[f64]; 4] = [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
        let fitting = choices.iter().map(|multiples| self.round(multiples)).find(|points| (2..=most).contains(&points.len()));
        fitting.unwrap_or_else(|| {
            // So many decades that not each of them can be named, or so short a span that round numbers are rare.
            let decades = self.round(&[1.0]);
            if decades.len() > most {
                decades.iter().copied().step_by(decades.len().div_ceil(most)).collect()
            } else {
                self.round(choices[0])
            }
        })
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

impl ValueFormatter<f64> for Logarithmic {
    fn format(value: &f64) -> String {
        number(*value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::coord::ranged1d::BoldPoints;

    #[test]
    fn every_axis_has_a_few_round_numbers() {
        for (from, to) in [(1.0, 1.0), (3.0, 40.0), (0.011, 0.012), (1e-7, 1e3), (1e-12, 1e12), (900.0, 1100.0)] {
            let axis = Logarithmic::over([from, to].into_iter()).unwrap();
            let points = axis.key_points(BoldPoints(8));
            assert!((1..=8).contains(&points.len()), "{from} to {to}: {points:?}");
            assert!(axis.map(&from, (0, 1000)) > 0 && axis.map(&to, (0, 1000)) < 1000);
        }
        assert!(Logarithmic::over([0.0, -1.0, f64::NAN].into_iter()).is_none());
    }
}
