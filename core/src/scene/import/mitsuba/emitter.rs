//! Mitsuba's emitters that are no surfaces: points, beams, and what lies infinitely far away.

use super::super::xml::Element;
use super::context::Context;
use super::sun;
use super::values::Meaning;
use crate::scene::description::{
    Colour, DirectionalLight, Environment, EnvironmentImage, Falloff, Light, Operation, PointLight, Rotation, Sky, SpotLight, Transform,
};
use crate::scene::error::{Error, ErrorKind};

const KNOWN: &str = "point, spot, directional, constant, envmap, sunsky, sky, sun, or area inside a shape";

impl<'a> Context<'a> {
    pub(super) fn emitter(&mut self, element: &'a Element) -> Result<(), Error> {
        // Says how often Mitsuba samples it.
        self.number(element, "sampling_weight")?;
        let kind = self.kind(element)?;
        match kind {
            "point" | "spot" | "directional" => {
                let light = match kind {
                    "point" => self.point_light(element)?,
                    "spot" => self.spot_light(element)?,
                    _ => self.directional_light(element)?,
                };
                self.origins.insert(format!("lights[{}]", self.lights.len()), element);
                self.lights.push(light);
            }
            "constant" => {
                let radiance = self.colour(element, "radiance", Meaning::Radiance)?.unwrap_or(Colour::WHITE);
                self.surrounding(element, Environment::constant(radiance))?;
            }
            "envmap" => {
                let image = self.environment_map(element)?;
                self.surrounding(element, Environment { image: Some(image), ..Environment::default() })?;
            }
            "sunsky" | "sun" | "sky" => self.sky(element, kind)?,
            _ => return Err(self.unsupported(element, KNOWN)),
        }
        self.finish(element, "what the kind of emitter needs")
    }

    fn surrounding(&mut self, element: &'a Element, environment: Environment) -> Result<(), Error> {
        if self.environment.is_some() {
            return Err(element.fault(ErrorKind::Unsupported, "a second light from infinitely far away", "one"));
        }
        self.environment = Some(environment);
        self.origins.insert("environment".to_string(), element);
        Ok(())
    }

    fn light_name(element: &Element) -> String {
        element.attribute("id").unwrap_or_default().to_string()
    }

    /// Where a light stands and shines to; of one that moves, in its own frame.
    fn light_frame(&mut self, element: &'a Element) -> Result<([f64; 3], [f64; 3], Transform), Error> {
        let to_world = self.placing(element)?;
        if to_world.nodes().next().is_some() {
            return Ok(([0.0; 3], [0.0, 0.0, 1.0], to_world));
        }
        let matrix = to_world.matrix();
        Ok((matrix.w_axis.truncate().to_array(), matrix.z_axis.truncate().to_array(), Transform::default()))
    }

    fn point_light(&mut self, element: &'a Element) -> Result<Light, Error> {
        let intensity = self.colour(element, "intensity", Meaning::Radiance)?.unwrap_or(Colour::WHITE);
        let (position, _, to_world) = match self.point(element, "position")? {
            Some(position) => (position, [0.0; 3], Transform::default()),
            None => self.light_frame(element)?,
        };
        Ok(Light::Point(PointLight { name: Context::light_name(element), position, intensity, to_world }))
    }

    fn spot_light(&mut self, element: &'a Element) -> Result<Light, Error> {
        let intensity = self.colour(element, "intensity", Meaning::Radiance)?.unwrap_or(Colour::WHITE);
        if let Some(texture) = self.parameter(element, "texture")? {
            return Err(self.unsupported(texture, "a spot of one colour"));
        }
        let (position, direction, to_world) = self.light_frame(element)?;
        let outer_angle = self.number(element, "cutoff_angle")?.unwrap_or(20.0);
        let inner_angle = self.number(element, "beam_width")?.unwrap_or(outer_angle * 0.75);
        Ok(Light::Spot(SpotLight {
            name: Context::light_name(element),
            position,
            direction,
            intensity,
            inner_angle,
            outer_angle,
            falloff: Falloff::Linear,
            to_world,
        }))
    }

