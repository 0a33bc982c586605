//! What emits light, and how a point of it is chosen.

mod area;
mod choice;
mod concentrated;
mod environment;
mod image;
mod sky;
#[cfg(test)]
mod tests;
mod tree;

pub use area::{AreaLight, Emitter};
pub use choice::TREE_FROM;
pub use concentrated::{DirectionalLight, Falloff, PointLight, SpotLight, radians};
pub use environment::Environment;
pub use image::ImageEnvironment;
pub use sky::Sky;

use std::sync::Arc;

use crate::geometry::Bounds;
use crate::math::{PI, Vec3};
use crate::spectrum::Spectrum;
use crate::texture::{ColourInput, TexturePoint};
use choice::Choice;
use tree::Reach;

/// A light.
#[derive(Clone, Debug)]
pub enum Light {
    /// A surface.
    Area(AreaLight),
    /// One point.
    Point(PointLight),
    /// A cone from one point.
    Spot(SpotLight),
    /// One direction.
    Directional(DirectionalLight),
    /// Everything that rays without a surface see, the same everywhere.
    Environment(Environment),
    /// The same from an image.
    Image(Arc<ImageEnvironment>),
}

/// A point of a light as the end of a path: it does not depend on where it is seen from.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Which light.
    pub light: u32,
    /// World position, or, at infinity, the unit direction towards the light.
    pub position: Vec3,
    /// Bound on the rounding error of `position` [scene units].
    pub error: f32,
    /// Unit normal of the emitting side; zero at infinity.
    pub normal: Vec3,
    /// Where textures are looked up, if it lies on a surface with any.
    pub at: TexturePoint,
    /// Whether the point lies at infinity.
    pub infinite: bool,
    /// Whether the light is concentrated in this point or direction, so that no ray finds it by chance. Its density is then the
    /// probability of choosing it [1], and its radiance holds what the vertex receives: intensity over squared distance, or irradiance.
    pub delta: bool,
}

/// A light point chosen for a shading point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// The end of the path.
    pub point: LightPoint,
    /// Density, choice of the light included [sr⁻¹ at the shading point].
    pub density: f32,
}

/// All lights of a scene.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    lights: Vec<Light>,
    choice: Option<Choice>,
    environment: Option<u32>,
}

impl Lights {
    /// From lights; `radius` is that of a sphere around the scene. A few are chosen in proportion to their power, many by a tree.
    pub fn new(lights: Vec<Light>, radius: f32) -> Self {
        Self::choosing(lights, radius, choice::TREE_FROM)
    }

    /// The same with a tree from this many lights on.
    pub(crate) fn choosing(lights: Vec<Light>, radius: f32, tree_from: usize) -> Self {
        let weights: Vec<(f32, Option<Reach>)> = lights.iter().map(|light| (light.power(radius), light.reach())).collect();
        let environment = lights.iter().position(|l| matches!(l, Light::Environment(_) | Light::Image(_))).map(|k| k as u32);
        Self { choice: Choice::new(&weights, tree_from), lights, environment }
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there is no light.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Chooses a light, by a number that is drawn only where there are several, and a point of it as seen from `from`.
    #[inline]
    pub fn sample(&self, from: Vec3, choice: impl FnOnce() -> f32, u: [f32; 2]) -> Option<LightSample> {
        let lights = self.choice.as_ref()?;
        let (index, probability) = if self.lights.len() == 1 { (0, 1.0) } else { lights.sample(from, choice())? };
        let (point, density) = match &self.lights[index as usize] {
            Light::Area(light) => light.sample(index, from, u)?,
            Light::Point(light) => (light.point(index), 1.0),
            Light::Spot(light) => (light.point(index), 1.0),
            Light::Directional(light) => (light.point(index), 1.0),
            Light::Environment(light) => light.sample(index, u),
            Light::Image(light) => light.sample(index, u)?,
        };
        Some(LightSample { point, density: density * probability })
    }

    /// Density with which [`sample`](Self::sample) finds this point from `from` [sr⁻¹; 1 for lights without extent].
    #[inline]
    pub fn density(&self, from: Vec3, point: &LightPoint) -> f32 {
        let Some(choice) = &self.choice else { return 0.0 };
        let density = match &self.lights[point.light as usize] {
            Light::Area(light) => light.density(from, point),
            Light::Point(_) | Light::Spot(_) | Light::Directional(_) => 1.0,
            Light::Environment(light) => light.density(),
            Light::Image(light) => light.density(point.position),
        };
        if density > 0.0 { density * choice.probability(from, point.light) } else { 0.0 }
    }

    /// Radiance that leaves the point towards `from`; of lights without extent what arrives there [W·m⁻²].
    #[inline]
    pub fn radiance(&self, point: &LightPoint, from: Vec3) -> Spectrum {
        match &self.lights[point.light as usize] {
            Light::Area(light) => light.radiance(point, from),
            Light::Point(light) => light.received(from),
            Light::Spot(light) => light.received(from),
            Light::Directional(light) => light.irradiance,
            Light::Environment(light) => light.radiance,
            Light::Image(light) => light.radiance(point.position),
        }
    }

    /// Whether the radiance of a light varies over its surface.
    #[inline]
    pub fn is_textured(&self, light: u32) -> bool {
        matches!(&self.lights[light as usize], Light::Area(AreaLight { radiance: ColourInput::Texture(_), .. }))
    }

    /// The environment seen in a direction, as a light point.
    #[inline]
    pub fn at_infinity(&self, direction: Vec3) -> Option<LightPoint> {
        self.environment.map(|light| LightPoint {
            light,
            position: direction.normalize(),
            error: 0.0,
            normal: Vec3::ZERO,
            at: TexturePoint::default(),
            infinite: true,
            delta: false,
        })
    }
}

impl Light {
    /// Emitted power [W], up to a constant shared by all lights.
    fn power(&self, radius: f32) -> f32 {
        match self {
            Light::Area(light) => light.power(),
            Light::Point(light) => light.power(),
            Light::Spot(light) => light.power(),
            Light::Directional(light) => light.power(radius),
            Light::Environment(light) => light.radiance.mean() * 4.0 * PI * radius * radius,
            Light::Image(light) => light.power(radius),
        }
    }

    /// Where it lies and which way it shines; `None` at infinity, or without power.
    fn reach(&self) -> Option<Reach> {
        let point = |position| Bounds { lower: position, upper: position };
        let reach = match self {
            Light::Area(light) => light.reach(),
            Light::Point(light) => Reach::everywhere(point(light.position), light.intensity.mean()),
            Light::Spot(light) => Reach {
                bounds: point(light.position),
                axis: light.axis,
                spread: light.inner,
                falloff: light.outer - light.inner,
                intensity: light.intensity.mean(),
            },
            Light::Directional(_) | Light::Environment(_) | Light::Image(_) => return None,
        };
        (reach.intensity > 0.0 && reach.intensity.is_finite()).then_some(reach)
    }
}

#[cfg(test)]
impl Lights {
    fn choose(&self, from: Vec3, u: f32) -> Option<(u32, f32)> {
        self.choice.as_ref()?.sample(from, u)
    }

    fn probability(&self, from: Vec3, light: u32) -> f32 {
        self.choice.as_ref().map_or(0.0, |choice| choice.probability(from, light))
    }
}
