//! A point on a surface, as shading needs it.

use super::world::{Hit, ShapeId};
use crate::math::{Vec2, Vec3};

/// Where a ray met a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// World position.
    pub position: Vec3,
    /// Bound on the rounding error of `position` [scene units].
    pub error: f32,
    /// Unit geometric normal of the front side.
    pub normal: Vec3,
    /// Unit shading normal, on the same side as `normal`.
    pub shading_normal: Vec3,
    /// Texture coordinates; barycentric where the mesh has none.
    pub uv: Vec2,
    /// Distance along the ray, in units of its direction's length.
    pub t: f32,
    /// The shape that was met.
    pub shape: ShapeId,
    /// Which of its parts was met.
    pub hit: Hit,
}
