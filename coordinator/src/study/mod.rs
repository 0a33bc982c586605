//! Studies: what was measured of methods on scenes, and what follows from it. No rendering happens here.
//!
//! `mod` holds the measurements and their laws, `table` writes them as text, `pictures` makes images of images, `page` is the HTML.

pub mod page;
pub mod pictures;
pub mod table;

use serde::Serialize;

/// Everything that one call of `gradfarm study` found.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Version of gradfarm.
    pub version: String,
    /// The command line.
    pub command: String,
    /// Processor and number of threads.
    pub machine: String,
    /// Scene by scene.
    pub scenes: Vec<SceneStudy>,
}

/// One scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneStudy {
    /// Its name.
    pub name: String,
    /// Size of its images [pixels].
    pub width: u32,
    /// The same.
    pub height: u32,
    /// Where the reference came from.
    pub reference: String,
    /// Estimated relMSE of the reference itself, where it was rendered here.
    pub reference_relmse: Option<f64>,
    /// Method by method; the first is what the others are compared with.
    pub methods: Vec<MethodStudy>,
}

/// One method on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct MethodStudy {
    /// Its name, such as `gpt+l2`.
    pub name: String,
    /// By budget, from the least on.
    pub points: Vec<Measured>,
}

/// A method at one budget of time.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// What it was given [s].
    pub budget: f64,
    /// One run for each seed.
    pub runs: Vec<Run>,
}

/// One render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Seed of its random numbers.
    pub seed: u64,
    /// Samples per pixel.
    pub samples: u32,
    /// Tracing on all threads, adding up and reconstruction [s].
    pub seconds: f64,
    /// Against the reference.
    pub relmse: f64,
    /// HDR-FLIP against the reference, 0 to 1.
    pub flip: f64,
    /// What the render itself told, where it could.
    pub estimated_relmse: Option<f64>,
}

impl Measured {
    fn mean(&self, value: impl Fn(&Run) -> f64) -> f64 {
        self.runs.iter().map(value).sum::<f64>() / self.runs.len().max(1) as f64
    }

    /// Mean time [s].
    pub fn seconds(&self) -> f64 {
        self.mean(|run| run.seconds)
    }

    /// Mean relMSE.
    pub fn relmse(&self) -> f64 {
        self.mean(|run| run.relmse)
    }

    /// Mean HDR-FLIP.
    pub fn flip(&self) -> f64 {
        self.mean(|run| run.flip)
    }

    /// Mean number of samples per pixel.
    pub fn samples(&self) -> f64 {
        self.mean(|run| f64::from(run.samples))
    }

    /// Least and largest relMSE of the seeds.
    pub fn range(&self) -> [f64; 2] {
        self.runs.iter().fold([f64::INFINITY, 0.0], |[low, high], run| [run.relmse.min(low), run.relmse.max(high)])
    }

    /// Error times time: what stays the same while an unbiased method goes on.
    fn work(&self) -> f64 {
        self.relmse() * self.seconds()
    }
}

/// relMSE = `level` · seconds ^ `slope`, by least squares over the logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// −1 for unbiased methods whose time is all tracing.
    pub slope: f64,
    /// relMSE at one second.
    pub level: f64,
}

impl Law {
    /// The time to an error [s]. `None` if the error does not fall.
    pub fn seconds_for(&self, relmse: f64) -> Option<f64> {
        (self.slope < 0.0).then(|| (relmse / self.level).powf(1.0 / self.slope))
    }
}

/// How much sooner a method gets somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sooner {
    /// So many times.
    pub times: f64,
    /// Or more: its least budget was already enough.
    pub at_least: bool,
}

impl std::fmt::Display for Sooner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{:.1}×", if self.at_least { "≥ " } else { "" }, self.times)
    }
}

