//! A smooth function of the cosine of a direction.

/// Nodes: evenly spaced in √cosθ, since albedos change fastest near the horizon.
const NODES: usize = 16;

/// A tabulated function of cosθ in [0, 1], interpolated by Catmull–Rom cubics in √cosθ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Profile([f32; NODES]);

impl Profile {
    /// Tabulates `f`.
    pub(in super::super) fn new(f: impl Fn(f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| {
            let t = i as f32 / (NODES - 1) as f32;
            f((t * t).max(1e-6))
        }))
    }

    /// (1 − t) · a + t · b.
    #[inline]
    pub(in super::super) fn mix(a: &Self, b: &Self, t: f32) -> Self {
        Self(std::array::from_fn(|i| a.0[i] + (b.0[i] - a.0[i]) * t))
    }

    /// The value at cosθ.
    #[inline]
    pub(in super::super) fn at(&self, cos: f32) -> f32 {
        let last = NODES - 1;
        let x = cos.abs().min(1.0).sqrt() * last as f32;
        let i = (x as usize).min(last - 1);
        let t = x - i as f32;
        let v = &self.0;
        let (b, c) = (v[i], v[i + 1]);
        // Beyond the ends the line through the last two nodes goes on.
        let a = if i == 0 { 2.0 * b - c } else { v[i - 1] };
        let d = if i + 2 > last { 2.0 * c - b } else { v[i + 2] };
        b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
    }

    /// The mean over a hemisphere, weighted by the cosine: 2 ∫ f(μ) μ dμ.
    pub(in super::super) fn mean(&self) -> f32 {
        let n = 256;
        let sum: f64 = (0..n)
            .map(|i| {
                let t = (i as f32 + 0.5) / n as f32;
                f64::from(self.at(t * t) * 4.0 * t * t * t)
            })
            .sum();
        (sum / f64::from(n)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_functions_survive() {
        // Fresnel-like: steep at the horizon.
        let f = |mu: f32| 0.04 + 0.96 * (1.0 - mu).powi(5);
        let profile = Profile::new(f);
        for k in 0..=1000 {
            let mu = k as f32 / 1000.0;
            assert!((profile.at(mu) - f(mu)).abs() < 4e-3, "{mu}: {} against {}", profile.at(mu), f(mu));
        }
        assert!((profile.mean() - (0.04 + 0.96 * 2.0 / 42.0)).abs() < 5e-4, "{}", profile.mean());
        assert!((Profile::new(|_| 0.7).mean() - 0.7).abs() < 1e-4);
    }
}
