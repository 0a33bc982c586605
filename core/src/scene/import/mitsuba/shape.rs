//! Mitsuba's shapes and the area lights inside them.

use super::super::xml::Element;
use super::context::Context;
use super::transform;
use crate::scene::description::{Colour, Emission, Geometry, MeshFile, Normals, Shape, Sphere};
use crate::scene::error::{Error, ErrorKind};

/// Reads a `<shape>` but for its material.
pub(super) fn read(context: &mut Context<'_>, element: &Element) -> Result<Shape, Error> {
    let kind = context.kind(element)?;
    let geometry = match kind.as_str() {
        "rectangle" => Geometry::Rectangle,
        "cube" => Geometry::Cube,
        "sphere" => Geometry::Sphere(Sphere {
            center: context.point(element, "center")?.unwrap_or_default(),
            radius: context.number(element, "radius")?.unwrap_or(1.0),
        }),
        "obj" => Geometry::Obj(mesh(context, element)?),
        "ply" => Geometry::Ply(mesh(context, element)?),
        _ => return Err(context.unsupported(element, "rectangle, cube, sphere, obj or ply")),
    };
    let to_world = transform::to_world(context, element)?;
    let flip_normals = context.boolean(element, "flip_normals")?.unwrap_or(false);
    let emission = emission(context, element)?;
    context.finish(element, "to_world, flip_normals, a bsdf or ref, an area emitter, and what the kind of shape needs")?;
    let name = context.id(element)?.unwrap_or_default();
    Ok(Shape { name, geometry, to_world, material: None, emission, interior: None, exterior: None, flip_normals })
}

/// A mesh file. Without normals of its own Mitsuba makes smooth ones, unless `face_normals` says otherwise.
fn mesh(context: &mut Context<'_>, element: &Element) -> Result<MeshFile, Error> {
    let file = context.word(element, "filename")?;
    let file =
        file.ok_or_else(|| context.fault(element, ErrorKind::Malformed, "no filename", "<string name=\"filename\" value=\"…\"/>"))?;
    let normals = if context.boolean(element, "face_normals")?.unwrap_or(false) { Normals::Flat } else { Normals::Smooth };
    if context.boolean(element, "flip_tex_coords")?.is_some() {
        context.note(element, "flip_tex_coords: there are no textures here");
    }
    Ok(MeshFile { file: file.trim_start_matches("./").to_string(), normals })
}

fn emission(context: &Context<'_>, element: &Element) -> Result<Option<Emission>, Error> {
    let emitters = context.tagged(element, "emitter");
    let emitter = match emitters[..] {
        [] => return Ok(None),
        [one] => one,
        [_, second, ..] => return Err(context.fault(second, ErrorKind::Malformed, "a second emitter", "one for each shape")),
    };
    if context.kind(emitter)? != "area" {
        return Err(context.unsupported(emitter, "area"));
    }
    let radiance = context.colour(emitter, "radiance")?.unwrap_or(Colour::WHITE);
    context.finish(emitter, "radiance")?;
    Ok(Some(Emission { radiance: radiance.into(), two_sided: false }))
}
