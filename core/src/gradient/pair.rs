//! The one formula for base and offset.
//!
//! A path x of pixel i, found by strategy t with density pₜ(x), and its shift y = T(x) in pixel j. With the balance heuristic
//! over all strategies s and over both directions of the shift,
//!
//! ```text
//! w = pₜ(x) / D,   D = Σₛ pₛ(x) + |T′(x)| Σₛ pₛ(y),
//! w · (fⱼ(y) |T′(x)| − fᵢ(x)) / pₜ(x) = (fⱼ(y) |T′(x)| − fᵢ(x)) / D:
//! ```
//!
//! the density of the strategy at hand cancels. All densities share the factor p(x₀ … xₖ) of the base path up to the joint, so
//! they are kept relative to it: the offset's by the running ratio ρ = p(y₀ … yₖ) |T′| / p(x₀ … xₖ), never by separate products.

use crate::path::Passage;
use crate::spectrum::Spectrum;

/// Base and offset path at the same vertex, relative to the base path's density up to there.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Throughput of the base path: f / p.
    pub base: Spectrum,
    /// Throughput of the offset path over the *base* path's density: f |T′| / p.
    pub offset: Spectrum,
    /// ρ: density of the offset path times |T′| over that of the base path [1].
    pub ratio: f64,
}

impl Pair {
    /// Before anything differs: both paths weigh the same.
    pub const START: Pair = Pair { base: Spectrum::WHITE, offset: Spectrum::WHITE, ratio: 1.0 };

    /// At the end of the camera's legs.
    #[inline]
    pub fn start(base: &Passage, offset: &Passage) -> Pair {
        Pair { base: base.weight(), offset: offset.value / base.density, ratio: f64::from(offset.density) / f64::from(base.density) }
    }

    /// The weighted difference, offset minus base, of a joint.
    ///
    /// `base` and `offset` are (value, density) of the joint on either path, densities summed over the strategies that compete for it.
    #[inline]
    pub fn difference(&self, base: (Spectrum, f64), offset: (Spectrum, f64), jacobian: f64) -> Spectrum {
        let denominator = base.1 + self.ratio * jacobian * offset.1;
        if denominator <= 0.0 {
            return Spectrum::BLACK;
        }
        (self.offset * offset.0 * (jacobian as f32) - self.base * base.0) * ((1.0 / denominator) as f32)
    }

    /// The weighted difference of everything beyond a vertex that both paths share, given its radiance estimate.
    #[inline]
    pub fn shared(&self, radiance: Spectrum) -> Spectrum {
        (self.offset - self.base) * radiance * ((1.0 / (1.0 + self.ratio)) as f32)
    }

    /// Weight of the base path: 1 / (1 + ρ).
    #[inline]
    pub fn weight(&self) -> f64 {
        1.0 / (1.0 + self.ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_both_directions_add_up_to_one() {
        for ratio in [1e-12, 0.3, 1.0, 7.0, 1e12] {
            let there = Pair { ratio, ..Pair::START };
            let back = Pair { ratio: 1.0 / ratio, ..Pair::START };
            assert!((there.weight() + back.weight() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_failed_shift_counts_with_weight_one() {
        let failed = Pair { base: Spectrum::grey(2.0), offset: Spectrum::BLACK, ratio: 0.0 };
        assert_eq!(failed.shared(Spectrum::grey(3.0)).to_rgb(), [-6.0; 3]);
        let d = failed.difference((Spectrum::grey(3.0), 0.5), (Spectrum::grey(9.0), 4.0), 2.0);
        assert_eq!(d.to_rgb(), [-12.0; 3]);
    }
}
