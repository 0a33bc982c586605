//! PLY, text and binary, through `ply-rs-bw`: vertices with normals and texture coordinates, faces as fans.

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult, PropertyType};

use super::bounded;
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};
use crate::scene::error::{Error, ErrorKind};

/// Reads a PLY file; `file` is the name that errors carry.
pub(super) fn parse(bytes: &[u8], file: &str) -> Result<Mesh, Error> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(|fault| malformed(&fault, file))?;
    let missing = |what: &str, expected: &str| Error::new(ErrorKind::Malformed, file, "header", format!("no {what}"), expected);
    let mut mesh = Mesh::default();
    for (name, element) in &header.elements {
        // Every element takes a byte at least, so a count past that is a lie, told before anything is allocated for it.
        if element.count > bytes.len() {
            let found = format!("{} times `{name}` in a file of {} bytes", element.count, bytes.len());
            return Err(Error::new(ErrorKind::Malformed, file, "header", found, "a count that the file can hold"));
        }
        match name.as_str() {
            "vertex" => {
                bounded(element.count, "vertices", file)?;
                for axis in ["x", "y", "z"] {
                    if !has(element, axis) {
                        return Err(missing(&format!("property `{axis}` of `vertex`"), "x, y and z"));
                    }
                }
                let vertices = read::<Vertex>(&mut reader, element, &header, file)?;
                mesh.positions = vertices.iter().map(|vertex| vertex.position).collect();
                if ["nx", "ny", "nz"].iter().all(|name| has(element, name)) {
                    mesh.normals = vertices.iter().map(|vertex| vertex.normal.normalize_or_zero()).collect();
                }
                if UV_NAMES.iter().any(|[u, v]| has(element, u) && has(element, v)) {
                    mesh.uvs = vertices.iter().map(|vertex| vertex.uv).collect();
                }
                if ["red", "green", "blue"].iter().all(|name| has(element, name)) {
                    mesh.colours = vertices.iter().map(|vertex| vertex.colour).collect();
                }
            }
            "face" => {
                bounded(element.count, "faces", file)?;
                let is_list = |name: &str| element.properties.get(name).is_some_and(|p| matches!(p.data_type, PropertyType::List(..)));
                if !INDEX_NAMES.iter().any(|name| is_list(name)) {
                    return Err(missing("list property `vertex_indices` of `face`", "the corners of each face"));
                }
                let faces = read::<Face>(&mut reader, element, &header, file)?;
                bounded(faces.iter().map(|face| face.0.len().saturating_sub(2)).sum(), "triangles", file)?;
                for (index, face) in faces.iter().enumerate() {
                    fan(&face.0, index, file, &mut mesh.triangles)?;
                }
            }
            _ => drop(read::<Skipped>(&mut reader, element, &header, file)?),
        }
    }
    if mesh.positions.is_empty() {
        return Err(missing("element `vertex`", "vertices and faces"));
    }
    Ok(mesh)
}

const UV_NAMES: [[&str; 2]; 4] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
const INDEX_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

fn has(element: &ElementDef, name: &str) -> bool {
    element.properties.get(name).is_some_and(|property| matches!(property.data_type, PropertyType::Scalar(_)))
}

fn read<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &ply_rs_bw::ply::Header,
    file: &str,
) -> Result<Vec<E>, Error> {
    Parser::<E>::new().read_payload_for_element(reader, element, header).map_err(|fault| malformed(&fault, file))
}

/// Cuts a polygon into triangles around its first corner.
fn fan(corners: &[i64], face: usize, file: &str, into: &mut Vec<[u32; 3]>) -> Result<(), Error> {
    if corners.len() < 3 {
        let found = format!("{} corners", corners.len());
        return Err(Error::new(ErrorKind::Malformed, file, &format!("face {face}"), found, "at least 3"));
    }
    let corner = |index: i64| {
        u32::try_from(index).map_err(|_| {
            Error::new(ErrorKind::Malformed, file, &format!("face {face}"), format!("vertex {index}"), "an index of a vertex, from 0")
        })
    };
    for pair in corners[1..].windows(2) {
        into.push([corner(corners[0])?, corner(pair[0])?, corner(pair[1])?]);
    }
    Ok(())
}

