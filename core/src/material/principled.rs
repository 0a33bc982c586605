//! One material for most things: a metal, a coloured dielectric and a transmitting one, mixed; sheen and a clear coat over them.
//!
//! The parameters mean what they mean in glTF 2.0 and its extensions. The mix differs from the specification's sample
//! implementation where that creates energy: the base of a dielectric gets what its reflection leaves over in both directions
//! (Kelemen and Szirmay-Kalos, Eurographics 2001), and coat and sheen dim what lies below on the way in and out.

use super::albedo::{FacetAlbedo, charlie, facet_albedo, sheen_albedo, sheen_scale};
use super::bsdf::{Evaluation, Scatter};
use super::dielectric::Dielectric;
use super::fresnel::schlick_weight;
use super::lobe::{diffuse, diffuse_density, reflects, scattered, split, uniform, upper};
use super::microfacet::Microfacets;
use crate::math::{INV_PI, Vec3};
use crate::spectrum::Spectrum;

/// Reflectance of the coat at normal incidence: index 1.5.
const COAT_F0: f32 = 0.04;

/// The numbers of a [`Principled`] material, in the terms of glTF 2.0. Values outside their ranges are the caller's fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledParameters {
    /// Diffuse reflectance, reflectance of a metal, tint of what is transmitted [1].
    pub base_color: Spectrum,
    /// 0 a dielectric, 1 a metal.
    pub metallic: f32,
    /// Perceptual roughness; α is its square.
    pub roughness: f32,
    /// Stretch of the highlight along x (positive) or y (negative), −1 to 1.
    pub anisotropy: f32,
    /// Index of refraction of the dielectric, ≥ 1.
    pub ior: f32,
    /// Strength of the dielectric's reflection, 0 to 1.
    pub specular: f32,
    /// Its tint at normal incidence, ≥ 0.
    pub specular_color: Spectrum,
    /// Strength of the coat, 0 to 1.
    pub clearcoat: f32,
    /// Perceptual roughness of the coat.
    pub clearcoat_roughness: f32,
    /// Colour of the sheen [1].
    pub sheen_color: Spectrum,
    /// Perceptual roughness of the sheen.
    pub sheen_roughness: f32,
    /// Share of the dielectric that transmits, 0 to 1.
    pub transmission: f32,
    /// Whether what is transmitted goes straight on, but for the roughness.
    pub thin: bool,
    /// Whether the back reflects too.
    pub two_sided: bool,
}

/// A principled material. Has no delta lobes: roughness is at least [`Microfacets::SHARPEST`].
///
/// Where it transmits and is not thin, only the transmitting share scatters light that comes from inside; and that share
/// reflects as `ior` says, whatever `specular` is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    base: Spectrum,
    /// Shares of metal, opaque or thin dielectric, and refracting dielectric; they add up to 1.
    shares: [f32; 3],
    /// Of the second share, how much transmits.
    thin: f32,
    facets: Microfacets,
    eta: f32,
    /// Reflectance of the opaque dielectric at normal and at grazing incidence.
    f0: Spectrum,
    f90: f32,
    /// One over the mean of what the opaque dielectric's reflection leaves to its base.
    base_scale: Spectrum,
    coat: f32,
    coat_facets: Microfacets,
    sheen: Spectrum,
    sheen_alpha: f32,
    two_sided: bool,
}

/// Probabilities of the lobes, seen from one direction.
struct Chances {
    coat: f32,
    sheen: f32,
    mirror: f32,
    base: f32,
    through: f32,
    glass: f32,
    /// What the opaque dielectric's reflection leaves to its base.
    left: Spectrum,
}

impl Principled {
    /// From its numbers.
    pub fn new(p: &PrincipledParameters) -> Self {
        let alpha = p.roughness * p.roughness;
        let stretched = alpha + (1.0 - alpha) * p.anisotropy * p.anisotropy;
        let facets =
            if p.anisotropy < 0.0 { Microfacets::ggx_at_least(alpha, stretched) } else { Microfacets::ggx_at_least(stretched, alpha) };
        let coat_alpha = p.clearcoat_roughness * p.clearcoat_roughness;
        let sheen_alpha = p.sheen_roughness * p.sheen_roughness;
        let normal = ((p.ior - 1.0) / (p.ior + 1.0)).powi(2);
        let glass = if p.thin { 0.0 } else { p.transmission };
        let unscaled = Self {
            base: p.base_color,
            shares: [p.metallic, (1.0 - p.metallic) * (1.0 - glass), (1.0 - p.metallic) * glass],
            thin: if p.thin { p.transmission } else { 0.0 },
            facets,
            eta: p.ior,
            f0: p.specular_color.map(|c| (c * normal).min(1.0) * p.specular),
            f90: p.specular,
            coat: p.clearcoat,
            coat_facets: Microfacets::ggx_at_least(coat_alpha, coat_alpha),
            sheen: if p.sheen_color.is_black() { p.sheen_color } else { p.sheen_color * sheen_scale(sheen_alpha) },
            sheen_alpha,
            base_scale: Spectrum::WHITE,
            two_sided: p.two_sided || (p.thin && p.transmission > 0.0),
        };
        let mean = unscaled.left_to_base(facet_albedo(&facets, None));
        Self { base_scale: mean.map(|left| 1.0 / left.max(1e-4)), ..unscaled }
    }

