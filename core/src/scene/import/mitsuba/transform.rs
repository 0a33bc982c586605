//! Mitsuba's `<transform>`: the same operations as ours, the first applied first; and those of texture coordinates.

use super::super::xml::Element;
use super::context::Context;
use crate::scene::description::{LookAt, Operation, Rotation, Transform, UvTransform};
use crate::scene::error::{Error, ErrorKind};

impl<'a> Context<'a> {
    /// Reads the parameter `to_world`; without one nothing is changed. An `<animation>` becomes a node.
    pub(super) fn placing(&mut self, element: &'a Element) -> Result<Transform, Error> {
        let Some(parameter) = self.parameter(element, "to_world")? else { return Ok(Transform::default()) };
        if parameter.tag == "animation" && self.old {
            return self.moving(parameter);
        }
        if parameter.tag != "transform" {
            return Err(self.unsupported(parameter, "<transform>"));
        }
        Ok(Transform(parameter.children.iter().map(|child| self.operation(child)).collect::<Result<_, _>>()?))
    }

    pub(super) fn operation(&self, element: &'a Element) -> Result<Operation, Error> {
        Ok(match element.tag.as_str() {
            "translate" => Operation::Translate(self.triple(element, 0.0)?),
            "scale" => Operation::Scale(self.triple(element, 1.0)?),
            "rotate" => Operation::Rotate(Rotation {
                // Where an axis is given as one number it is not the same along all three.
                axis: self.triple(element, 0.0)?,
                degrees: self.one_number(element, self.required(element, "angle")?)?,
            }),
            "lookat" | "look_at" => {
                let (origin, target) = (self.triple_in(element, "origin")?, self.triple_in(element, "target")?);
                let up = match element.attribute("up") {
                    Some(_) => self.triple_in(element, "up")?,
                    // Mitsuba takes any direction across the line of sight.
                    None => across(origin, target),
                };
                Operation::LookAt(LookAt { origin, target, up })
            }
            "matrix" => Operation::Matrix(self.matrix(element)?),
            _ => return Err(self.unsupported(element, "translate, scale, rotate, lookat or matrix")),
        })
    }

    /// Sixteen numbers by rows, or nine for the linear part alone.
    fn matrix(&self, element: &'a Element) -> Result<[[f64; 4]; 4], Error> {
        let numbers = self.numbers(element, self.required(element, "value")?)?;
        let side = match numbers.len() {
            9 => 3,
            16 => 4,
            count => return Err(element.fault(ErrorKind::Malformed, format!("{count} numbers"), "16, or 9, by rows")),
        };
        let mut rows = [[0.0; 4]; 4];
        rows[3][3] = 1.0;
        for (index, number) in numbers.into_iter().enumerate() {
            rows[index / side][index % side] = number;
        }
        Ok(rows)
    }

    /// Reads `to_uv`, or the four numbers `uscale`, `vscale`, `uoffset` and `voffset` of Mitsuba 0.x.
    pub(super) fn to_uv(&self, element: &'a Element) -> Result<Uv, Error> {
        let mut uv = Uv::default();
        if self.old {
            let scale = self.number(element, "uvscale")?.unwrap_or(1.0);
            let number = |context: &Self, name: &str, or: f64| context.number(element, name).map(|value| value.unwrap_or(or));
            uv.columns = [[number(self, "uscale", scale)?, 0.0], [0.0, number(self, "vscale", scale)?]];
            uv.offset = [number(self, "uoffset", 0.0)?, number(self, "voffset", 0.0)?];
        }
        let Some(parameter) = self.parameter(element, "to_uv")? else { return Ok(uv) };
        if parameter.tag != "transform" {
            return Err(self.unsupported(parameter, "<transform>"));
        }
        for child in &parameter.children {
            uv = uv.then(&self.uv_operation(child)?);
        }
        Ok(uv)
    }

    fn uv_operation(&self, element: &'a Element) -> Result<Uv, Error> {
        let plain = Uv::default();
        Ok(match element.tag.as_str() {
            "translate" => {
                let [u, v, _] = self.triple(element, 0.0)?;
                Uv { offset: [u, v], ..plain }
            }
            "scale" => {
                let [u, v, _] = self.triple(element, 1.0)?;
                Uv { columns: [[u, 0.0], [0.0, v]], ..plain }
            }
            "rotate" => {
                let angle = self.one_number(element, self.required(element, "angle")?)?.to_radians();
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                Uv { columns: [[cos, sin], [-sin, cos]], ..plain }
            }
            "matrix" => {
                let numbers = self.numbers(element, self.required(element, "value")?)?;
                // A 3 × 3 matrix has its offset in the third column; of a 4 × 4 one Mitsuba drops the third row and column.
                let (at, right) = match numbers.len() {
                    9 => (3, 2),
                    16 => (4, 3),
                    count => return Err(element.fault(ErrorKind::Malformed, format!("{count} numbers"), "9, or 16, by rows")),
                };
                let column = |column: usize| [numbers[column], numbers[at + column]];
                Uv { columns: [column(0), column(1)], offset: column(right) }
            }
            _ => return Err(self.unsupported(element, "translate, scale, rotate or matrix")),
        })
    }
}

