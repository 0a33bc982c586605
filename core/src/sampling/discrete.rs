//! Discrete distributions by cumulative sums.

/// Picks an index with probability proportional to its weight, and gives the number back for reuse.
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    cumulative: Vec<f32>,
    probability: Vec<f32>,
}

impl Discrete {
    /// From weights ≥ 0. `None` if there are none, or one is not finite, or all are zero.
    pub fn new(weights: &[f32]) -> Option<Self> {
        if weights.iter().any(|w| !w.is_finite() || *w < 0.0) {
            return None;
        }
        let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        if total <= 0.0 {
            return None;
        }
        let mut running = 0.0;
        let mut cumulative = Vec::with_capacity(weights.len());
        let mut probability = Vec::with_capacity(weights.len());
        for weight in weights {
            running += f64::from(*weight);
            cumulative.push((running / total) as f32);
            probability.push((f64::from(*weight) / total) as f32);
        }
        Some(Self { cumulative, probability })
    }

    /// The index chosen by `u` in [0, 1), its probability, and what is left of `u`, again uniform in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        if self.probability.len() == 1 {
            return (0, 1.0, u);
        }
        let mut index = self.cumulative.partition_point(|c| *c <= u).min(self.cumulative.len() - 1);
        // Rounding may leave u beyond the last weight that is not zero.
        while self.probability[index] == 0.0 && index > 0 {
            index -= 1;
        }
        let before = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let width = self.cumulative[index] - before;
        let rest = if width > 0.0 { ((u - before) / width).clamp(0.0, 1.0 - f32::EPSILON) } else { 0.5 };
        (index, self.probability[index], rest)
    }

    /// Probability of an index.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        self.probability[index]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_match_probabilities() {
        let d = Discrete::new(&[1.0, 0.0, 3.0]).unwrap();
        let mut counts = [0u32; 3];
        for k in 0..4000 {
            let (i, p, rest) = d.sample((k as f32 + 0.5) / 4000.0);
            counts[i] += 1;
            assert_eq!(p, d.probability(i));
            assert!((0.0..1.0).contains(&rest));
        }
        assert_eq!(counts, [1000, 0, 3000]);
        assert!(Discrete::new(&[0.0]).is_none());
        assert!(Discrete::new(&[f32::NAN]).is_none());
    }
}
