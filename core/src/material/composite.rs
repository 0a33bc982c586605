//! Materials made of others: mixed, one for each side, or with a bent shading normal.

use super::bsdf::{Evaluation, Scatter};
use super::lobe::split;
use super::relief::{Relief, Surface};
use super::{Bsdf, Material};
use crate::math::Vec3;
use crate::spectrum::Spectrum;
use crate::texture::{ScalarInput, TexturePoint};

/// A material made of others.
#[derive(Clone, Debug, PartialEq)]
pub enum Composite {
    /// Each scatters its share of the light.
    Blend {
        /// Where the weight is 0.
        first: Material,
        /// Where the weight is 1.
        second: Material,
        /// Share of the second.
        weight: ScalarInput,
    },
    /// One on each side; the back's sees the surface mirrored, as if it were the front. Neither may transmit.
    TwoSided {
        /// Seen from the front.
        front: Material,
        /// Seen from the back.
        back: Material,
    },
    /// With a shading normal that a relief bends, when a path's vertex is made: directions are already those of the bent frame.
    Bent {
        /// What lies on the relief.
        material: Material,
        /// The relief.
        relief: Relief,
    },
}

#[inline]
fn share(weight: &ScalarInput, at: &TexturePoint) -> f32 {
    weight.at(at).clamp(0.0, 1.0)
}

#[inline]
fn mix(a: Evaluation, b: Evaluation, t: f32) -> Evaluation {
    Evaluation { value: a.value * (1.0 - t) + b.value * t, density: a.density * (1.0 - t) + b.density * t }
}

#[inline]
fn mirrored(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}