/// A direction that is not along the line of sight.
fn across(origin: [f64; 3], target: [f64; 3]) -> [f64; 3] {
    let sight = glam::DVec3::from(target) - glam::DVec3::from(origin);
    let smallest = sight.abs().min_element();
    if sight.x.abs() == smallest {
        [1.0, 0.0, 0.0]
    } else if sight.y.abs() == smallest {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    }
}

/// An affine map of texture coordinates: uv′ = columns · uv + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Uv {
    columns: [[f64; 2]; 2],
    offset: [f64; 2],
}

impl Default for Uv {
    fn default() -> Uv {
        Uv { columns: [[1.0, 0.0], [0.0, 1.0]], offset: [0.0, 0.0] }
    }
}

impl Uv {
    /// v′ = 1 − v.
    pub(super) const UPSIDE_DOWN: Uv = Uv { columns: [[1.0, 0.0], [0.0, -1.0]], offset: [0.0, 1.0] };

    /// This map first, another after it.
    pub(super) fn then(&self, after: &Uv) -> Uv {
        let linear = |[u, v]: [f64; 2]| [0, 1].map(|row| after.columns[0][row] * u + after.columns[1][row] * v);
        let moved = linear(self.offset);
        Uv { columns: self.columns.map(linear), offset: [moved[0] + after.offset[0], moved[1] + after.offset[1]] }
    }

    /// In the description's words; `None` for a map that shears.
    pub(super) fn described(&self) -> Option<UvTransform> {
        let [[a, b], [c, d]] = self.columns;
        let (first, second) = ((a * a + b * b).sqrt(), (c * c + d * d).sqrt());
        if (a * c + b * d).abs() > 1e-6 * first * second {
            return None;
        }
        if b == 0.0 && c == 0.0 {
            return Some(UvTransform { scale: [a, d], rotate: 0.0, offset: self.offset });
        }
        let turned = if a * d - b * c < 0.0 { -second } else { second };
        // Where the first axis is flattened the second tells the angle.
        let angle = if first > 0.0 { libm::atan2(b, a) } else { libm::atan2(-c, d) };
        Some(UvTransform { scale: [first, turned], rotate: angle.to_degrees(), offset: self.offset })
    }

    /// The map that the description writes so.
    pub(super) fn of(uv: &UvTransform) -> Uv {
        let angle = uv.rotate.to_radians();
        let (sin, cos) = if uv.rotate == 0.0 { (0.0, 1.0) } else { (libm::sin(angle), libm::cos(angle)) };
        let [su, sv] = uv.scale;
        Uv { columns: [[su * cos, su * sin], [-sv * sin, sv * cos]], offset: uv.offset }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(uv: &UvTransform, [u, v]: [f64; 2]) -> [f64; 2] {
        let map = Uv::of(uv);
        [0, 1].map(|row| map.columns[0][row] * u + map.columns[1][row] * v + map.offset[row])
    }

    #[test]
    fn maps_of_texture_coordinates_survive_the_description() {
        let turn = Uv { columns: [[0.6, 0.8], [-0.8, 0.6]], offset: [0.0, 0.0] };
        let stretch = Uv { columns: [[3.0, 0.0], [0.0, -2.0]], offset: [0.25, -1.0] };
        let whole = stretch.then(&turn).then(&Uv::UPSIDE_DOWN);
        let described = whole.described().unwrap();
        for point in [[0.0, 0.0], [1.0, 0.0], [0.3, 0.7]] {
            let [u, v] = point;
            let (u, v) = (3.0 * u + 0.25, -2.0 * v - 1.0);
            let expected = [0.6 * u - 0.8 * v, 1.0 - (0.8 * u + 0.6 * v)];
            let found = apply(&described, point);
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} is not {expected:?}");
        }
        assert_eq!(turn.then(&stretch).described(), None, "a turn before an uneven stretch shears");
        let twice = Uv::UPSIDE_DOWN.then(&Uv::UPSIDE_DOWN).described().unwrap();
        assert_eq!(twice, UvTransform::default());
    }
}