    fn directional_light(&mut self, element: &'a Element) -> Result<Light, Error> {
        let irradiance = self.colour(element, "irradiance", Meaning::Radiance)?.unwrap_or(Colour::WHITE);
        let (_, direction, to_world) = match self.point(element, "direction")? {
            Some(direction) => ([0.0; 3], direction, Transform::default()),
            None => self.light_frame(element)?,
        };
        Ok(Light::Directional(DirectionalLight { name: Context::light_name(element), direction, irradiance, to_world }))
    }

    /// In Mitsuba's image −Z lies at the left edge, in ours in the middle: half a turn about the vertical lies between the two.
    fn environment_map(&mut self, element: &'a Element) -> Result<EnvironmentImage, Error> {
        let file = self.word(element, "filename")?;
        let file = file.ok_or_else(|| element.fault(ErrorKind::Unsupported, "no filename", "<string name=\"filename\" value=\"…\"/>"))?;
        let file = self.file_name(element, file)?;
        let scale = self.number(element, "scale")?.unwrap_or(1.0);
        if let Some(gamma) = self.number(element, "gamma")?.filter(|gamma| *gamma > 0.0 && *gamma != 1.0) {
            self.note(element, format!("gamma {gamma}: the file's own is used"));
        }
        self.leave(element, &["cache", "mis_compensation"], "says how Mitsuba samples")?;
        let turn = Operation::Rotate(Rotation { axis: [0.0, 1.0, 0.0], degrees: 180.0 });
        let to_world = Transform([turn].into_iter().chain(self.resting(element)?.0).collect());
        Ok(EnvironmentImage { file, to_world, scale: Colour::grey(scale) })
    }

    /// The sky has its zenith at +Z in Mitsuba 3 and at +Y in 0.x; the sun's direction is one of the world.
    fn sky(&mut self, element: &'a Element, kind: &str) -> Result<(), Error> {
        self.note(element, "another sky model is used: colours and brightness differ a little");
        let zenith = Operation::Rotate(Rotation { axis: [1.0, 0.0, 0.0], degrees: 90.0 });
        let upright = if self.old { Vec::new() } else { vec![zenith] };
        let to_world = Transform(upright.into_iter().chain(self.resting(element)?.0).collect());
        let towards = match self.point(element, "sun_direction")? {
            Some(direction) => glam::DVec3::from(direction),
            None => {
                let place = sun::When::read(self, element)?;
                to_world.matrix().transform_vector3(place.direction(self.old))
            }
        };
        let local = to_world.matrix().inverse().transform_vector3(towards);
        let overall = self.number(element, "scale")?.unwrap_or(1.0);
        let sky_scale = self.number(element, "sky_scale")?.unwrap_or(1.0) * overall;
        let sun_scale = self.number(element, "sun_scale")?.unwrap_or(1.0) * overall;
        let turbidity = self.number(element, "turbidity")?.unwrap_or(3.0);
        if !(1.7..=10.0).contains(&turbidity) {
            self.note(element, format!("turbidity {turbidity}: 1.7 to 10 are known"));
        }
        let others = ["albedo", "resolution", "stretch", "sun_radius_scale", "sun_aperture", "complex_sun", "extend"];
        self.leave(element, &others, "there is no such parameter here")?;
        let sky = Sky {
            sun_direction: local.to_array(),
            turbidity: turbidity.clamp(1.7, 10.0),
            sky_scale: if kind == "sun" { 0.0 } else { sky_scale },
            sun_scale: if kind == "sky" { 0.0 } else { sun_scale },
            to_world,
        };
        // Sun and sky of Mitsuba 0.x are two emitters of one day.
        if let Some(Environment { sky: Some(other), .. }) = &mut self.environment
            && other.to_world == sky.to_world
            && (other.sky_scale == 0.0 && kind == "sky" || other.sun_scale == 0.0 && kind == "sun")
        {
            (other.sky_scale, other.sun_scale) = (other.sky_scale + sky.sky_scale, other.sun_scale + sky.sun_scale);
            return Ok(());
        }
        self.surrounding(element, Environment { sky: Some(sky), ..Environment::default() })
    }
}