impl Composite {
    pub(super) fn evaluate(&self, at: &TexturePoint, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Composite::Blend { first, second, weight } => mix(first.evaluate(at, wo, wi), second.evaluate(at, wo, wi), share(weight, at)),
            Composite::TwoSided { front, .. } if wo.z > 0.0 => front.evaluate(at, wo, wi),
            Composite::TwoSided { back, .. } => back.evaluate(at, mirrored(wo), mirrored(wi)),
            Composite::Bent { material, .. } => material.evaluate(at, wo, wi),
        }
    }

    pub(super) fn evaluate_delta(&self, at: &TexturePoint, wo: Vec3, transmits: bool) -> Evaluation {
        match self {
            Composite::Blend { first, second, weight } => {
                mix(first.evaluate_delta(at, wo, transmits), second.evaluate_delta(at, wo, transmits), share(weight, at))
            }
            Composite::TwoSided { front, .. } if wo.z > 0.0 => front.evaluate_delta(at, wo, transmits),
            Composite::TwoSided { back, .. } => back.evaluate_delta(at, mirrored(wo), transmits),
            Composite::Bent { material, .. } => material.evaluate_delta(at, wo, transmits),
        }
    }

    pub(super) fn delta_probability(&self, at: &TexturePoint, wo: Vec3) -> f32 {
        match self {
            Composite::Blend { first, second, weight } => {
                let t = share(weight, at);
                first.delta_probability(at, wo) * (1.0 - t) + second.delta_probability(at, wo) * t
            }
            Composite::TwoSided { front, .. } if wo.z > 0.0 => front.delta_probability(at, wo),
            Composite::TwoSided { back, .. } => back.delta_probability(at, mirrored(wo)),
            Composite::Bent { material, .. } => material.delta_probability(at, wo),
        }
    }

    pub(super) fn sample(&self, at: &TexturePoint, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        match self {
            Composite::Blend { first, second, weight } => {
                let scatter = blended(first, second, share(weight, at), at, wo, choice, u)?;
                let evaluation =
                    if scatter.delta { self.evaluate_delta(at, wo, wo.z * scatter.wi.z < 0.0) } else { self.evaluate(at, wo, scatter.wi) };
                (evaluation.density > 0.0).then_some(Scatter { evaluation, ..scatter })
            }
            Composite::TwoSided { front, .. } if wo.z > 0.0 => front.sample(at, wo, choice, u),
            Composite::TwoSided { back, .. } => {
                let scatter = back.sample(at, mirrored(wo), choice, u)?;
                Some(Scatter { wi: mirrored(scatter.wi), ..scatter })
            }
            Composite::Bent { material, .. } => material.sample(at, wo, choice, u),
        }
    }

    pub(super) fn roughness(&self, at: &TexturePoint) -> f32 {
        match self {
            Composite::Blend { first, second, weight } => match share(weight, at) {
                0.0 => first.roughness(at),
                1.0 => second.roughness(at),
                _ => sharper(first.roughness(at), second.roughness(at)),
            },
            Composite::TwoSided { front, back } => sharper(front.roughness(at), back.roughness(at)),
            Composite::Bent { material, .. } => material.roughness(at),
        }
    }

    pub(super) fn relative_ior(&self, at: &TexturePoint, wo: Vec3) -> f32 {
        match self {
            Composite::Blend { first, second, .. } => {
                let ior = first.relative_ior(at, wo);
                if ior == 1.0 { second.relative_ior(at, wo) } else { ior }
            }
            // Neither side lets light pass.
            Composite::TwoSided { .. } => 1.0,
            Composite::Bent { material, .. } => material.relative_ior(at, wo),
        }
    }

    pub(super) fn albedo(&self, at: &TexturePoint) -> Spectrum {
        match self {
            Composite::Blend { first, second, weight } => {
                let t = share(weight, at);
                first.albedo(at) * (1.0 - t) + second.albedo(at) * t
            }
            Composite::TwoSided { front, .. } => front.albedo(at),
            Composite::Bent { material, .. } => material.albedo(at),
        }
    }

    fn parts(&self) -> [&Material; 2] {
        match self {
            Composite::Blend { first, second, .. } => [first, second],
            Composite::TwoSided { front, back } => [front, back],
            Composite::Bent { material, .. } => [material, material],
        }
    }

    /// How many materials there are in it that are not made of others.
    pub(super) fn leaves(&self) -> usize {
        match self {
            Composite::Blend { first, second, .. } | Composite::TwoSided { front: first, back: second } => first.leaves() + second.leaves(),
            Composite::Bent { material, .. } => material.leaves(),
        }
    }

    pub(super) fn has_choice(&self) -> bool {
        matches!(self, Composite::Blend { .. }) || self.parts().into_iter().any(Material::has_choice)
    }

    pub(super) fn is_textured(&self) -> bool {
        let own = match self {
            Composite::Blend { weight, .. } => matches!(weight, ScalarInput::Texture(_)),
            Composite::TwoSided { .. } => false,
            Composite::Bent { .. } => true,
        };
        own || self.parts().into_iter().any(Material::is_textured)
    }

    pub(super) fn needs_tangents(&self) -> bool {
        matches!(self, Composite::Bent { .. }) || self.parts().into_iter().any(Material::needs_tangents)
    }

    pub(super) fn transmits(&self) -> bool {
        self.parts().into_iter().any(Material::transmits)
    }

    pub(super) fn delta_ior(&self) -> Option<f32> {
        self.parts().into_iter().find_map(Material::delta_ior)
    }

    pub(super) fn bends(&self) -> bool {
        matches!(self, Composite::Bent { .. }) || self.parts().into_iter().any(Material::bends)
    }

    /// The bent shading normal. The parts of a blend share one frame: their normals are mixed by their shares.
    pub(super) fn bent(&self, at: &TexturePoint, surface: &Surface, from_front: bool) -> Vec3 {
        match self {
            Composite::Blend { first, second, weight } => {
                let t = share(weight, at);
                let normal = first.bent(at, surface, from_front) * (1.0 - t) + second.bent(at, surface, from_front) * t;
                normal.normalize_or(surface.normal)
            }
            Composite::TwoSided { front, back } => if from_front { front } else { back }.bent(at, surface, from_front),
            Composite::Bent { material, relief } => {
                let normal = relief.normal(at, surface);
                material.bent(at, &Surface { normal, ..*surface }, from_front)
            }
        }
    }
}

/// Samples one of both by its share, so that the delta lobes of both own the choices below their common probability.
fn blended(first: &Material, second: &Material, t: f32, at: &TexturePoint, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
    let (a, b) = (first.delta_probability(at, wo), second.delta_probability(at, wo));
    let (delta, choice) = split(choice, a * (1.0 - t) + b * t);
    let part = |p: f32| if delta { p } else { 1.0 - p };
    let (of_first, of_second) = (part(a) * (1.0 - t), part(b) * t);
    let (is_first, choice) = split(choice, of_first / (of_first + of_second));
    let (material, p) = if is_first { (first, a) } else { (second, b) };
    let choice = if delta { choice * p } else { (p + choice * (1.0 - p)).min(1.0 - f32::EPSILON) };
    material.sample(at, wo, choice, u).filter(|scatter| scatter.delta == delta)
}

/// The sharper of two roughnesses, of which 0 says that there are delta lobes only.
fn sharper(a: f32, b: f32) -> f32 {
    if a == 0.0 || b == 0.0 { a.max(b) } else { a.min(b) }
}

impl Bsdf {
    /// Relative index of the smooth boundary that it is, 1 where light passes straight on; `None` where no delta lobe transmits.
    pub(super) fn delta_ior(&self) -> Option<f32> {
        match self {
            Bsdf::Dielectric(m) if m.facets.is_none() => Some(m.eta),
            Bsdf::ThinDielectric(_) | Bsdf::Null => Some(1.0),
            _ => None,
        }
    }
}
