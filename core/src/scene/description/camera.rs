//! Cameras as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::transform::Transform;

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Camera {
    /// Perspective projection, through a pinhole or a thin lens.
    Perspective(Perspective),
    /// Parallel projection.
    Orthographic(Orthographic),
}

impl Camera {
    /// From the camera's frame to the world.
    pub fn to_world(&self) -> &Transform {
        match self {
            Camera::Perspective(camera) => &camera.to_world,
            Camera::Orthographic(camera) => &camera.to_world,
        }
    }

    /// The same, to be changed.
    pub fn to_world_mut(&mut self) -> &mut Transform {
        match self {
            Camera::Perspective(camera) => &mut camera.to_world,
            Camera::Orthographic(camera) => &mut camera.to_world,
        }
    }
}

/// A camera of parallel rays, in the same frame as the perspective one; its film spans [-1, 1] along X, scaled by `scale`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orthographic {
    /// From the camera's frame to the world. Turns and moves only: a scale is an error.
    #[serde(default)]
    pub to_world: Transform,
    /// Half the width of what the film sees [m], > 0; its height follows from the film.
    #[serde(default = "one")]
    pub scale: f64,
}

/// A perspective camera.
///
/// In its own frame the camera sits at the origin, looks along +Z, and +Y is up in the picture. The frame is right-handed, so +X points
/// to the *left* edge of the picture. (`look_at` builds such a frame; Mitsuba 3 uses the same one, so matrices carry over as they are.)
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Perspective {
    /// From the camera's frame to the world. Turns and moves only: a scale is an error.
    #[serde(default)]
    pub to_world: Transform,
    /// Full angle of view along `fov_axis` [degrees], in (0, 180).
    pub fov: f64,
    /// The side of the film that `fov` spans.
    #[serde(default)]
    pub fov_axis: FovAxis,
    /// Radius of the thin lens [m]; 0 is a pinhole, everything is sharp.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub lens_radius: f64,
    /// Where the line of sight meets the film, from its centre, in fractions of its width (to the right) and height (down).
    #[serde(default, skip_serializing_if = "is_centre")]
    pub principal_point: [f64; 2],
    /// Distance along +Z of the plane that the lens renders sharp [m].
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub focus_distance: f64,
}

/// The side of the film that an angle of view spans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FovAxis {
    /// The width.
    #[default]
    X,
    /// The height.
    Y,
    /// The shorter side.
    Smaller,
    /// The longer side.
    Larger,
}

fn is_centre(value: &[f64; 2]) -> bool {
    *value == [0.0; 2]
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