    #[inline]
    fn glass(&self) -> Dielectric {
        Dielectric { eta: self.eta, reflectance: Spectrum::WHITE, transmittance: self.base, facets: Some(self.facets), bounced: None }
    }

    /// Whether light that comes from the back is inside.
    #[inline]
    fn refracts(&self) -> bool {
        self.shares[2] > 0.0
    }

    #[inline]
    pub(super) fn relative_ior(&self, wo: Vec3) -> f32 {
        match (self.refracts(), wo.z >= 0.0) {
            (false, _) => 1.0,
            (true, true) => self.eta,
            (true, false) => 1.0 / self.eta,
        }
    }

    /// What the opaque dielectric's reflection leaves to its base, by the albedo of its facets.
    #[inline]
    fn left_to_base(&self, a: FacetAlbedo) -> Spectrum {
        self.f0.map(|f0| (1.0 - f0 * (a.white - a.schlick) - self.f90 * a.schlick).max(0.0))
    }

    /// What the coat leaves of light that passes it at cosθ.
    #[inline]
    fn under_coat(&self, cos: f32) -> f32 {
        if self.coat == 0.0 { 1.0 } else { 1.0 - self.coat * coat_fresnel(cos) }
    }

    /// What sheen takes of light at cosθ.
    #[inline]
    fn sheen_share(&self, cos: f32) -> f32 {
        let strongest = self.sheen.max();
        if strongest == 0.0 { 0.0 } else { strongest * sheen_albedo(cos, self.sheen_alpha) }
    }

    fn chances(&self, wo: Vec3) -> Option<Chances> {
        let [metal, dielectric, glass] = self.shares;
        let mut chances = Chances { coat: 0.0, sheen: 0.0, mirror: 0.0, base: 0.0, through: 0.0, glass, left: Spectrum::BLACK };
        if wo.z > 0.0 {
            let a = facet_albedo(&self.facets, Some(wo.z));
            chances.left = self.left_to_base(a);
            let (base, left) = (self.base.mean(), chances.left.mean());
            chances.coat = self.coat * coat_fresnel(wo.z);
            chances.sheen = self.sheen_share(wo.z);
            chances.mirror = metal * (base * a.white + (1.0 - base) * a.schlick) + dielectric * (1.0 - left);
            chances.base = dielectric * (1.0 - self.thin) * base * left;
            chances.through = dielectric * self.thin * base * left;
        }
        let sum = chances.coat + chances.sheen + chances.mirror + chances.base + chances.through + chances.glass;
        if sum <= 0.0 {
            return None;
        }
        for chance in
            [&mut chances.coat, &mut chances.sheen, &mut chances.mirror, &mut chances.base, &mut chances.through, &mut chances.glass]
        {
            *chance /= sum;
        }
        Some(chances)
    }

