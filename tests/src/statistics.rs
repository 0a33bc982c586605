//! Statistics for tests of Monte Carlo estimates: how far apart two estimates may lie before chance no longer explains it.
//!
//! A test states a *significance level*: the probability with which correct code fails it. Seeds are fixed, so a test that
//! passes once passes always; the level says how much luck that took. Where many values are tested at once, the level of each
//! is corrected for their number after Šidák, which holds for independent values and is on the safe side for positively
//! correlated ones.

use libm::{erfc, exp, expm1, lgamma, log, log1p};

/// A mean with the variance of that mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Estimated variance of the mean, ≥ 0.
    pub variance: f64,
    /// Degrees of freedom of `variance`; infinite where it is known exactly.
    pub freedom: f64,
}

impl Estimate {
    /// A value known exactly.
    pub fn exact(mean: f64) -> Self {
        Self { mean, variance: 0.0, freedom: f64::INFINITY }
    }

    /// A mean whose standard error is taken as known.
    pub fn known(mean: f64, standard_error: f64) -> Self {
        Self { mean, variance: standard_error * standard_error, freedom: f64::INFINITY }
    }

    /// From independent measurements of equal weight, at least two.
    pub fn of(measurements: &[f64]) -> Self {
        let n = measurements.len() as f64;
        let mean = measurements.iter().sum::<f64>() / n;
        let squares: f64 = measurements.iter().map(|m| (m - mean) * (m - mean)).sum();
        Self { mean, variance: squares / (n * (n - 1.0)), freedom: n - 1.0 }
    }

    /// Their difference over its standard error, with its degrees of freedom after Welch and Satterthwaite.
    /// `None` where neither estimate varies.
    pub fn t(&self, other: &Self) -> Option<(f64, f64)> {
        let variance = self.variance + other.variance;
        if variance <= 0.0 {
            return None;
        }
        let share = |e: &Self| e.variance * e.variance / e.freedom;
        let freedom = variance * variance / (share(self) + share(other));
        Some(((self.mean - other.mean) / variance.sqrt(), freedom))
    }
}

/// What a comparison of many pairs of estimates found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Pairs that vary.
    pub pairs: usize,
    /// Largest |t|.
    pub worst: f64,
    /// Its place in the list.
    pub place: usize,
    /// Smallest probability of a |t| as large by chance, before correction [1].
    pub chance: f64,
    /// Mean of t: a common shift of all pairs shows here first.
    pub mean: f64,
    /// Mean of t²: about 1 where the variances are right.
    pub mean_square: f64,
    /// Largest |difference| between pairs that do not vary.
    pub still: f64,
}

impl Comparison {
    /// Compares pairs of independent estimates.
    pub fn of(pairs: impl IntoIterator<Item = (Estimate, Estimate)>) -> Self {
        let mut out = Self { chance: 1.0, ..Self::default() };
        for (place, (a, b)) in pairs.into_iter().enumerate() {
            let Some((t, freedom)) = a.t(&b) else {
                out.still = out.still.max((a.mean - b.mean).abs());
                continue;
            };
            out.pairs += 1;
            out.mean += t;
            out.mean_square += t * t;
            let chance = student_tail(t, freedom);
            if chance < out.chance {
                (out.chance, out.worst, out.place) = (chance, t.abs(), place);
            }
        }
        let n = out.pairs.max(1) as f64;
        out.mean /= n;
        out.mean_square /= n;
        out
    }

    /// Whether chance explains every pair at this significance level over all of them together.
    pub fn agrees(&self, level: f64) -> bool {
        self.chance >= sidak(level, self.pairs)
    }
}

/// Level of each of `tests` independent tests such that all together keep `level`.
///
/// # Source
/// Šidák, "Rectangular confidence regions for the means of multivariate normal distributions", JASA 62, 1967.
pub fn sidak(level: f64, tests: usize) -> f64 {
    -expm1(log1p(-level) / tests.max(1) as f64)
}

/// Probability of |z| at least this large for a standard normal variable.
pub fn normal_tail(z: f64) -> f64 {
    erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// Probability of |t| at least this large for Student's distribution with `freedom` degrees, which may be fractional or infinite.
pub fn student_tail(t: f64, freedom: f64) -> f64 {
    if freedom > 1e7 { normal_tail(t) } else { incomplete_beta(freedom / 2.0, 0.5, freedom / (freedom + t * t)) }
}

/// Probability of a χ² at least this large with `freedom` degrees.
pub fn chi_square_tail(chi_square: f64, freedom: f64) -> f64 {
    upper_gamma(freedom / 2.0, chi_square / 2.0)
}

/// The |z| that a standard normal variable exceeds with this probability.
pub fn normal_bound(level: f64) -> f64 {
    bound(level, normal_tail)
}

/// The |t| that Student's distribution exceeds with this probability.
pub fn student_bound(level: f64, freedom: f64) -> f64 {
    bound(level, |t| student_tail(t, freedom))
}

/// The χ² that is exceeded with this probability.
pub fn chi_square_bound(level: f64, freedom: f64) -> f64 {
    bound(level, |x| chi_square_tail(x, freedom))
}

/// Solves `tail(x) = level` for a tail that falls from 1 at x = 0, to f64 precision.
fn bound(level: f64, tail: impl Fn(f64) -> f64) -> f64 {
    let mut high = 1.0;
    while tail(high) > level && high < 1e12 {
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if tail(middle) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Regularised incomplete beta function Iₓ(a, b), a, b > 0, 0 ≤ x ≤ 1, by its continued fraction (DLMF 8.17.22), on the side where it converges fast.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log1p(-x)) / a;
    let coefficient = |k: usize| {
        let m = (k / 2) as f64;
        if k.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        }
    };
    front / continued_fraction(1.0, |k| (coefficient(k), 1.0))
}

