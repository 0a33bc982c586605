//! Light sources: points, beams, the light of shapes, and what lies infinitely far away.

use glam::{DMat3, DVec3};

use super::Importer;
use super::parameters::Parameters;
use super::sky;
use super::spectrum::luminance;
use super::state::AreaLight;
use crate::scene::assets::check_name;
use crate::scene::description::{
    Colour, DirectionalLight, Environment, EnvironmentImage, Falloff, Light, PointLight, SpotLight, Transform,
};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::{image, limits};

use std::f64::consts::PI;

impl Importer<'_> {
    /// `LightSource`.
    pub(super) fn light_source(&mut self, kind: &str, parameters: &Parameters) -> Result<(), Error> {
        let scale = parameters.number_or("scale", 1.0)?.max(0.0) * self.exposure;
        let times = |colour: Colour, factor: f64| Colour(colour.0.map(|channel| channel * factor));
        let name = String::new();
        match kind {
            "point" => {
                let intensity = self.emitted(parameters, "I")?;
                let scale = power(parameters, 4.0 * PI)?.map_or(scale, |power| power * scale);
                let position = self.state.ctm.transform_point3(parameters.vector_or("from", [0.0; 3])?.into()).into();
                self.described.lights.push(Light::Point(PointLight {
                    name,
                    position,
                    intensity: times(intensity, scale),
                    to_world: Transform::default(),
                }));
            }
            "spot" => {
                let intensity = self.emitted(parameters, "I")?;
                let outer = parameters.number_or("coneangle", 30.0)?;
                let inner = (outer - parameters.number_or("conedeltaangle", 5.0)?).max(0.0);
                let cosine = |angle: f64| libm::cos(angle.to_radians());
                let solid = 2.0 * PI * ((1.0 - cosine(inner)) + (cosine(inner) - cosine(outer)) * 0.5);
                let scale = power(parameters, solid)?.map_or(scale, |power| power * scale);
                let (position, direction) = self.beam(parameters)?;
                self.described.lights.push(Light::Spot(SpotLight {
                    name,
                    position,
                    direction,
                    intensity: times(intensity, scale),
                    inner_angle: inner,
                    outer_angle: outer,
                    falloff: Falloff::Smoothstep,
                    to_world: Transform::default(),
                }));
            }
            "distant" => {
                let radiance = self.emitted(parameters, "L")?;
                let scale = parameters.number("illuminance")?.filter(|lux| *lux > 0.0).map_or(scale, |lux| lux * scale);
                let (_, direction) = self.beam(parameters)?;
                self.described.lights.push(Light::Directional(DirectionalLight {
                    name,
                    direction,
                    irradiance: times(radiance, scale),
                    to_world: Transform::default(),
                }));
            }
            "infinite" => self.infinite(parameters, scale)?,
            _ => self.note(parameters, "left out: a light that is not here"),
        }
        self.note_unread(parameters);
        Ok(())
    }

    /// From where to which direction a spot or distant light shines, in the world.
    fn beam(&self, parameters: &Parameters) -> Result<([f64; 3], [f64; 3]), Error> {
        let from = DVec3::from(parameters.vector_or("from", [0.0; 3])?);
        let to = DVec3::from(parameters.vector_or("to", [0.0, 0.0, 1.0])?);
        let direction = self.state.ctm.transform_vector3(to - from);
        if direction.try_normalize().is_none() {
            return Err(parameters.fault_here(ErrorKind::Invalid, "from and to at the same place", "a direction"));
        }
        Ok((self.state.ctm.transform_point3(from).into(), direction.into()))
    }

    fn infinite(&mut self, parameters: &Parameters, scale: f64) -> Result<(), Error> {
        if parameters.get("portal").is_some() {
            self.note(parameters, "its portal is left out: it lights from all directions");
        }
        if let Some(file) = parameters.text("filename")?.map(str::to_string) {
            return self.sky(parameters, &file, scale);
        }
        let radiance = self.emitted(parameters, "L")?;
        let scale = parameters.number("illuminance")?.filter(|lux| *lux > 0.0).map_or(scale, |lux| lux / PI * scale);
        self.surround(Colour(radiance.0.map(|channel| channel * scale)), parameters)
    }

    /// An image of the sky, which pbrt-v4 maps onto a square.
    fn sky(&mut self, parameters: &Parameters, file: &str, scale: f64) -> Result<(), Error> {
        let file = file.strip_prefix("./").unwrap_or(file);
        let pixels = image::read(&self.assets.open(file)?, file)?;
        if pixels.width != pixels.height {
            let found = format!("{file:?} of {} × {} texels", pixels.width, pixels.height);
            return Err(parameters.fault_here(ErrorKind::Invalid, found, "a square image in the equal-area mapping"));
        }
        if u64::from(pixels.width) * u64::from(pixels.height) * 2 > limits::IMAGE_PIXELS {
            let found = format!("{file:?} of {} × {} texels", pixels.width, pixels.height);
            return Err(parameters.fault_here(ErrorKind::TooLarge, found, format!("at most {} texels", limits::IMAGE_PIXELS / 2)));
        }
        let made = sky::equirectangular(&pixels, DMat3::from_mat4(self.state.ctm));
        let made =
            made.ok_or_else(|| parameters.fault_here(ErrorKind::Invalid, format!("{file:?}, which"), "an image that can be written"))?;
        if self.environment.is_some() {
            self.note(parameters, "the infinite light above is left out: there is one environment");
        }
        if parameters.number("illuminance")?.is_some_and(|lux| lux > 0.0) {
            self.note(parameters, "illuminance is left out: the image has its own size");
        }
        self.note(parameters, format!("{file:?} is mapped from its square onto latitudes and longitudes"));
        let stem = file.rsplit('/').next().unwrap_or(file).trim_end_matches(".exr").to_string();
        let name = self.make("textures", &stem, "exr", made, parameters)?;
        let image = EnvironmentImage { file: name, to_world: Transform::default(), scale: Colour::grey(scale) };
        self.environment = Some(Environment { image: Some(image), ..Environment::default() });
        Ok(())
    }

    fn surround(&mut self, radiance: Colour, parameters: &Parameters) -> Result<(), Error> {
        if self.environment.as_ref().is_some_and(|environment| environment.image.is_some()) {
            self.note(parameters, "left out: there is one environment, the image above");
            return Ok(());
        }
        let before = self.environment.as_ref().and_then(|environment| environment.radiance);
        if before.is_some() {
            self.note(parameters, "added to the infinite light above");
        }
        let before = before.unwrap_or(Colour::grey(0.0)).0;
        self.environment = Some(Environment::constant(Colour([0, 1, 2].map(|k| before[k] + radiance.0[k]))));
        Ok(())
    }

    /// `AreaLightSource`.
    pub(super) fn area_light(&mut self, kind: &str, parameters: &Parameters) -> Result<(), Error> {
        if kind != "diffuse" {
            self.note(parameters, "left out: a light that is not here");
            self.state.light = None;
            return Ok(());
        }
        let scale = parameters.number_or("scale", 1.0)?.max(0.0) * self.exposure;
        let radiance = self.emitted(parameters, "L")?;
        let image = match parameters.text("filename")?.map(str::to_string) {
            Some(file) => {
                check_name(&file).map_err(|expected| parameters.fault_here(ErrorKind::OutsideFolder, format!("{file:?}"), expected))?;
                Some(file)
            }
            None => None,
        };
        let power = parameters.number("power")?.filter(|power| *power > 0.0).map(|power| power * scale);
        let radiance = if power.is_some() { radiance } else { Colour(radiance.0.map(|channel| channel * scale)) };
        let two_sided = parameters.flag("twosided")?.unwrap_or(false);
        self.state.light = Some(AreaLight { radiance, image, power, two_sided });
        self.note_unread(parameters);
        Ok(())
    }
}

impl AreaLight {
    /// Radiance of a shape, where `parts` pieces make up its `area`; each piece gives off the power, as pbrt's triangles do.
    pub(super) fn of(&self, area: f64, parts: usize) -> Colour {
        let Some(power) = self.power.filter(|_| area > 0.0) else { return self.radiance };
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        let factor = power * parts as f64 / (sides * PI * area);
        Colour(self.radiance.0.map(|channel| channel * factor))
    }

    /// Whether it gives off anything.
    pub(super) fn is_dark(&self) -> bool {
        luminance(self.radiance) <= 0.0
    }
}

/// The factor that makes a light give off `power`, where intensity 1 gives off `unit`.
fn power(parameters: &Parameters, unit: f64) -> Result<Option<f64>, Error> {
    Ok(parameters.number("power")?.filter(|power| *power > 0.0 && unit > 0.0).map(|power| power / unit))
}
