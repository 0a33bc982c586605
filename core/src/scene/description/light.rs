//! Lights as written that are no surfaces: points, beams, and what lies infinitely far away.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::colour::Colour;
use super::transform::Transform;

/// A light without a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Light {
    /// Light from one point in all directions.
    Point(PointLight),
    /// A cone of light from one point.
    Spot(SpotLight),
    /// Parallel light from infinitely far away.
    Directional(DirectionalLight),
}

impl Light {
    /// From the frame of its position and direction to the world.
    pub fn to_world(&self) -> &Transform {
        match self {
            Light::Point(light) => &light.to_world,
            Light::Spot(light) => &light.to_world,
            Light::Directional(light) => &light.to_world,
        }
    }

    /// The same, to be changed.
    pub fn to_world_mut(&mut self) -> &mut Transform {
        match self {
            Light::Point(light) => &mut light.to_world,
            Light::Spot(light) => &mut light.to_world,
            Light::Directional(light) => &mut light.to_world,
        }
    }
}

/// Light from one point, the same in all directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointLight {
    /// What people call it. Not read by the renderer.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Where it is [m].
    pub position: [f64; 3],
    /// Radiant intensity [W·sr⁻¹].
    pub intensity: Colour,
    /// Places position and direction in the world. Scales do not change how strong it is.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_world: Transform,
}

/// A cone of light: full intensity up to `inner_angle` from the axis, none past `outer_angle`, and in between falling linearly in the angle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLight {
    /// What people call it. Not read by the renderer.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Where it is [m].
    pub position: [f64; 3],
    /// Where it shines to: a direction of any length.
    pub direction: [f64; 3],
    /// Radiant intensity along the axis [W·sr⁻¹].
    pub intensity: Colour,
    /// Angle from the axis up to which the intensity is full [degrees], in [0, outer_angle].
    pub inner_angle: f64,
    /// Angle from the axis past which there is no light [degrees], in (0, 180].
    pub outer_angle: f64,
    /// How the light falls between the two angles.
    #[serde(default, skip_serializing_if = "Falloff::is_linear")]
    pub falloff: Falloff,
    /// Places position and direction in the world. Scales do not change how strong it is.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_world: Transform,
}

/// How a spot falls from full intensity to none. t runs from 0 at `outer_angle` to 1 at `inner_angle`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Falloff {
    /// t linear in the angle (Mitsuba).
    #[default]
    Linear,
    /// t²(3 − 2t), t linear in the cosine of the angle (pbrt).
    Smoothstep,
    /// t², t linear in the cosine of the angle (glTF).
    Quadratic,
}

impl Falloff {
    fn is_linear(&self) -> bool {
        *self == Falloff::Linear
    }
}

/// Parallel light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLight {
    /// What people call it. Not read by the renderer.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Where it shines to: a direction of any length.
    pub direction: [f64; 3],
    /// Irradiance of a surface that faces it [W·m⁻²].
    pub irradiance: Colour,
    /// Places position and direction in the world. Scales do not change how strong it is.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_world: Transform,
}

/// Light from infinitely far away in every direction: exactly one of `radiance`, `image` and `sky`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    /// The same radiance from everywhere [W·sr⁻¹·m⁻²].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiance: Option<Colour>,
    /// Radiance from an image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<EnvironmentImage>,
    /// A clear daytime sky.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<Sky>,
}

/// Radiance from an equirectangular image: in its own frame +Y is up and at the top row; −Z is in the middle of the image, +X a quarter to the right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentImage {
    /// An image as for textures, usually OpenEXR or Radiance HDR.
    pub file: String,
    /// Turns it into the world. Moves and scales have no effect.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_world: Transform,
    /// Factor on the radiance, each channel ≥ 0.
    #[serde(default = "Colour::white", skip_serializing_if = "Colour::is_white")]
    pub scale: Colour,
}

/// A clear daytime sky over black ground; +Y is up. Its radiance is that of 1 nm of the spectrum [W·sr⁻¹·m⁻²·nm⁻¹], as in other renderers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sky {
    /// Direction *to* the sun, of any length, above the horizon.
    pub sun_direction: [f64; 3],
    /// Haze: 2 is very clear, 10 is hazy.
    #[serde(default = "Sky::default_turbidity")]
    #[schemars(range(min = 1.7, max = 10.0))]
    pub turbidity: f64,
    /// Factor on the sky's radiance ≥ 0.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub sky_scale: f64,
    /// Factor on the sun's radiance ≥ 0; 0 leaves the sun out.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub sun_scale: f64,
    /// Turns it into the world. Moves and scales have no effect.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_world: Transform,
}

impl Sky {
    fn default_turbidity() -> f64 {
        3.0
    }
}

impl Environment {
    /// The same radiance from everywhere.
    pub fn constant(radiance: Colour) -> Environment {
        Environment { radiance: Some(radiance), ..Environment::default() }
    }

    /// Whether it is known to be black without a look at its image.
    pub fn is_black(&self) -> bool {
        match self {
            Environment { radiance: Some(radiance), .. } => radiance.is_black(),
            Environment { image: Some(image), .. } => image.scale.is_black(),
            Environment { sky: Some(sky), .. } => sky.sky_scale == 0.0 && sky.sun_scale == 0.0,
            _ => true,
        }
    }
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}
