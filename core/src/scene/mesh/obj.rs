//! Wavefront OBJ, through `tobj`: all objects of the file become one mesh, polygons become fans, materials are ignored.

use std::cell::Cell;
use std::io::{self, BufRead, Read};

use tobj::{LoadError, LoadOptions};

use super::bounded;
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};
use crate::scene::error::{Error, ErrorKind};

/// Reads an OBJ file; `file` is the name that errors carry.
pub(super) fn parse(bytes: &[u8], file: &str) -> Result<Mesh, Error> {
    let line = Cell::new(0);
    let options = LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut CountedLines { bytes, line: &line }, &options, no_materials)
        .map_err(|fault| malformed(fault, line.get(), file))?;
    bounded(models.iter().map(|model| model.mesh.positions.len() / 3).sum(), "vertices", file)?;
    bounded(models.iter().map(|model| model.mesh.indices.len() / 3).sum(), "triangles", file)?;
    let mut mesh = Mesh::default();
    let have_normals = models.iter().any(|model| !model.mesh.normals.is_empty());
    let have_uvs = models.iter().any(|model| !model.mesh.texcoords.is_empty());
    for model in &models {
        let part = &model.mesh;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(part.positions.chunks_exact(3).map(Vec3::from_slice));
        mesh.triangles.extend(part.indices.chunks_exact(3).map(|corners| [corners[0] + first, corners[1] + first, corners[2] + first]));
        // Objects of one file may differ in what they carry: a zero normal means flat.
        mesh.normals.extend(part.normals.chunks_exact(3).map(|normal| Vec3::from_slice(normal).normalize_or_zero()));
        mesh.uvs.extend(part.texcoords.chunks_exact(2).map(Vec2::from_slice));
        mesh.normals.resize(if have_normals { mesh.positions.len() } else { 0 }, Vec3::ZERO);
        mesh.uvs.resize(if have_uvs { mesh.positions.len() } else { 0 }, Vec2::ZERO);
    }
    Ok(mesh)
}

/// Bytes that count the lines taken from them, so that errors can name one.
struct CountedLines<'a> {
    bytes: &'a [u8],
    line: &'a Cell<usize>,
}

impl Read for CountedLines<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.len().min(into.len());
        into[..count].copy_from_slice(&self.bytes[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for CountedLines<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        Ok(self.bytes)
    }

    fn consume(&mut self, count: usize) {
        let (taken, rest) = self.bytes.split_at(count);
        self.line.set(self.line.get() + taken.iter().filter(|byte| **byte == b'\n').count());
        self.bytes = rest;
    }
}

fn malformed(fault: LoadError, line: usize, file: &str) -> Error {
    let expected = match fault {
        LoadError::PositionParseError => "v x y z",
        LoadError::NormalParseError => "vn x y z",
        LoadError::TexcoordParseError => "vt u v",
        LoadError::FaceParseError | LoadError::InvalidPolygon => "f with at least three corners v, v/vt, v//vn or v/vt/vn",
        LoadError::FaceVertexOutOfBounds => "faces that name vertices of this file",
        LoadError::FaceTexCoordOutOfBounds => "faces that name texture coordinates of this file",
        LoadError::FaceNormalOutOfBounds => "faces that name normals of this file",
        _ => "a Wavefront OBJ file",
    };
    let error = Error::new(ErrorKind::Malformed, file, "", fault.to_string(), expected);
    // Faces are resolved when their object ends: the line that was read last says nothing then.
    match fault {
        LoadError::FaceVertexOutOfBounds | LoadError::FaceTexCoordOutOfBounds | LoadError::FaceNormalOutOfBounds => error,
        _ => error.at(line, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_join_and_polygons_become_fans() {
        let text = b"o one\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nf 1//1 2//1 3//1 4//1\no two\nv 0 0 5\nf 1 2 -1\n";
        let mesh = parse(text, "t.obj").unwrap();
        assert_eq!(mesh.triangles.len(), 3);
        assert_eq!(mesh.positions.len(), 7);
        assert_eq!(mesh.normals[0], Vec3::Z);
        assert_eq!(mesh.normals[6], Vec3::ZERO);
        assert_eq!(mesh.corners(2).map(|p| p.to_array()), [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 5.0]]);
        mesh.check().unwrap();
    }

    #[test]
    fn faults_name_their_line() {
        let message = |text: &[u8]| parse(text, "t.obj").unwrap_err().to_string();
        assert!(message(b"v 0 0 0\nv 1 x 0\n").starts_with("t.obj:2:1: found position parse error, expected v x y z"));
        assert!(message(b"v 0 0 0\nf 1 b 1\n").starts_with("t.obj:2:1: found face parse error"));
        assert!(message(b"v 0 0 0\nf 1 2 3\n").contains("out of bounds"));
    }

    #[test]
    fn garbage_is_an_error_or_empty_but_never_a_panic() {
        for text in
            [&b"f 1 1 1"[..], b"f 0 0 0\n", b"f -1 -2 -3", b"\xff\xfe", b"v 1e99 0 0\nv 0 0 0\nv 0 1 0\nf 1 2 3", b"f 1 2", b"vn", b"f"]
        {
            let _ = parse(text, "t.obj");
        }
        assert!(parse(b"f 1 1 1", "t.obj").is_err());
    }
}