#[derive(Default)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
    colour: Vec3,
}

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let place = match name {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            "nx" => &mut self.normal.x,
            "ny" => &mut self.normal.y,
            "nz" => &mut self.normal.z,
            "u" | "s" | "texture_u" | "texture_s" => &mut self.uv.x,
            "v" | "t" | "texture_v" | "texture_t" => &mut self.uv.y,
            "red" => &mut self.colour.x,
            "green" => &mut self.colour.y,
            "blue" => &mut self.colour.z,
            _ => return PropertyAccessResult::Ignored,
        };
        // Bytes are fractions of 255; what stands as floating point stands as it is.
        let whole = match (name, &value) {
            ("red" | "green" | "blue", Property::UChar(_)) => 1.0 / 255.0,
            _ => 1.0,
        };
        match scalar(&value) {
            Some(value) => {
                *place = (value * whole) as f32;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }
}

/// Corners as written; signed, so that a negative one is noticed and not wrapped.
#[derive(Default)]
struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Face {
        Face::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if !INDEX_NAMES.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match value {
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that is of no use here; it is read over.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Skipped {
        Skipped
    }
}

fn scalar(value: &Property) -> Option<f64> {
    Some(match value {
        Property::Char(value) => f64::from(*value),
        Property::UChar(value) => f64::from(*value),
        Property::Short(value) => f64::from(*value),
        Property::UShort(value) => f64::from(*value),
        Property::Int(value) => f64::from(*value),
        Property::UInt(value) => f64::from(*value),
        Property::Float(value) => f64::from(*value),
        Property::Double(value) => *value,
        _ => return None,
    })
}

fn malformed(fault: &ParseError, file: &str) -> Error {
    let message = fault.to_string();
    let message = message.split_once(": ").filter(|_| fault.line().is_some()).map_or(message.as_str(), |(_, rest)| rest);
    let error = Error::new(ErrorKind::Malformed, file, "", message, "a PLY file");
    match fault.line() {
        Some(line) => error.at(line, 1),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
                          property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\nproperty uchar red\n\
                          element face 1\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nend_header\n";
    const BODY: &str = "0 0 0 0 0 2 0 0 9\n1 0 0 0 0 2 1 0 9\n1 1 0 0 0 2 1 1 9\n0 1 0 0 0 2 0 1 9\n4 0 1 2 3\n7\n";

    #[test]
    fn a_text_file_is_read() {
        let mesh = parse(format!("{HEADER}{BODY}").as_bytes(), "t.ply").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
        assert_eq!(mesh.uvs[3], Vec2::new(0.0, 1.0));
    }

    #[test]
    fn binary_files_of_both_orders_are_read() {
        for little in [true, false] {
            let order = if little { "little" } else { "big" };
            let mut bytes = format!(
                "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 1\nproperty list uchar uint vertex_index\nend_header\n"
            )
            .into_bytes();
            for value in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
                bytes.extend(if little { value.to_le_bytes() } else { value.to_be_bytes() });
            }
            bytes.push(3);
            for index in [0u32, 1, 2] {
                bytes.extend(if little { index.to_le_bytes() } else { index.to_be_bytes() });
            }
            let mesh = parse(&bytes, "t.ply").unwrap();
            assert_eq!((mesh.triangles.as_slice(), mesh.positions[1]), (&[[0, 1, 2]][..], Vec3::X));
            assert!(parse(&bytes[..bytes.len() - 1], "t.ply").is_err(), "a cut file is noticed");
        }
    }

    #[test]
    fn faults_are_named() {
        let cases = [
            (HEADER, "element vertex 4", "element vertex 4000000000", "4000000000 times `vertex`"),
            (HEADER, "property float z\n", "", "no property `z`"),
            (HEADER, "vertex_indices", "corners", "no list property `vertex_indices`"),
            (HEADER, "element vertex", "element vortex", "no element `vertex`"),
            (BODY, "4 0 1 2 3", "2 0 1", "face 0: found 2 corners, expected at least 3"),
            (BODY, "4 0 1 2 3", "3 0 1 -2", "found vertex -2"),
            (BODY, "1 1 0", "1 one 0", "t.ply:21"),
        ];
        for (part, good, bad, expected) in cases {
            assert!(part.contains(good), "{good}");
            let text = format!("{HEADER}{BODY}").replacen(good, bad, 1);
            let message = parse(text.as_bytes(), "t.ply").unwrap_err().to_string();
            assert!(message.contains(expected), "{message} lacks {expected}");
        }
    }

    #[test]
    fn garbage_never_panics() {
        let whole = format!("{HEADER}{BODY}").into_bytes();
        for cut in 0..whole.len() {
            let _ = parse(&whole[..cut], "t.ply");
        }
        for seed in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[seed] = bytes[seed].wrapping_mul(31).wrapping_add(seed as u8);
            let _ = parse(&bytes, "t.ply");
        }
    }
}
