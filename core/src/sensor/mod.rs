//! Cameras: from a place on the film to a ray.

mod filter;
#[cfg(test)]
mod tests;

pub use filter::PixelFilter;

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

/// A camera and its film. In its own frame it looks along +z, y is up and x to the right of the image.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// Camera to world. Scale is ignored.
    pub to_world: Transform,
    /// How the film sees.
    pub projection: Projection,
    /// The part of the film that is rendered.
    pub window: Window,
    /// How radiance around a pixel's centre makes its value.
    pub filter: PixelFilter,
}

/// How a film sees.
#[derive(Clone, Copy, Debug)]
pub enum Projection {
    /// Through one point, or a thin lens around it.
    Perspective(Perspective),
    /// Along parallel rays; the film is twice this wide [m], > 0.
    Orthographic(f32),
}

/// Perspective projection.
#[derive(Clone, Copy, Debug)]
pub struct Perspective {
    /// Tangent of half the field of view, > 0.
    pub half_tangent: f32,
    /// What that spans.
    pub axis: FieldAxis,
    /// Where the line of sight meets the film, from its centre [fractions of width and height, right and down].
    pub principal_point: [f32; 2],
    /// Radius of the lens [m]; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus along the view direction [m], > 0.
    pub focus_distance: f32,
}

/// A part of the film, in fractions of the whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its upper left corner.
    pub corner: [f64; 2],
    /// Its width and height, > 0.
    pub size: [f64; 2],
}

impl Window {
    /// All of it.
    pub const WHOLE: Window = Window { corner: [0.0; 2], size: [1.0; 2] };
}

/// A sensor looking through a film of a certain size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    origin: Vec3,
    axes: [Vec3; 3],
    /// Half the whole film's width and height in the plane one metre away (perspective) or in the film's own (orthographic).
    half: [f32; 2],
    /// Pixels of the whole film.
    pixels: [f32; 2],
    /// From the window's corner to the film's, the line of sight moved to its centre [pixels].
    offset: [f32; 2],
    /// Radius of the lens and distance of the plane in focus; `None` where all rays are parallel.
    lens: Option<[f32; 2]>,
}

impl Sensor {
    /// The view through the window, which has this many pixels.
    pub fn view(&self, extent: Extent) -> View {
        let whole = |pixels: u32, axis: usize| f64::from(pixels) / self.window.size[axis];
        let whole = [whole(extent.width, 0), whole(extent.height, 1)];
        let [w, h] = whole.map(|pixels| pixels as f32);
        let (half, centre, lens) = match &self.projection {
            Projection::Perspective(perspective) => {
                let spans_width = match perspective.axis {
                    FieldAxis::X => true,
                    FieldAxis::Y => false,
                    FieldAxis::Smaller => w <= h,
                    FieldAxis::Larger => w >= h,
                };
                let t = perspective.half_tangent;
                let half = if spans_width { [t, t * (h / w)] } else { [t * (w / h), t] };
                (half, perspective.principal_point, Some([perspective.lens_radius, perspective.focus_distance]))
            }
            Projection::Orthographic(half) => ([*half, half * (h / w)], [0.0; 2], None),
        };
        let offset = |axis: usize| ((self.window.corner[axis] - f64::from(centre[axis])) * whole[axis]) as f32;
        View {
            origin: self.to_world.point(Vec3::ZERO),
            axes: [Vec3::X, Vec3::Y, Vec3::Z].map(|a| self.to_world.vector(a).normalize()),
            half,
            pixels: [w, h],
            offset: [offset(0), offset(1)],
            lens,
        }
    }
}

impl View {
    /// Whether rays depend on a lens position.
    #[inline]
    pub fn has_lens(&self) -> bool {
        self.lens.is_some_and(|[radius, _]| radius > 0.0)
    }

    /// Whether all rays are parallel.
    pub fn is_parallel(&self) -> bool {
        self.lens.is_none()
    }

    /// The ray through a film position [pixels, from the upper left corner of the window] and a lens position in [0, 1)².
    ///
    /// Radiance averaged by the pixel's filter (and over the lens) is the pixel's value: importance is 1 in film measure.
    #[inline]
    pub fn ray(&self, film: [f32; 2], lens: [f32; 2]) -> Ray {
        let x = (2.0 * (film[0] + self.offset[0]) / self.pixels[0] - 1.0) * self.half[0];
        let y = (1.0 - 2.0 * (film[1] + self.offset[1]) / self.pixels[1]) * self.half[1];
        let [right, up, forward] = self.axes;
        let Some([lens_radius, focus_distance]) = self.lens else {
            return Ray::new(self.origin + right * x + up * y, forward);
        };
        let direction = right * x + up * y + forward;
        if lens_radius == 0.0 {
            return Ray::new(self.origin, direction.normalize());
        }
        let focus = self.origin + direction * focus_distance;
        let d = concentric_disk(lens) * lens_radius;
        let origin = self.origin + right * d.x + up * d.y;
        Ray::new(origin, (focus - origin).normalize())
    }

    /// The film position at which the middle of the lens sees a point [pixels, from the upper left corner of the window; may lie outside
    /// it]; `None` for what is beside or behind the camera.
    pub fn project(&self, point: Vec3) -> Option<[f32; 2]> {
        self.onto_film(point - self.origin)
    }

    /// The film position at which the middle of the lens sees something infinitely far away; `None` for what is beside or behind the
    /// camera, and where all rays are parallel.
    pub fn project_direction(&self, direction: Vec3) -> Option<[f32; 2]> {
        self.lens.and_then(|_| self.onto_film(direction))
    }

    fn onto_film(&self, towards: Vec3) -> Option<[f32; 2]> {
        let [x, y, depth] = self.axes.map(|axis| towards.dot(axis));
        let scale = if self.lens.is_some() { 1.0 / depth } else { 1.0 };
        let film = [
            0.5 * (x * scale / self.half[0] + 1.0) * self.pixels[0] - self.offset[0],
            0.5 * (1.0 - y * scale / self.half[1]) * self.pixels[1] - self.offset[1],
        ];
        (depth > 0.0 && film.into_iter().all(f32::is_finite)).then_some(film)
    }
}