impl MethodStudy {
    /// The law of its errors; `None` for fewer than two budgets.
    pub fn law(&self) -> Option<Law> {
        let points: Vec<(f64, f64)> = self.points.iter().map(|point| (point.seconds().ln(), point.relmse().ln())).collect();
        if points.len() < 2 || points.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
            return None;
        }
        let n = points.len() as f64;
        let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
        let (mut across, mut along) = (0.0, 0.0);
        for point in &points {
            across += (point.0 - x) * (point.1 - y);
            along += (point.0 - x) * (point.0 - x);
        }
        (along > 0.0).then(|| {
            let slope = across / along;
            Law { slope, level: (y - slope * x).exp() }
        })
    }

    /// How many times smaller the error is than that of `base` at the same time, at one of the budgets. Renders do not take quite the
    /// time that they are given, so errors are first brought to one time by the law of unbiased estimates, error × time = constant.
    pub fn equal_time(&self, base: &MethodStudy, budget: usize) -> Option<f64> {
        let ratio = base.points.get(budget)?.work() / self.points.get(budget)?.work();
        ratio.is_finite().then_some(ratio)
    }

    /// How many times sooner than `base` it reaches the error that `base` has at the end, by its law; a lower bound where its least budget
    /// is already enough.
    pub fn equal_error(&self, base: &MethodStudy) -> Option<Sooner> {
        let (first, last) = (self.points.first()?, base.points.last()?);
        let seconds = match self.law() {
            Some(law) => law.seconds_for(last.relmse())?,
            None => last.seconds() / self.equal_time(base, base.points.len() - 1)?,
        };
        let at_least = self.points.len() > 1 && seconds < first.seconds();
        Some(Sooner { times: last.seconds() / if at_least { first.seconds() } else { seconds }, at_least })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A method whose error times time is `work` at each budget, with seeds a tenth above and below.
    pub(crate) fn method(name: &str, work: f64, slope: f64) -> MethodStudy {
        let point = |budget: f64| {
            let run = |seed: u64, factor: f64| Run {
                seed,
                samples: (10.0 * budget) as u32,
                seconds: budget,
                relmse: factor * work * budget.powf(slope),
                flip: 0.1 / budget,
                estimated_relmse: Some(work / budget),
            };
            Measured { budget, runs: vec![run(0, 0.9), run(1, 1.1)] }
        };
        MethodStudy { name: name.to_owned(), points: [1.0, 2.0, 4.0].map(point).to_vec() }
    }

    #[test]
    fn laws_and_ratios() {
        let (base, better) = (method("pt", 1.0, -1.0), method("gpt+l2", 0.2, -1.0));
        let law = base.law().unwrap();
        assert!((law.slope + 1.0).abs() < 1e-12 && (law.level - 1.0).abs() < 1e-12);
        assert!((law.seconds_for(0.01).unwrap() - 100.0).abs() < 1e-9);
        for budget in 0..3 {
            assert!((better.equal_time(&base, budget).unwrap() - 5.0).abs() < 1e-12);
        }
        assert_eq!(better.equal_time(&base, 3), None);
        // At one second it is already below what the base has after four.
        assert_eq!(better.equal_error(&base).unwrap(), Sooner { times: 4.0, at_least: true });
        let half = method("gpt+l1", 0.5, -1.0).equal_error(&base).unwrap();
        assert!((half.times - 2.0).abs() < 1e-9 && !half.at_least);
        // A method that is ahead at first and stands still: it reaches the error of the base at 4 s where 0.3 = 0.25.
        let biased = method("nfor", 0.3, -0.1);
        let seconds = (0.25f64 / 0.3).powf(-10.0);
        assert!((biased.equal_error(&base).unwrap().times - 4.0 / seconds).abs() < 1e-9);
        assert_eq!(method("stuck", 1.0, 0.1).law().unwrap().seconds_for(0.1), None);
    }

    #[test]
    fn a_single_budget_has_no_law_but_a_ratio() {
        let single = |work| MethodStudy { points: method("m", work, -1.0).points[..1].to_vec(), ..method("m", work, -1.0) };
        assert_eq!(single(1.0).law(), None);
        assert!((single(0.5).equal_error(&single(1.0)).unwrap().times - 2.0).abs() < 1e-12);
        assert_eq!(single(1.0).points[0].range(), [0.9, 1.1]);
    }
}
