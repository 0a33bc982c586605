//! Cameras.

use glam::{DMat4, DVec3};

use super::{transform, unsupported};
use crate::scene::description::{Camera, Film, Filter, FovAxis};
use crate::scene::error::Error;
use crate::sensor::{FieldAxis, Sensor};

/// The sensor behind a camera and its film.
pub(super) fn sensor(camera: &Camera, film: &Film) -> Result<Sensor, Error> {
    let Camera::Perspective(camera) = camera else { return Err(unsupported("camera", "an orthographic camera")) };
    if camera.principal_point != [0.0; 2] {
        return Err(unsupported("camera.perspective.principal_point", "a principal point off the centre"));
    }
    if film.crop.is_some() || film.filter != Filter::Box {
        return Err(unsupported("film", "a crop, or a filter other than the box"));
    }
    // The sensor's x points to the right of the picture, the description's to the left.
    let mirrored = camera.to_world.matrix() * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    Ok(Sensor {
        to_world: transform(mirrored, "camera.perspective.to_world")?,
        half_tangent: libm::tan(camera.fov.to_radians() * 0.5) as f32,
        axis: match camera.fov_axis {
            FovAxis::X => FieldAxis::X,
            FovAxis::Y => FieldAxis::Y,
            FovAxis::Smaller => FieldAxis::Smaller,
            FovAxis::Larger => FieldAxis::Larger,
        },
        lens_radius: camera.lens_radius as f32,
        focus_distance: camera.focus_distance as f32,
    })
}
