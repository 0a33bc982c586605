//! Spheres, disks and cylinders.

use glam::DMat4;

use super::DESCRIPTION;
use crate::geometry::{self, Analytic, Disk, Form};
use crate::math::{Frame, Transform};
use crate::scene::description::{Cylinder, Geometry, SceneDescription, Shape, Sphere};
use crate::scene::error::{Error, ErrorKind};

/// Whether a geometry is made of triangles.
pub(super) fn is_mesh(geometry: &Geometry) -> bool {
    match geometry {
        Geometry::Rectangle | Geometry::Cube | Geometry::Mesh(_) | Geometry::Obj(_) | Geometry::Ply(_) => true,
        Geometry::Sphere(_) | Geometry::Disk | Geometry::Cylinder(_) | Geometry::Instance(_) => false,
    }
}

/// The surface of a geometry that is given by a formula; `None` for any other.
pub(super) fn compile(scene: &SceneDescription, shape: &Shape, to_world: &Transform, path: &str) -> Result<Option<Analytic>, Error> {
    let matrix = shape.to_world.matrix();
    let surface = match &shape.geometry {
        Geometry::Sphere(one) => sphere(one, matrix),
        // The front is where the normal points to, whichever way x and y run about it.
        Geometry::Disk => Analytic { flipped: to_world.mirrors(), ..disk(matrix) },
        Geometry::Cylinder(one) => cylinder(one, matrix),
        _ => return Ok(None),
    };
    let bounds = surface.bounds();
    if !(bounds.lower.is_finite() && bounds.upper.is_finite() && surface.area() > 0.0 && surface.area().is_finite()) {
        let found = format!("a surface of area {} m² within {} and {}", surface.area(), bounds.lower, bounds.upper);
        return Err(Error::new(ErrorKind::Invalid, DESCRIPTION, path, found, "one that single precision can hold"));
    }
    // Without textures nothing asks where on the surface a point is.
    let textured = !scene.textures.is_empty();
    Ok(Some(Analytic { flipped: surface.flipped != shape.flip_normals, textured, ..surface }))
}

/// The images of the axes.
fn axes(matrix: DMat4) -> Frame {
    let axis = |axis: glam::DVec4| axis.truncate().normalize_or_zero().as_vec3();
    Frame { tangent: axis(matrix.x_axis), bitangent: axis(matrix.y_axis), normal: axis(matrix.z_axis) }
}

// Spheres and cylinders are checked to be scaled evenly, so any column tells the scale.

fn sphere(sphere: &Sphere, matrix: DMat4) -> Analytic {
    let centre = matrix.transform_point3(sphere.center.into()).as_vec3();
    let radius = (sphere.radius * matrix.x_axis.truncate().length()) as f32;
    Analytic { frame: axes(matrix), ..geometry::Sphere { centre, radius }.into() }
}

fn disk(matrix: DMat4) -> Analytic {
    let [x, y, centre] = [matrix.x_axis, matrix.y_axis, matrix.w_axis].map(|column| column.truncate().as_vec3());
    Analytic { frame: axes(matrix), ..Disk { centre, x, y }.into() }
}

fn cylinder(cylinder: &Cylinder, matrix: DMat4) -> Analytic {
    let ends = [cylinder.p0, cylinder.p1].map(glam::DVec3::from);
    let [start, end] = ends.map(|end| matrix.transform_point3(end));
    let axis = (end - start).normalize_or_zero().as_vec3();
    // Texture coordinates start where those of the tube in its own frame do.
    let own = Frame::from_normal((ends[1] - ends[0]).normalize_or_zero().as_vec3());
    let around = |v: crate::math::Vec3| matrix.transform_vector3(v.as_dvec3()).normalize_or_zero().as_vec3();
    let frame = Frame { tangent: around(own.tangent), bitangent: around(own.bitangent), normal: axis };
    let radius = (cylinder.radius * matrix.x_axis.truncate().length()) as f32;
    let form = geometry::Cylinder { start: start.as_vec3(), axis, length: (end - start).length() as f32, radius };
    Analytic { form: Form::Cylinder(form), frame, flipped: false, textured: true }
}
