//! Punctual lights (KHR_lights_punctual).

use glam::DVec3;

use super::stand::Stand;
use super::{Importer, Source, titled};
use crate::scene::description::{Colour, DirectionalLight, Falloff, Light, PointLight, SpotLight, Transform};
use crate::scene::error::{Error, ErrorKind};

impl Importer {
    /// A light at a node that stands there; `path` is the node.
    ///
    /// # Errors
    /// No such light, or one of an unknown type.
    pub(super) fn light(
        &mut self,
        source: &Source<'_>,
        index: usize,
        (stand, to_world): (&Stand, Transform),
        path: &str,
    ) -> Result<Light, Error> {
        let lights = source.document.extensions.lights.as_ref().map(|lights| lights.lights.as_slice()).unwrap_or_default();
        let light = source.get(lights, index, path, "lights")?;
        let place = titled("lights", index, &light.name);
        let fault = |found: String, expected: &str| source.fault(ErrorKind::Malformed, &format!("lights[{index}]"), found, expected);
        let intensity = light.intensity.unwrap_or(1.0);
        let colour = Colour(light.color.unwrap_or([1.0; 3]).map(|channel| channel * intensity));
        if light.range.is_some() {
            self.note(format!("{place}: its range is left out, light falls off with the square of the distance for ever"));
        }
        let (position, direction, to_world) = if stand.rests() {
            let position = stand.rest.w_axis.truncate();
            (position.into(), stand.rest.transform_vector3(DVec3::NEG_Z).into(), Transform::default())
        } else {
            ([0.0; 3], [0.0, 0.0, -1.0], to_world)
        };
        let name = light.name.clone();
        Ok(match light.kind.as_str() {
            "point" => Light::Point(PointLight { name, position, intensity: colour, to_world }),
            "directional" => Light::Directional(DirectionalLight { name, direction, irradiance: colour, to_world }),
            "spot" => {
                let spot = light.spot.as_ref().ok_or_else(|| fault("no spot".to_string(), "the angles of its cone"))?;
                let outer = spot.outer_cone_angle.unwrap_or(std::f64::consts::FRAC_PI_4).to_degrees();
                let inner = spot.inner_cone_angle.unwrap_or(0.0).to_degrees().min(outer);
                Light::Spot(SpotLight {
                    name,
                    position,
                    direction,
                    intensity: colour,
                    inner_angle: inner,
                    outer_angle: outer,
                    falloff: Falloff::Quadratic,
                    to_world,
                })
            }
            other => return Err(fault(format!("type {other:?}"), "directional, point or spot")),
        })
    }
}
