//! Cameras: from a place on the film to a ray.

use crate::lattice::Extent;
use crate::math::{Ray, Transform, Vec3};
use crate::sampling::warp::concentric_disk;

/// Which side of the film the field of view spans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldAxis {
    /// The width.
    X,
    /// The height.
    Y,
    /// The shorter of both.
    Smaller,
    /// The longer of both.
    Larger,
}

/// A perspective camera, with a thin lens where its radius is not 0. In its own frame it looks along +z, y is up and x to the right of the image.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    /// Camera to world. Scale is ignored.
    pub to_world: Transform,
    /// Tangent of half the field of view, > 0.
    pub half_tangent: f32,
    /// What that spans.
    pub axis: FieldAxis,
    /// Radius of the lens [m]; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus along the view direction [m], > 0.
    pub focus_distance: f32,
}

/// A sensor looking through a film of a certain size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    origin: Vec3,
    axes: [Vec3; 3],
    half: [f32; 2],
    pixels: [f32; 2],
    lens_radius: f32,
    focus_distance: f32,
}

impl Sensor {
    /// The view through a film.
    pub fn view(&self, extent: Extent) -> View {
        let (w, h) = (extent.width as f32, extent.height as f32);
        let spans_width = match self.axis {
            FieldAxis::X => true,
            FieldAxis::Y => false,
            FieldAxis::Smaller => w <= h,
            FieldAxis::Larger => w >= h,
        };
        let t = self.half_tangent;
        let half = if spans_width { [t, t * (h / w)] } else { [t * (w / h), t] };
        View {
            origin: self.to_world.point(Vec3::ZERO),
            axes: [Vec3::X, Vec3::Y, Vec3::Z].map(|a| self.to_world.vector(a).normalize()),
            half,
            pixels: [w, h],
            lens_radius: self.lens_radius,
            focus_distance: self.focus_distance,
        }
    }
}

impl View {
    /// The ray through a film position [pixels, from the upper left corner] and a lens position in [0, 1)².
    ///
    /// Radiance averaged over a pixel's area (and the lens) is the pixel's value: importance is 1 in film measure.
    #[inline]
    pub fn ray(&self, film: [f32; 2], lens: [f32; 2]) -> Ray {
        let x = (2.0 * film[0] / self.pixels[0] - 1.0) * self.half[0];
        let y = (1.0 - 2.0 * film[1] / self.pixels[1]) * self.half[1];
        let [right, up, forward] = self.axes;
        let direction = right * x + up * y + forward;
        if self.lens_radius == 0.0 {
            return Ray::new(self.origin, direction.normalize());
        }
        let focus = self.origin + direction * self.focus_distance;
        let d = concentric_disk(lens) * self.lens_radius;
        let origin = self.origin + right * d.x + up * d.y;
        Ray::new(origin, (focus - origin).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_of_view_and_focus() {
        let sensor = Sensor { to_world: Transform::IDENTITY, half_tangent: 1.0, axis: FieldAxis::X, lens_radius: 0.1, focus_distance: 3.0 };
        let view = sensor.view(Extent { width: 20, height: 10 });
        // All lens positions meet in the plane of focus.
        let at_focus = |lens| {
            let ray = view.ray([20.0, 5.0], lens);
            ray.origin + ray.direction * (3.0 / ray.direction.z)
        };
        assert!((at_focus([0.1, 0.9]) - Vec3::new(3.0, 0.0, 3.0)).length() < 1e-5);
        assert!((at_focus([0.7, 0.2]) - Vec3::new(3.0, 0.0, 3.0)).length() < 1e-5);
        let up = Sensor { lens_radius: 0.0, ..sensor }.view(Extent { width: 20, height: 10 }).ray([10.0, 0.0], [0.5, 0.5]);
        assert!((up.direction - Vec3::new(0.0, 0.5, 1.0).normalize()).length() < 1e-6);
    }
}
