//! Mitsuba's sensors: perspective, thin lens, orthographic.

use glam::{DMat3, DMat4};

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::{Camera, Film, FovAxis, Operation, Orthographic, Perspective, Transform};
use crate::scene::error::{Error, ErrorKind};

/// Diagonal of a frame of 35 mm film [mm], which Mitsuba measures focal lengths against.
const DIAGONAL: f64 = 43.266_615_305_567_87;

impl<'a> Context<'a> {
    /// Reads a sensor. Mitsuba's camera frame is ours (+Z forwards, +X to the left), so transforms carry over.
    pub(super) fn sensor(&mut self, element: &'a Element) -> Result<(Camera, Film), Error> {
        let kind = self.kind(element)?;
        let film = self.nested_one(element, "film")?;
        let film = self.film(film.ok_or_else(|| element.fault(ErrorKind::Malformed, "no <film>", "one"))?)?;
        let written = self.placing(element)?;
        let (to_world, scale) = self.unscaled(element, written)?;
        let camera = match kind {
            "perspective" => Camera::Perspective(self.perspective(element, to_world, scale, film, false)?),
            "thinlens" => Camera::Perspective(self.perspective(element, to_world, scale, film, true)?),
            "orthographic" => Camera::Orthographic(Orthographic { to_world, scale }),
            _ => return Err(self.unsupported(element, "perspective, thinlens or orthographic")),
        };
        self.leave(element, &["near_clip", "far_clip"], "nothing is clipped here")?;
        self.leave(element, &["shutter_open", "shutter_close"], "how long the shutter is open is said with the job")?;
        for sampler in self.nested(element, "sampler")? {
            self.note(sampler, "left aside: samples are chosen for each job");
            sampler.children.iter().for_each(|child| child.used.set(true));
        }
        // The medium around the camera: Mitsuba 3 takes any inside the sensor, 0.x calls it its exterior.
        if let Some(medium) = self.nested_one(element, "medium")? {
            self.around = Some(self.medium(medium)?);
        }
        self.finish(element, "what the kind of sensor needs, to_world, sampler and film")?;
        Ok((camera, film))
    }

    fn perspective(
        &mut self,
        element: &'a Element,
        to_world: Transform,
        scale: f64,
        film: Film,
        has_lens: bool,
    ) -> Result<Perspective, Error> {
        let (fov, fov_axis) = self.field_of_view(element, film)?;
        // A pinhole may carry a focus distance too; nothing is out of focus then.
        let focus = self.number(element, "focus_distance")?;
        let (mut lens_radius, mut focus_distance) = (0.0, 1.0);
        if has_lens {
            let missing = |what: &str| element.fault(ErrorKind::Malformed, format!("no {what}"), "aperture_radius and focus_distance");
            lens_radius = scale * self.number(element, "aperture_radius")?.ok_or_else(|| missing("aperture_radius"))?;
            focus_distance = scale * focus.ok_or_else(|| missing("focus_distance"))?;
            self.leave(element, &["blades"], "the lens is round here")?;
        }
        let offset = |context: &Self, axis| context.number(element, &format!("principal_point_offset_{axis}"));
        // Mitsuba moves the film under the line of sight, the description moves the line of sight over the film.
        let principal_point = [offset(self, "x")?, offset(self, "y")?].map(|offset| offset.map_or(0.0, |offset| -offset));
        Ok(Perspective { to_world, fov, fov_axis, lens_radius, principal_point, focus_distance })
    }

    fn field_of_view(&mut self, element: &'a Element, film: Film) -> Result<(f64, FovAxis), Error> {
        let (width, height) = (f64::from(film.width), f64::from(film.height));
        // Half the tangent's share that falls to the width.
        let along_x = |diagonal: f64| {
            let tangent = libm::tan(diagonal.to_radians() / 2.0) * width / (width * width + height * height).sqrt();
            2.0 * libm::atan(tangent).to_degrees()
        };
        let axis = self.word(element, "fov_axis")?;
        if let Some(length) = self.parameter(element, "focal_length")? {
            let value = self.required(length, "value")?;
            let millimetres = self.one_number(length, value.trim_end_matches("mm"))?;
            if millimetres <= 0.0 || element.children.iter().any(|child| child.attribute("name") == Some("fov")) {
                return Err(length.fault(ErrorKind::Invalid, format!("{value:?}"), "a length above 0, and no fov beside it"));
            }
            let diagonal = 2.0 * libm::atan(DIAGONAL / (2.0 * millimetres)).to_degrees();
            return Ok((along_x(diagonal), FovAxis::X));
        }
        let fov = match self.number(element, "fov")? {
            Some(fov) => fov,
            // What Mitsuba takes for a lens of 50 mm.
            None => return Ok((along_x(2.0 * libm::atan(DIAGONAL / 100.0).to_degrees()), FovAxis::X)),
        };
        Ok(match axis {
            None | Some("x") => (fov, FovAxis::X),
            Some("y") => (fov, FovAxis::Y),
            Some("smaller") => (fov, FovAxis::Smaller),
            Some("larger") => (fov, FovAxis::Larger),
            Some("diagonal") => (along_x(fov), FovAxis::X),
            Some(other) => {
                let expected = "x, y, diagonal, smaller or larger";
                return Err(element.fault(ErrorKind::Unsupported, format!("fov_axis {other:?}"), expected));
            }
        })
    }

    /// A transform without its even scale, and that scale.
    fn unscaled(&self, element: &'a Element, written: Transform) -> Result<(Transform, f64), Error> {
        if written.nodes().next().is_some() {
            // Scales of what moves are taken out of cameras at each instant.
            let matrix = self.first(&written);
            return Ok((written, if self.kind(element)? == "orthographic" { matrix.x_axis.truncate().length() } else { 1.0 }));
        }
        let matrix = written.matrix();
        let scale = matrix.x_axis.truncate().length();
        let is_even = [matrix.y_axis, matrix.z_axis].iter().all(|axis| (axis.truncate().length() - scale).abs() <= 1e-3 * scale);
        if !(matrix.is_finite() && scale > 0.0) || (scale - 1.0).abs() < 1e-4 && is_even {
            // As written; what is degenerate is found by the check of the description.
            return Ok((written, 1.0));
        }
        let is_orthographic = self.kind(element)? == "orthographic";
        let across = (matrix.y_axis.truncate().length() - scale).abs() <= 1e-3 * scale;
        if !(is_even || is_orthographic && across) {
            return Err(element.fault(ErrorKind::Unsupported, "a to_world that stretches", "turns, moves and even scales"));
        }
        let frame = DMat3::from_mat4(matrix);
        let unit = [frame.x_axis, frame.y_axis, frame.z_axis].map(|axis| axis / axis.length());
        let plain = DMat4::from_cols(unit[0].extend(0.0), unit[1].extend(0.0), unit[2].extend(0.0), matrix.w_axis);
        Ok((Transform(vec![Operation::Matrix(plain.transpose().to_cols_array_2d())]), scale))
    }
}
