//! Reliefs: textures that bend a surface's shading normal.

use crate::math::{Frame, Vec2, Vec3};
use crate::texture::{ColourInput, ScalarInput, TexturePoint};

/// A relief.
#[derive(Clone, Debug, PartialEq)]
pub enum Relief {
    /// Heights, which displace the surface along its normal.
    Bumps {
        /// Height, in units of the derivatives of the surface's position by its texture coordinates.
        height: ScalarInput,
        /// Factor on it.
        scale: f32,
    },
    /// Normals in the tangent frame, each channel n as (n + 1)/2.
    Normals {
        /// The texture.
        normals: ColourInput,
        /// Factor on the tangential components.
        scale: f32,
    },
}

/// The surface that bears a relief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Unit shading normal.
    pub normal: Vec3,
    /// ∂p/∂u; zero where there is none.
    pub du: Vec3,
    /// ∂p/∂v; zero where there is none.
    pub dv: Vec3,
}

/// Half the step of the differences that give a height's slope [texture coordinates]: below a texel of the finest textures in use.
const STEP: f32 = 1.0 / 16384.0;

impl Relief {
    /// The unit normal that it makes of a surface's own, on the same side of it.
    pub(super) fn normal(&self, at: &TexturePoint, surface: &Surface) -> Vec3 {
        let Surface { normal, du, dv } = *surface;
        let bent = match self {
            Relief::Bumps { height, scale } => {
                // Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978: the tangents of the displaced surface.
                let height = |offset: Vec2| height.at(&TexturePoint { uv: at.uv + offset, ..*at });
                let slope = |step: Vec2| (height(step) - height(-step)) * (scale / (2.0 * STEP));
                let along = |d: Vec3, slope: f32| d - normal * normal.dot(d) + normal * slope;
                let (du, dv) = (along(du, slope(Vec2::new(STEP, 0.0))), along(dv, slope(Vec2::new(0.0, STEP))));
                du.cross(dv)
            }
            Relief::Normals { normals, scale } => {
                let [x, y, z] = normals.at(at).to_rgb().map(|c| 2.0 * c - 1.0);
                Frame::from_tangent(normal, du).to_world(Vec3::new(x * scale, y * scale, z))
            }
        };
        let bent = bent.normalize_or(normal);
        if !bent.is_finite() {
            return normal;
        }
        if bent.dot(normal) < 0.0 { -bent } else { bent }
    }
}