    /// Turns the side of `wo` up, unless that side is the inside of something that refracts. `None` where it is black.
    #[inline]
    fn turned(&self, wo: Vec3, w: Vec3) -> Option<Vec3> {
        if self.refracts() {
            return Some(w);
        }
        reflects(wo, self.two_sided).then(|| upper(w, wo))
    }

    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        let (Some(o), Some(i)) = (self.turned(wo, wo), self.turned(wo, wi)) else { return Evaluation::NONE };
        if o.z == 0.0 || i.z == 0.0 {
            return Evaluation::NONE;
        }
        let Some(chances) = self.chances(o) else { return Evaluation::NONE };
        let mut under = Evaluation::NONE;
        let mut add = |value: Spectrum, density: f32| {
            under.value += value;
            under.density += density;
        };
        if chances.glass > 0.0 {
            let glass = self.glass().evaluate(o, i);
            add(glass.value * self.shares[2], glass.density * chances.glass);
        }
        match (o.z > 0.0, i.z > 0.0) {
            (true, true) => self.reflection(&chances, o, i, &mut add),
            (true, false) if self.thin > 0.0 => self.passage(&chances, o, Vec3::new(i.x, i.y, -i.z), &mut add),
            _ => {}
        }
        self.covered(&chances, o, i, under)
    }

    /// Metal and opaque dielectric.
    #[inline]
    fn reflection(&self, chances: &Chances, o: Vec3, i: Vec3, add: &mut impl FnMut(Spectrum, f32)) {
        let [metal, dielectric, _] = self.shares;
        if chances.mirror > 0.0
            && let Some(mirror) = self.facets.reflect(o, i)
        {
            let s = schlick_weight(mirror.cos);
            let metallic = self.base.map(|b| b + (1.0 - b) * s);
            let plain = self.f0.map(|f0| f0 + (self.f90 - f0) * s);
            add((metallic * metal + plain * dielectric) * mirror.value, chances.mirror * mirror.density);
        }
        if chances.base > 0.0 {
            let wide = diffuse_density(i);
            let below = self.left_to_base(facet_albedo(&self.facets, Some(i.z)));
            let colour = self.base * chances.left * below * self.base_scale;
            add(colour * (wide * dielectric * (1.0 - self.thin)), chances.base * wide);
        }
    }

    /// Through a thin wall: a reflection that leaves on the other side.
    #[inline]
    fn passage(&self, chances: &Chances, o: Vec3, mirrored: Vec3, add: &mut impl FnMut(Spectrum, f32)) {
        if let Some(mirror) = self.facets.reflect(o, mirrored) {
            let s = schlick_weight(mirror.cos);
            let passed = self.f0.map(|f0| 1.0 - (f0 + (self.f90 - f0) * s));
            add(self.base * passed * (mirror.value * self.shares[1] * self.thin), chances.through * mirror.density);
        }
    }

    /// Puts sheen and coat over what lies below, on the sides where they are.
    #[inline]
    fn covered(&self, chances: &Chances, o: Vec3, i: Vec3, under: Evaluation) -> Evaluation {
        let Evaluation { mut value, mut density } = under;
        let above = o.z > 0.0 && i.z > 0.0;
        // A thin wall wears its coat and its sheen on both sides.
        let outside = |w: Vec3| w.z > 0.0 || !self.refracts();
        if !self.sheen.is_black() {
            let share = |w: Vec3| if outside(w) { self.sheen_share(w.z.abs()) } else { 0.0 };
            value = value * (1.0 - share(o).max(share(i))).max(0.0);
            if above {
                value += self.sheen * (charlie(o, i, self.sheen_alpha) * i.z);
                density += chances.sheen * (0.5 * INV_PI);
            }
        }
        if self.coat > 0.0 {
            let left = |w: Vec3| if outside(w) { self.under_coat(w.z.abs()) } else { 1.0 };
            value = value * (left(o) * left(i));
            if above && let Some(coat) = self.coat_facets.reflect(o, i) {
                value += Spectrum::grey(self.coat * coat_fresnel(coat.cos) * coat.value);
                density += chances.coat * coat.density;
            }
        }
        Evaluation { value, density }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, choice: f32, u: [f32; 2]) -> Option<Scatter> {
        let o = self.turned(wo, wo)?;
        if o.z == 0.0 {
            return None;
        }
        let chances = self.chances(o)?;
        let mut left = 1.0;
        let mut choice = choice;
        let mut taken = |chance: f32| {
            let (yes, rest) = split(choice, if left > 0.0 { chance / left } else { 0.0 });
            (choice, left) = (rest, left - chance);
            yes
        };
        let i = if taken(chances.coat) {
            self.coat_facets.sample_reflection(o, u)?
        } else if taken(chances.sheen) {
            uniform(u)?
        } else if taken(chances.base) {
            diffuse(u)?
        } else if taken(chances.through) {
            let mirrored = self.facets.sample_reflection(o, u)?;
            Vec3::new(mirrored.x, mirrored.y, -mirrored.z)
        } else if taken(chances.glass) {
            self.glass().sample(o, choice, u)?.wi
        } else {
            self.facets.sample_reflection(o, u)?
        };
        let wi = if self.refracts() { i } else { upper(i, wo) };
        scattered(wi, self.evaluate(wo, wi))
    }

    pub(super) fn transmits(&self) -> bool {
        self.refracts() || self.shares[1] * self.thin > 0.0
    }

    pub(super) fn is_anisotropic(&self) -> bool {
        self.facets.is_anisotropic()
    }

    pub(super) fn roughness(&self) -> f32 {
        if self.coat > 0.0 { self.facets.alpha().min(self.coat_facets.alpha()) } else { self.facets.alpha() }
    }

    pub(super) fn albedo(&self) -> Spectrum {
        self.base
    }
}

#[inline]
fn coat_fresnel(cos: f32) -> f32 {
    COAT_F0 + (1.0 - COAT_F0) * schlick_weight(cos)
}
