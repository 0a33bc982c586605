//! Where a light lies and which way it shines, for one light or many.

use crate::geometry::Bounds;
use crate::math::{PI, Vec3, safe_sqrt};

/// A box around lights, a cone around the normals of their surfaces, and how far from a normal light leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach {
    /// Box around everything that shines.
    pub(crate) bounds: Bounds,
    /// Unit axis of the cone of normals.
    pub(crate) axis: Vec3,
    /// Half angle of that cone, θₒ [rad]; π holds all directions.
    pub(crate) spread: f32,
    /// Angle from a normal past which no light leaves, θₑ [rad].
    pub(crate) falloff: f32,
    /// Radiant intensity in the direction that gets most [W·sr⁻¹], channels averaged, summed over the lights; > 0.
    pub(crate) intensity: f32,
}

impl Reach {
    /// Of lights that shine anywhere.
    pub(crate) fn everywhere(bounds: Bounds, intensity: f32) -> Self {
        Self { bounds, axis: Vec3::Z, spread: PI, falloff: 0.5 * PI, intensity }
    }

    /// Of both.
    pub(crate) fn union(&self, other: &Reach) -> Self {
        let (axis, spread) = cone(self, other);
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            spread,
            falloff: self.falloff.max(other.falloff),
            intensity: self.intensity + other.intensity,
        }
    }

    /// Measure of the directions that light leaves in, as in surface area heuristics the area of a box is.
    ///
    /// # Source
    /// Conty Estevez and Kulla 2018, equation 1.
    pub(crate) fn orientation(&self) -> f32 {
        let (sin, cos) = libm::sincosf(self.spread);
        let edge = (self.spread + self.falloff).min(PI);
        2.0 * PI * (1.0 - cos) + 0.5 * PI * (2.0 * edge * sin - libm::cosf(self.spread - 2.0 * edge) - 2.0 * self.spread * sin + cos)
    }
}

/// The smallest cone around two.
fn cone(a: &Reach, b: &Reach) -> (Vec3, f32) {
    let (wide, narrow) = if a.spread >= b.spread { (a, b) } else { (b, a) };
    let apart = libm::acosf(wide.axis.dot(narrow.axis).clamp(-1.0, 1.0));
    if apart + narrow.spread <= wide.spread {
        return (wide.axis, wide.spread);
    }
    let spread = 0.5 * (wide.spread + narrow.spread + apart);
    let aside = (narrow.axis - wide.axis * wide.axis.dot(narrow.axis)).normalize_or_zero();
    if spread >= PI || aside == Vec3::ZERO {
        return (wide.axis, PI);
    }
    let (sin, cos) = libm::sincosf(spread - wide.spread);
    ((wide.axis * cos + aside * sin).normalize(), spread)
}

/// What choosing between lights reads of a [`Reach`], angles as sines and cosines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Importance {
    centre: Vec3,
    radius2: f32,
    axis: Vec3,
    spread: [f32; 2],
    cos_falloff: f32,
    intensity: f32,
}

/// Room for rounding in cosines: what shines is never taken for dark.
const SLACK: f32 = 1e-3;

impl From<&Reach> for Importance {
    fn from(reach: &Reach) -> Self {
        let radius = reach.bounds.radius();
        let (sin, cos) = libm::sincosf(reach.spread);
        Self {
            centre: reach.bounds.centre(),
            radius2: radius * radius,
            axis: reach.axis,
            spread: [sin.max(0.0), cos],
            cos_falloff: libm::cosf(reach.falloff),
            intensity: reach.intensity,
        }
    }
}

impl Importance {
    /// About what the lights can send to a point, up to a constant; 0 only where none of them shines. It is continuous in the point, so
    /// that rounding in a position never changes a probability by much.
    ///
    /// # Source
    /// Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", PACM CGIT 1(2), 2018, equation 3,
    /// without the receiver's normal: density is asked again for offset vertices, of which only the position is known. Angles are
    /// subtracted by their sines and cosines as in Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 12.6.3.
    #[inline]
    pub(crate) fn at(&self, from: Vec3) -> f32 {
        let away = from - self.centre;
        let distance2 = away.length_squared();
        let weight = self.intensity / distance2.max(self.radius2).max(f32::MIN_POSITIVE);
        if distance2 == 0.0 {
            return weight;
        }
        let cos = (away.dot(self.axis) / distance2.sqrt()).clamp(-1.0, 1.0);
        let sin2 = (self.radius2 / distance2).min(1.0);
        let ball = [sin2.sqrt(), safe_sqrt(1.0 - sin2)];
        let [_, cos] = less(less([safe_sqrt(1.0 - cos * cos), cos], self.spread), ball);
        // From 1 where some normal may point at the place to 0 where light stops.
        let share = ((cos - self.cos_falloff + SLACK) / (1.0 - self.cos_falloff + SLACK)).max(0.0);
        if distance2 < self.radius2 {
            // Inside the ball around the lights any of them may shine, the more surely the deeper.
            let depth = 1.0 - distance2 / self.radius2;
            return weight * (depth + (1.0 - depth) * share);
        }
        weight * share
    }
}

/// Sine and cosine of max(a − b, 0), for angles in [0, π].
#[inline]
fn less([sin_a, cos_a]: [f32; 2], [sin_b, cos_b]: [f32; 2]) -> [f32; 2] {
    if cos_a > cos_b { [0.0, 1.0] } else { [(sin_a * cos_b - cos_a * sin_b).max(0.0), cos_a * cos_b + sin_a * sin_b] }
}
