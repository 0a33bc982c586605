//! The compiled scene: flat arrays that the transport reads, one instant of what the description says.

use crate::geometry::{Hit, ShapeId, SurfacePoint, World};
use crate::light::{LightPoint, Lights};
use crate::material::Material;
use crate::math::Ray;
use crate::sensor::Sensor;
use crate::texture::TexturePoint;

/// A shape's material and light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Index into the materials.
    pub material: u32,
    /// Index into the lights, where the shape emits.
    pub light: Option<u32>,
}

/// A scene ready to be rendered. Immutable; shared by all threads.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Geometry.
    pub world: World,
    /// By [`ShapeId`].
    pub shapes: Vec<Shape>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Lights.
    pub lights: Lights,
    /// Camera.
    pub sensor: Sensor,
}

impl Scene {
    /// The shape's entry.
    #[inline]
    pub fn shape(&self, id: ShapeId) -> Shape {
        self.shapes[id.0 as usize]
    }

    /// The nearest surface along a ray.
    #[inline]
    pub fn trace(&self, ray: &Ray) -> Option<SurfacePoint> {
        let hit: Hit = self.world.closest(ray)?;
        Some(self.world.surface(ray, &hit))
    }

    /// Where textures are looked up at a surface point.
    #[inline]
    pub fn texture_point(&self, surface: &SurfacePoint) -> TexturePoint {
        TexturePoint { uv: surface.uv, colour: self.world.colour(surface) }
    }

    /// The surface point as a point of its light, where it emits.
    #[inline]
    pub fn light_point(&self, surface: &SurfacePoint) -> Option<LightPoint> {
        let light = self.shape(surface.shape).light?;
        Some(LightPoint {
            light,
            position: surface.position,
            error: surface.error,
            normal: surface.normal,
            uv: surface.uv,
            infinite: false,
            delta: false,
        })
    }
}
