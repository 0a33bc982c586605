//! The compiled scene: flat arrays that the transport reads, one instant of what the description says.

use crate::geometry::{Hit, ShapeId, SurfacePoint, World};
use crate::light::{LightPoint, Lights};
use crate::material::Material;
use crate::math::Ray;
use crate::medium::{Medium, MediumId};
use crate::sensor::Sensor;
use crate::texture::{ScalarInput, TexturePoint};

/// A shape's material and light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Index into the materials.
    pub material: u32,
    /// Index into the lights, where the shape emits.
    pub light: Option<u32>,
    /// Index into the boundaries, where light may pass it or the media on its sides are its own.
    pub boundary: Option<u32>,
}

/// What a shape is to light that passes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// How much of the surface is there, in [0, 1]: 0 is a hole.
    pub opacity: ScalarInput,
    /// The media before and behind it; `None` where it stands in whatever is around.
    pub media: Option<[MediumId; 2]>,
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
    /// Boundaries.
    pub boundaries: Vec<Boundary>,
    /// Media, by [`MediumId`].
    pub media: Vec<Medium>,
    /// The medium around the camera.
    pub around: MediumId,
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

    /// Whether space is empty and every surface whole, so that each leg of a path is a single ray.
    #[inline]
    pub fn is_clear(&self) -> bool {
        self.boundaries.is_empty() && self.around == MediumId::VACUUM
    }

    /// A medium; `None` for vacuum.
    #[inline]
    pub fn medium(&self, id: MediumId) -> Option<&Medium> {
        self.media.get(id.0 as usize)
    }

    #[inline]
    fn boundary(&self, surface: &SurfacePoint) -> Option<&Boundary> {
        self.shape(surface.shape).boundary.map(|index| &self.boundaries[index as usize])
    }

    /// How much of the surface is there, in [0, 1].
    #[inline]
    pub fn opacity(&self, surface: &SurfacePoint) -> f32 {
        match self.boundary(surface).map(|boundary| &boundary.opacity) {
            None => 1.0,
            Some(ScalarInput::Constant(opacity)) => *opacity,
            Some(texture) => texture.at(&self.texture_point(surface)).clamp(0.0, 1.0),
        }
    }

    /// Whether the surface is nothing but a boundary: no light ever stops there.
    #[inline]
    pub fn is_hole(&self, surface: &SurfacePoint) -> bool {
        self.boundary(surface).is_some_and(|boundary| boundary.opacity == ScalarInput::Constant(0.0))
    }

    /// The media before and behind a surface; `None` where it stands in whatever is around.
    #[inline]
    pub fn media_at(&self, surface: &SurfacePoint) -> Option<[MediumId; 2]> {
        self.boundary(surface)?.media
    }

    /// The nearest surface along a ray.
    #[inline(always)]
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
            at: if self.lights.is_textured(light) { self.texture_point(surface) } else { TexturePoint::default() },
            infinite: false,
            delta: false,
        })
    }
}
