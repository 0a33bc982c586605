//! The camera, the film and its filter.

use glam::{DMat3, DMat4, DVec3};

use super::Importer;
use super::directive::rows;
use super::parameters::Parameters;
use crate::scene::description::film::{Gaussian, Mitchell, Tent};
use crate::scene::description::{Camera, Crop, Film, Filter, FovAxis, Orthographic, Perspective, Transform};
use crate::scene::error::{Error, ErrorKind};

/// pbrt's film without a word about it.
pub(super) fn default_film() -> Film {
    Film { filter: Filter::Gaussian(Gaussian { deviation: 0.5, radius: 1.5 }), ..Film::new(1280, 720) }
}

impl Importer<'_> {
    /// `Film`.
    pub(super) fn film(&mut self, kind: &str, parameters: &Parameters) -> Result<(), Error> {
        if kind != "rgb" {
            self.note(parameters, "read as an rgb film");
        }
        self.film.width = parameters.index("xresolution")?.unwrap_or(1280);
        self.film.height = parameters.index("yresolution")?.unwrap_or(720);
        let (width, height) = (f64::from(self.film.width), f64::from(self.film.height));
        let pixels = |least: f64, most: f64| (least.max(0.0).ceil() as u32, (most.max(0.0).ceil()) as u32);
        let mut sides = None;
        if let Some([x0, x1, y0, y1]) = parameters.vectors::<4>("cropwindow")?.and_then(|list| list.first().copied()) {
            sides = Some((pixels(x0 * width, x1 * width), pixels(y0 * height, y1 * height)));
        }
        if let Some([x0, x1, y0, y1]) = parameters.vectors::<4>("pixelbounds")?.and_then(|list| list.first().copied()) {
            sides = Some((pixels(x0, x1), pixels(y0, y1)));
        }
        self.film.crop =
            sides.map(|((x, x_end), (y, y_end))| Crop { x, y, width: x_end.saturating_sub(x), height: y_end.saturating_sub(y) });
        self.exposure *= parameters.number_or("iso", 100.0)? / 100.0;
        if let Some(sensor) = parameters.text("sensor")?.filter(|sensor| *sensor != "cie1931") {
            let sentence = format!("the sensor {sensor:?} is taken for cie1931, whose colours are plain");
            self.note(parameters, sentence);
        }
        if parameters.number_or("whitebalance", 0.0)? != 0.0 {
            self.note(parameters, "whitebalance is left out");
        }
        if parameters.number("maxcomponentvalue")?.is_some() {
            self.note(parameters, "maxcomponentvalue is left out: nothing is cut");
        }
        parameters.pass_over(&["filename", "savefp16", "diagonal", "coordinatesystem"]);
        self.note_unread(parameters);
        Ok(())
    }

    /// `PixelFilter`.
    pub(super) fn filter(&mut self, kind: &str, parameters: &Parameters) -> Result<(), Error> {
        let default = match kind {
            "box" => 0.5,
            "gaussian" => 1.5,
            "sinc" => 4.0,
            _ => 2.0,
        };
        let (x, y) = (parameters.number_or("xradius", default)?, parameters.number_or("yradius", default)?);
        if x != y {
            self.note(parameters, format!("its radius is {x} both ways"));
        }
        self.film.filter = match kind {
            "box" => {
                if x != 0.5 {
                    self.note(parameters, format!("its radius is 0.5, a pixel's own area, and not {x}"));
                }
                Filter::Box
            }
            "triangle" => Filter::Tent(Tent { radius: x }),
            "gaussian" => Filter::Gaussian(Gaussian { deviation: parameters.number_or("sigma", 0.5)?, radius: x }),
            "mitchell" => {
                if x != 2.0 {
                    self.note(parameters, format!("its radius is 2 and not {x}"));
                }
                Filter::Mitchell(Mitchell { b: parameters.number_or("B", 1.0 / 3.0)?, c: parameters.number_or("C", 1.0 / 3.0)? })
            }
            _ => {
                self.note(parameters, "not here: Mitchell and Netravali's stands for it");
                Filter::Mitchell(Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 })
            }
        };
        parameters.pass_over(&["tau"]);
        self.note_unread(parameters);
        Ok(())
    }

    /// Takes the time that the shutter is open into the exposure.
    pub(super) fn expose(&mut self) -> Result<(), Error> {
        let Some((parameters, _, _)) = &self.pending_camera else { return Ok(()) };
        let open = parameters.number_or("shutterclose", 1.0)? - parameters.number_or("shutteropen", 0.0)?;
        // A shutter that opens for no time freezes motion; pbrt's own pictures are black then, which nobody wants.
        if open > 0.0 {
            self.exposure *= open;
        }
        Ok(())
    }

    /// Makes the camera, now that the film is known.
    pub(super) fn place_camera(&mut self) -> Result<(), Error> {
        let Some((parameters, kind, world_to_camera)) = self.pending_camera.take() else { return Ok(()) };
        let parameters = &parameters;
        let (frame, scale) = frame(world_to_camera).ok_or_else(|| {
            let expected = "turns, moves, mirrors and even scales";
            parameters.fault_here(ErrorKind::Unsupported, "a transform that stretches", expected)
        })?;
        let aspect = f64::from(self.film.width) / f64::from(self.film.height.max(1));
        let aspect = match parameters.number("frameaspectratio")? {
            Some(wanted) if (wanted / aspect - 1.0).abs() > 1e-3 => {
                self.note(parameters, format!("frameaspectratio {wanted} is left out: pixels are square"));
                aspect
            }
            _ => aspect,
        };
        let plain = if aspect > 1.0 { [-aspect, aspect, -1.0, 1.0] } else { [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect] };
        let [x0, x1, y0, y1] = parameters.vector_or("screenwindow", plain)?;
        let (width, height) = (x1 - x0, y1 - y0);
        if !(width > 0.0 && height > 0.0) {
            return Err(parameters.fault_here(
                ErrorKind::Invalid,
                format!("the screen window {:?}", [x0, x1, y0, y1]),
                "x0 < x1 and y0 < y1",
            ));
        }
        if (width / height / aspect - 1.0).abs() > 1e-3 {
            self.note(parameters, "the height of its screen window is left out: pixels are square");
        }
        match kind.as_str() {
            "perspective" => {
                let mut fov = parameters.number_or("fov", 90.0)?;
                if let Some(half) = parameters.number("halffov")? {
                    fov = 2.0 * half;
                }
                if !(fov > 0.0 && fov < 180.0) {
                    return Err(parameters.fault_here(ErrorKind::Invalid, format!("fov {fov}"), "an angle in (0, 180) degrees"));
                }
                let half_width = libm::tan((fov * 0.5).to_radians()) * width * 0.5;
                let lens_radius = parameters.number_or("lensradius", 0.0)? * scale;
                let focus = parameters.number_or("focaldistance", 1e6)? * scale;
                self.camera = Some(Camera::Perspective(Perspective {
                    to_world: Transform(vec![rows(frame)]),
                    fov: 2.0 * libm::atan(half_width).to_degrees(),
                    fov_axis: FovAxis::X,
                    lens_radius,
                    principal_point: [-(x0 + x1) / (2.0 * width), (y0 + y1) / (2.0 * height)],
                    focus_distance: if lens_radius > 0.0 { focus } else { 1.0 },
                }));
            }
            "orthographic" => {
                // A window off the centre is a camera that stands elsewhere; X of its frame points to the left.
                let shift = DVec3::new(-(x0 + x1) * 0.5, (y0 + y1) * 0.5, 0.0) * scale;
                let frame = frame * DMat4::from_translation(shift);
                if parameters.number_or("lensradius", 0.0)? > 0.0 {
                    self.note(parameters, "lensradius is left out: parallel rays go through no lens");
                }
                parameters.pass_over(&["focaldistance"]);
                self.camera =
                    Some(Camera::Orthographic(Orthographic { to_world: Transform(vec![rows(frame)]), scale: width * 0.5 * scale }));
            }
            _ => {
                return Err(parameters.fault_here(ErrorKind::Unsupported, "a camera that is not here", "perspective or orthographic"));
            }
        }
        parameters.pass_over(&["shutteropen", "shutterclose"]);
        self.note_unread(parameters);
        Ok(())
    }
}

/// The camera's frame in the world, X to the left of the picture, and its scale; `None` if it is not an even one.
fn frame(world_to_camera: DMat4) -> Option<(DMat4, f64)> {
    let frame = world_to_camera.inverse();
    let turned = DMat3::from_mat4(frame);
    let scale = turned.x_axis.length();
    let gram = (turned.transpose() * turned) * (scale * scale).recip();
    let even = frame.is_finite() && gram.abs_diff_eq(DMat3::IDENTITY, 1e-3);
    even.then(|| (frame * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0) / scale), scale))
}
