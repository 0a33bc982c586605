//! Cameras and films.

use glam::{DMat4, DVec3};

use super::transform;
use crate::scene::description::{self, Camera, Film, Filter, FovAxis};
use crate::scene::error::Error;
use crate::sensor::{FieldAxis, Perspective, PixelFilter, Projection, Sensor, Window};

/// The sensor behind a camera and its film.
pub(super) fn sensor(camera: &Camera, film: &Film) -> Result<Sensor, Error> {
    let (path, projection) = match camera {
        Camera::Perspective(camera) => ("camera.perspective.to_world", Projection::Perspective(perspective(camera))),
        Camera::Orthographic(camera) => ("camera.orthographic.to_world", Projection::Orthographic(camera.scale as f32)),
    };
    // The sensor's x points to the right of the picture, the description's to the left.
    let mirrored = camera.to_world().matrix() * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    Ok(Sensor { to_world: transform(mirrored, path)?, projection, window: window(film), filter: filter(film.filter) })
}

fn perspective(camera: &description::Perspective) -> Perspective {
    Perspective {
        half_tangent: libm::tan(camera.fov.to_radians() * 0.5) as f32,
        axis: match camera.fov_axis {
            FovAxis::X => FieldAxis::X,
            FovAxis::Y => FieldAxis::Y,
            FovAxis::Smaller => FieldAxis::Smaller,
            FovAxis::Larger => FieldAxis::Larger,
        },
        principal_point: camera.principal_point.map(|x| x as f32),
        lens_radius: camera.lens_radius as f32,
        focus_distance: camera.focus_distance as f32,
    }
}

fn window(film: &Film) -> Window {
    let Some(crop) = film.crop else { return Window::WHOLE };
    let part = |x: u32, y: u32| [f64::from(x) / f64::from(film.width), f64::from(y) / f64::from(film.height)];
    Window { corner: part(crop.x, crop.y), size: part(crop.width, crop.height) }
}

fn filter(filter: Filter) -> PixelFilter {
    match filter {
        Filter::Box => PixelFilter::Box,
        Filter::Tent(tent) => PixelFilter::Tent(tent.radius as f32),
        Filter::Gaussian(gaussian) => PixelFilter::gaussian(gaussian.deviation, gaussian.radius),
        Filter::Mitchell(mitchell) => PixelFilter::mitchell(mitchell.b, mitchell.c),
    }
}
