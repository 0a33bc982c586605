//! Mitsuba's `perspective` and `thinlens` sensors and their film.

use super::super::xml::Element;
use super::context::Context;
use super::transform;
use crate::scene::description::{Camera, Film, FovAxis, Perspective};
use crate::scene::error::{Error, ErrorKind};

/// Reads a sensor. Mitsuba's camera frame is ours (+Z forwards, +X to the left), so transforms carry over.
pub(super) fn read(context: &mut Context<'_>, element: &Element) -> Result<(Camera, Film), Error> {
    let kind = context.kind(element)?;
    let has_lens = match kind.as_str() {
        "perspective" => false,
        "thinlens" => true,
        _ => return Err(context.unsupported(element, "perspective or thinlens")),
    };
    let fov = context.number(element, "fov")?.ok_or_else(|| {
        context.fault(element, ErrorKind::Unsupported, "no fov", "<float name=\"fov\" value=\"…\"/> (a focal_length is not read)")
    })?;
    let fov_axis = match context.word(element, "fov_axis")?.as_deref() {
        None | Some("x") => FovAxis::X,
        Some("y") => FovAxis::Y,
        Some("smaller") => FovAxis::Smaller,
        Some("larger") => FovAxis::Larger,
        Some(other) => {
            return Err(context.fault(element, ErrorKind::Unsupported, format!("fov_axis {other:?}"), "x, y, smaller or larger"));
        }
    };
    // A pinhole may carry a focus distance too; nothing is out of focus then.
    let focus = context.number(element, "focus_distance")?;
    let (mut lens_radius, mut focus_distance) = (0.0, 1.0);
    if has_lens {
        let missing = |what: &str| context.fault(element, ErrorKind::Malformed, format!("no {what}"), "aperture_radius and focus_distance");
        lens_radius = context.number(element, "aperture_radius")?.ok_or_else(|| missing("aperture_radius"))?;
        focus_distance = focus.ok_or_else(|| missing("focus_distance"))?;
    }
    let to_world = transform::to_world(context, element)?;
    for plane in ["near_clip", "far_clip"] {
        if let Some(distance) = context.number(element, plane)? {
            context.note(element, format!("{plane} {distance}: nothing is clipped here"));
        }
    }
    for sampler in context.tagged(element, "sampler") {
        context.note(sampler, "left aside: samples are chosen for each job");
    }
    let films = context.tagged(element, "film");
    let film = match films[..] {
        [one] => read_film(context, one)?,
        [] => return Err(context.fault(element, ErrorKind::Malformed, "no <film>", "one")),
        [_, second, ..] => return Err(context.fault(second, ErrorKind::Malformed, "a second film", "one")),
    };
    context.finish(element, "fov, fov_axis, to_world, aperture_radius, focus_distance, sampler and film")?;
    let camera = Perspective { to_world, fov, fov_axis, lens_radius, principal_point: [0.0; 2], focus_distance };
    Ok((Camera::Perspective(camera), film))
}

fn read_film(context: &mut Context<'_>, element: &Element) -> Result<Film, Error> {
    if context.kind(element)? != "hdrfilm" {
        return Err(context.unsupported(element, "hdrfilm"));
    }
    // Mitsuba's own defaults; sizes out of range are found when the description is checked.
    let width = context.integer(element, "width")?.unwrap_or(768);
    let height = context.integer(element, "height")?.unwrap_or(576);
    for format in ["file_format", "pixel_format", "component_format"] {
        let word = context.word(element, format)?;
        if let Some(word) = word.filter(|word| !["openexr", "rgb", "float32"].contains(&word.as_str())) {
            context.note(element, format!("{format} {word}: files are OpenEXR, RGB, float32 here"));
        }
    }
    if context.boolean(element, "sample_border")?.unwrap_or(false) {
        context.note(element, "sample_border: of no use with a box filter");
    }
    let filters = context.tagged(element, "rfilter");
    let kind = filters.first().map(|filter| context.kind(filter)).transpose()?;
    match kind.as_deref() {
        Some("box") => {}
        Some(other) => context.note(element, format!("reconstruction filter {other}: a box is used, edges look a little sharper")),
        None => context.note(element, "Mitsuba's gaussian reconstruction filter: a box is used, edges look a little sharper"),
    }
    context.finish(element, "width, height, file_format, pixel_format, component_format, sample_border and rfilter")?;
    let side = |side: i64| u32::try_from(side).unwrap_or(0);
    Ok(Film::new(side(width), side(height)))
}
