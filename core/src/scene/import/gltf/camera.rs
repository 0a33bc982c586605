//! Cameras, and one that frames the scene where the file has none.

use glam::{DMat4, DVec3};

use super::node::{NOWHERE, Walk, around};
use super::{Importer, Source, titled};
use crate::scene::description::{
    Camera, Film, FovAxis, Geometry, LookAt, Operation, Orthographic, Perspective, SceneDescription, Transform,
};
use crate::scene::error::{Error, ErrorKind};

/// The longer side of the film [pixels]: glTF has no films.
const SIDE: f64 = 960.0;

impl Walk {
    /// The first camera of the scene with its film, or one that sees all of the scene from the front.
    ///
    /// # Errors
    /// A camera of no kind, or whose node's frame is flat.
    pub(super) fn camera(&self, source: &Source<'_>, importer: &mut Importer) -> Result<(Camera, Film), Error> {
        let Some((index, stand)) = self.cameras.first() else {
            importer.note(format!("the file holds no camera: seen from the front, all of it, on a film of {SIDE} × 540 pixels"));
            return Ok((framing(&self.bounds), film(SIDE / 540.0)));
        };
        for (index, _) in &self.cameras[1..] {
            importer.note(format!(
                "{}: left out, the scene is seen through the first camera",
                titled("cameras", *index, &camera_name(source, *index))
            ));
        }
        let path = format!("cameras[{index}]");
        let camera = source.get(&source.document.cameras, *index, &path, "cameras")?;
        // A camera of ours looks the other way; half a turn around +Y.
        let to_world = if stand.rests() {
            upright(stand.rest)
        } else {
            Some(self.stands.to_world(&stand.then(DMat4::from_scale(DVec3::new(-1.0, 1.0, -1.0)))))
        };
        let to_world = to_world.ok_or_else(|| source.fault(ErrorKind::Invalid, &path, "a node whose frame is flat", "a frame"))?;
        let place = titled("cameras", *index, &camera.name);
        match (&camera.perspective, &camera.orthographic) {
            (Some(perspective), _) => {
                let film = film(perspective.aspect_ratio.unwrap_or(SIDE / 540.0));
                importer.note(format!("{place}: the film has {} × {} pixels, since glTF says no size", film.width, film.height));
                let camera = Perspective {
                    to_world,
                    fov: perspective.yfov.to_degrees(),
                    fov_axis: FovAxis::Y,
                    lens_radius: 0.0,
                    principal_point: [0.0; 2],
                    focus_distance: 1.0,
                };
                Ok((Camera::Perspective(camera), film))
            }
            (None, Some(orthographic)) => {
                let film = film(orthographic.xmag / orthographic.ymag);
                importer.note(format!("{place}: the film has {} × {} pixels, since glTF says no size", film.width, film.height));
                Ok((Camera::Orthographic(Orthographic { to_world, scale: orthographic.xmag.abs() }), film))
            }
            (None, None) => Err(source.fault(ErrorKind::Malformed, &path, "no projection", "perspective or orthographic")),
        }
    }
}

fn camera_name(source: &Source<'_>, index: usize) -> String {
    source.document.cameras.get(index).map(|camera| camera.name.clone()).unwrap_or_default()
}

/// A film of this ratio of width to height; a ratio that makes no sense counts as a square.
fn film(aspect: f64) -> Film {
    let aspect = if aspect.is_finite() && (1e-2..=1e2).contains(&aspect) { aspect } else { 1.0 };
    let (width, height) = if aspect >= 1.0 { (SIDE, SIDE / aspect) } else { (SIDE * aspect, SIDE) };
    Film::new(width.round() as u32, height.round() as u32)
}

/// The frame of a camera that looks along +Z, from that of one that looks along −Z; scales are taken out, as glTF asks.
fn upright(node: DMat4) -> Option<Transform> {
    let axes = [-node.x_axis, node.y_axis, -node.z_axis].map(|axis| axis.truncate().try_normalize());
    let [Some(x), Some(y), Some(z)] = axes else { return None };
    // Sheared frames, which are rare, are squared up around the line of sight.
    let left = y.cross(z).try_normalize()?;
    let left = if left.dot(x) < 0.0 { -left } else { left };
    let up = (y - z * y.dot(z)).try_normalize()?;
    let frame = DMat4::from_cols(left.extend(0.0), up.extend(0.0), z.extend(0.0), node.w_axis);
    Some(Transform(vec![super::node::rows(frame)]))
}

/// Puts a camera where it sees what the scene is at all times, as far as a few of them tell. `boxes` are those of the shapes.
///
/// # Errors
/// Values between keys that leave their domain.
pub(super) fn frame_at_all_times(scene: &mut SceneDescription, boxes: &[[DVec3; 2]]) -> Result<(), Error> {
    const TIMES: u32 = 24;
    let [start, end] = scene.animation.as_ref().and_then(|animation| animation.span()).unwrap_or_default();
    let mut bounds = NOWHERE;
    for k in 0..=TIMES {
        let still = scene.at(start + (end - start) * f64::from(k) / f64::from(TIMES))?;
        for (shape, own) in still.shapes.iter().zip(boxes) {
            let own = match &shape.geometry {
                Geometry::Mesh(mesh) => mesh.positions.iter().fold(NOWHERE, |[from, to], point| {
                    let point = DVec3::from(point.map(f64::from));
                    [from.min(point), to.max(point)]
                }),
                _ => *own,
            };
            bounds = around(bounds, own, shape.to_world.matrix());
        }
    }
    scene.camera = framing(&bounds);
    Ok(())
}

/// A camera that sees all of a box from +Z, a little from above.
fn framing([least, most]: &[DVec3; 2]) -> Camera {
    const FOV: f64 = 30.0;
    let known = least.cmple(*most).all();
    let (centre, radius) = if known { ((*least + *most) * 0.5, ((*most - *least).length() * 0.5).max(1e-3)) } else { (DVec3::ZERO, 1.0) };
    // The vertical field is the smaller one: a ball of this radius just fits.
    let distance = radius / libm::sin((FOV * 0.5).to_radians()) * 1.02;
    let origin = centre + DVec3::new(0.35, 0.3, 1.0).normalize() * distance;
    Camera::Perspective(Perspective {
        to_world: Transform(vec![Operation::LookAt(LookAt { origin: origin.into(), target: centre.into(), up: [0.0, 1.0, 0.0] })]),
        fov: FOV,
        fov_axis: FovAxis::Smaller,
        lens_radius: 0.0,
        principal_point: [0.0; 2],
        focus_distance: 1.0,
    })
}
