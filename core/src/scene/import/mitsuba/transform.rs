//! Mitsuba's `<transform>`: the same operations as ours, the first applied first.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::{LookAt, Operation, Rotation, Transform};
use crate::scene::error::{Error, ErrorKind};

/// Reads the parameter `to_world`; without one nothing is changed.
pub(super) fn to_world(context: &mut Context<'_>, element: &Element) -> Result<Transform, Error> {
    let Some(parameter) = context.parameter(element, "to_world")? else { return Ok(Transform::default()) };
    if parameter.tag != "transform" {
        return Err(context.unsupported(parameter, "<transform>"));
    }
    let transform = Transform(parameter.children.iter().map(|child| operation(context, child)).collect::<Result<_, _>>()?);
    let linear = glam::DMat3::from_mat4(transform.matrix());
    if linear.determinant() < 0.0 && element.tag == "shape" {
        context.note(element, "its transform mirrors: here the front stays the front, in Mitsuba it depends on the kind of shape");
    }
    Ok(transform)
}

fn operation(context: &Context<'_>, element: &Element) -> Result<Operation, Error> {
    Ok(match element.tag.as_str() {
        "translate" => Operation::Translate(context.triple(element, 0.0)?),
        "scale" => Operation::Scale(context.triple(element, 1.0)?),
        "rotate" => Operation::Rotate(Rotation {
            axis: context.triple(element, 0.0)?,
            degrees: context.one_number(element, &context.required(element, "angle")?)?,
        }),
        "lookat" | "look_at" => Operation::LookAt(LookAt {
            origin: context.triple_in(element, "origin")?,
            target: context.triple_in(element, "target")?,
            up: context.triple_in(element, "up")?,
        }),
        "matrix" => Operation::Matrix(matrix(context, element)?),
        _ => return Err(context.unsupported(element, "translate, scale, rotate, lookat or matrix")),
    })
}

/// Sixteen numbers by rows, or nine for the linear part alone.
fn matrix(context: &Context<'_>, element: &Element) -> Result<[[f64; 4]; 4], Error> {
    let numbers = context.numbers(element, &context.required(element, "value")?)?;
    let side = match numbers.len() {
        9 => 3,
        16 => 4,
        count => return Err(context.fault(element, ErrorKind::Malformed, format!("{count} numbers"), "16, or 9, by rows")),
    };
    let mut rows = [[0.0; 4]; 4];
    rows[3][3] = 1.0;
    for (index, number) in numbers.into_iter().enumerate() {
        rows[index / side][index % side] = number;
    }
    Ok(rows)
}
