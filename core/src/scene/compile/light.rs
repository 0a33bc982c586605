//! Lights that are no surfaces.

use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::{DESCRIPTION, spectrum};
use crate::light::{DirectionalLight, Environment, Falloff, ImageEnvironment, Light, PointLight, Sky, SpotLight, radians};
use crate::math::{Frame, Vec3};
use crate::scene::assets::Assets;
use crate::scene::description::{self, Colour, EnvironmentImage, SceneDescription};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::image;
use crate::spectrum::Spectrum;
use crate::texture::{Texels, srgb_to_linear};

/// An environment that was compiled before, with its light.
pub(super) type KnownEnvironment = Option<(description::Environment, Option<Light>)>;

/// The lights without a surface, in the order of the description, the environment last. Black ones are no lights.
pub(super) fn compile(description: &SceneDescription, assets: &dyn Assets, known: &mut KnownEnvironment) -> Result<Vec<Light>, Error> {
    let mut lights: Vec<Light> = description.lights.iter().filter(|light| !emits(light).is_black()).map(one).collect();
    if let Some(environment) = description.environment.as_ref().filter(|environment| !environment.is_black()) {
        lights.extend(match known {
            Some((described, light)) if described == environment => light.clone(),
            _ => known.insert((environment.clone(), self::environment(environment, assets)?)).1.clone(),
        });
    }
    Ok(lights)
}

/// The light of an environment; none where it is black.
fn environment(environment: &description::Environment, assets: &dyn Assets) -> Result<Option<Light>, Error> {
    Ok(if let Some(radiance) = environment.radiance {
        Some(Light::Environment(Environment { radiance: spectrum(radiance) }))
    } else if let Some(image) = &environment.image {
        image_environment(image, assets)?
    } else if let Some(sky) = &environment.sky {
        self::sky(sky)?
    } else {
        None
    })
}

fn emits(light: &description::Light) -> Colour {
    match light {
        description::Light::Point(light) => light.intensity,
        description::Light::Spot(light) => light.intensity,
        description::Light::Directional(light) => light.irradiance,
    }
}

fn one(light: &description::Light) -> Light {
    let to_world = light.to_world();
    let moved = |vector: [f64; 3], by: fn(&DMat4, DVec3) -> DVec3| {
        let vector = DVec3::from(vector);
        if to_world.is_identity() { vector } else { by(&to_world.matrix(), vector) }
    };
    let place = |position: [f64; 3]| moved(position, DMat4::transform_point3).as_vec3();
    let unit = |direction: [f64; 3]| moved(direction, DMat4::transform_vector3).normalize().as_vec3();
    match light {
        description::Light::Point(light) => {
            Light::Point(PointLight { position: place(light.position), intensity: spectrum(light.intensity) })
        }
        description::Light::Spot(light) => Light::Spot(SpotLight {
            position: place(light.position),
            axis: unit(light.direction),
            intensity: spectrum(light.intensity),
            inner: radians(light.inner_angle),
            outer: radians(light.outer_angle),
            falloff: match light.falloff {
                description::Falloff::Linear => Falloff::Linear,
                description::Falloff::Smoothstep => Falloff::Smoothstep,
                description::Falloff::Quadratic => Falloff::Quadratic,
            },
        }),
        description::Light::Directional(light) => {
            Light::Directional(DirectionalLight { towards: -unit(light.direction), irradiance: spectrum(light.irradiance) })
        }
    }
}

/// The light of an image; none where it is black.
fn image_environment(image: &EnvironmentImage, assets: &dyn Assets) -> Result<Option<Light>, Error> {
    let pixels = image::read(&assets.open(&image.file)?, &image.file)?;
    let scale = spectrum(image.scale);
    let light = |stored: f32| srgb_to_linear(stored);
    let texels: Vec<Spectrum> = match &pixels.texels {
        Texels::Floats(texels) => texels.iter().map(|[r, g, b, _]| Spectrum::rgb(*r, *g, *b) * scale).collect(),
        Texels::Bytes(texels) => {
            texels.iter().map(|t| Spectrum::rgb(t[0].into(), t[1].into(), t[2].into()).map(|v| light(v / 255.0)) * scale).collect()
        }
        Texels::Words(texels) => {
            texels.iter().map(|t| Spectrum::rgb(t[0].into(), t[1].into(), t[2].into()).map(|v| light(v / 65535.0)) * scale).collect()
        }
    };
    if let Some(place) = texels.iter().position(|texel| !texel.is_finite() || texel.to_rgb().iter().any(|v| *v < 0.0)) {
        let found = format!("a texel of radiance {:?}, number {place}", texels[place].to_rgb());
        return Err(Error::new(ErrorKind::Invalid, &image.file, "", found, "finite radiance ≥ 0"));
    }
    let axes = axes(&image.to_world, "environment.image.to_world")?;
    let environment = ImageEnvironment::new(pixels.width, pixels.height, texels, axes);
    Ok(environment.map(|environment| Light::Image(Arc::new(environment))))
}

/// The light of a sky and its sun; none where both are black.
fn sky(sky: &description::Sky) -> Result<Option<Light>, Error> {
    let axes = axes(&sky.to_world, "environment.sky.to_world")?;
    let sky = Sky {
        sun: glam::DVec3::from(sky.sun_direction).normalize().as_vec3(),
        turbidity: sky.turbidity,
        sky_scale: sky.sky_scale,
        sun_scale: sky.sun_scale,
    };
    Ok(sky.environment(axes).map(|environment| Light::Image(Arc::new(environment))))
}

/// World directions of the axes of an environment.
fn axes(to_world: &description::Transform, path: &str) -> Result<Frame, Error> {
    let matrix = to_world.matrix();
    let axis = |axis: glam::DVec4| axis.truncate().normalize_or_zero().as_vec3();
    let (x, y) = (axis(matrix.x_axis), axis(matrix.y_axis));
    let z: Vec3 = x.cross(y);
    if (x.dot(y)).abs() > 1e-3 || z.dot(axis(matrix.z_axis)) < 0.999 {
        let expected = "turns, moves and even scales";
        return Err(Error::new(ErrorKind::Invalid, DESCRIPTION, path, "a transform that bends or mirrors", expected));
    }
    Ok(Frame { tangent: x, bitangent: y, normal: z })
}