/// Regularised upper incomplete gamma function Q(a, x), a > 0, x ≥ 0.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = exp(a * log(x) - x - lgamma(a));
    if x < a + 1.0 {
        // DLMF 8.11.4, a series of positive terms.
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for n in 1..10_000 {
            term *= x / (a + f64::from(n));
            sum += term;
            if term < sum * 1e-17 {
                break;
            }
        }
        return 1.0 - front * sum;
    }
    // DLMF 8.9.2.
    front / continued_fraction(x + 1.0 - a, |k| (-(k as f64) * (k as f64 - a), x + 2.0 * k as f64 + 1.0 - a))
}

/// b₀ + a₁/(b₁ + a₂/(b₂ + …)) by Lentz's method as modified by Thompson and Barnett.
fn continued_fraction(b0: f64, term: impl Fn(usize) -> (f64, f64)) -> f64 {
    let floor = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut value = floor(b0);
    let (mut c, mut d) = (value, 0.0);
    for k in 1..100_000 {
        let (a, b) = term(k);
        d = 1.0 / floor(b + a * d);
        c = floor(b + a / c);
        value *= c * d;
        if (c * d - 1.0).abs() < 1e-16 {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
    }

    #[test]
    fn tails_have_their_tabulated_values() {
        close(normal_tail(1.959_963_984_540_054), 0.05, 1e-12);
        close(normal_bound(1e-3), 3.290_526_731_491_895, 1e-10);
        // Student: t(0.975; 10) = 2.228138852, Cauchy at 1, and the closed form for two degrees.
        close(student_bound(0.05, 10.0), 2.228_138_851_964_939, 1e-9);
        close(student_tail(1.0, 1.0), 0.5, 1e-12);
        close(student_tail(3.0, 2.0), 1.0 - 3.0 / (2.0f64 + 9.0).sqrt(), 1e-10);
        close(student_tail(2.0, 1e6), normal_tail(2.0), 1e-5);
        // χ²: exponential for two degrees, the square of a normal for one, and a table value.
        close(chi_square_tail(7.0, 2.0), exp(-3.5), 1e-12);
        close(chi_square_tail(4.0, 1.0), normal_tail(2.0), 1e-10);
        close(chi_square_bound(0.05, 10.0), 18.307_038_053_275_146, 1e-9);
        close(chi_square_tail(100.0, 100.0), 0.481_191_7, 1e-6);
    }

    #[test]
    fn corrected_levels_add_up() {
        let each = sidak(1e-3, 500);
        close(1.0 - (1.0 - each).powi(500), 1e-3, 1e-9);
        close(sidak(1e-3, 1), 1e-3, 1e-12);
    }

    #[test]
    fn estimates_know_their_spread() {
        let a = Estimate::of(&[1.0, 2.0, 3.0, 4.0]);
        close(a.mean, 2.5, 1e-15);
        close(a.variance, 5.0 / 12.0, 1e-15);
        let (t, freedom) = a.t(&Estimate::exact(2.0)).unwrap();
        close(t, 0.5 / (5.0f64 / 12.0).sqrt(), 1e-12);
        close(freedom, 3.0, 1e-12);
        assert_eq!(Estimate::exact(1.0).t(&Estimate::exact(2.0)), None);
    }

    #[test]
    fn comparisons_tell_chance_from_bias() {
        // 12 sums of uniform numbers from a Weyl sequence stand in for noise: their spread is about 1.
        let noise = |k: usize| (0..12).map(|i| ((k * 12 + i) as f64 * 0.618_033_988_749_895).fract()).sum::<f64>() - 6.0;
        let pair = |k: usize, bias: f64| (Estimate::known(noise(k) + bias, 1.0), Estimate::exact(0.0));
        assert!(Comparison::of((0..400).map(|k| pair(k, 0.0))).agrees(1e-3));
        let biased = Comparison::of((0..400).map(|k| pair(k, if k == 7 { 8.0 } else { 0.0 })));
        assert!(!biased.agrees(1e-3) && biased.place == 7);
        assert_eq!(Comparison::of([(Estimate::exact(1.0), Estimate::exact(1.5))]).still, 0.5);
    }
}
