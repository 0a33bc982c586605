//! Meshes from files: Wavefront OBJ and PLY, turned into indexed triangles with bounded sizes.

mod obj;
mod ply;
pub(super) mod ply_binary;
pub(super) mod serialized;
mod smooth;

use super::assets::Assets;
use super::description::Normals;
use super::error::{Error, ErrorKind};
use super::limits;
use crate::geometry::{Mesh, MeshError};

/// The file formats of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// PLY, text or binary.
    Ply,
}

/// Reads a mesh file with its normals as asked for. `file` is its name among the assets and in errors.
///
/// # Errors
/// The file cannot be opened, does not follow its format, is too large, names missing vertices or holds numbers that are not finite.
pub(super) fn read(assets: &dyn Assets, file: &str, format: MeshFormat, normals: Normals) -> Result<Mesh, Error> {
    let bytes = assets.open(file)?;
    let mut mesh = match format {
        MeshFormat::Obj => obj::parse(&bytes, file)?,
        MeshFormat::Ply => ply::parse(&bytes, file)?,
    };
    if mesh.triangles.is_empty() {
        return Err(Error::new(ErrorKind::Malformed, file, "", "no face at all", "a mesh with at least one face"));
    }
    mesh.check().map_err(|fault| faulty(&fault, file))?;
    match normals {
        Normals::Flat => mesh.normals.clear(),
        Normals::Smooth if mesh.normals.is_empty() => mesh.normals = smooth::vertex_normals(&mesh),
        Normals::Smooth | Normals::AsWritten => {}
    }
    Ok(mesh)
}

/// Refuses more vertices or triangles than the limit.
fn bounded(count: usize, what: &str, file: &str) -> Result<(), Error> {
    if count <= limits::MESH_ELEMENTS {
        return Ok(());
    }
    Err(Error::new(ErrorKind::TooLarge, file, "", format!("{count} {what}"), format!("at most {}", limits::MESH_ELEMENTS)))
}

fn faulty(fault: &MeshError, file: &str) -> Error {
    let (path, found, expected) = match fault {
        MeshError::Corner { triangle, found, vertices } => {
            (format!("triangle {triangle}"), format!("vertex {found}"), format!("0 to {}", vertices.saturating_sub(1)))
        }
        MeshError::NotFinite { vertex } => {
            (format!("vertex {vertex}"), "a number that is not finite".to_string(), "finite numbers".to_string())
        }
        MeshError::Length { what, found, vertices } => {
            (String::new(), format!("{found} {what}"), format!("{vertices}, one for each vertex"))
        }
    };
    Error::new(ErrorKind::Malformed, file, &path, found, expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct One(&'static [u8]);

    impl Assets for One {
        fn open(&self, _: &str) -> Result<Vec<u8>, Error> {
            Ok(self.0.to_vec())
        }
    }

    const TENT: &[u8] = b"v -1 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 1\nv 0 1 1\nv 1 0 1\nf 1 4 5 2\nf 2 5 6 3\n";

    #[test]
    fn normals_come_from_where_the_scene_says() {
        let read = |normals| read(&One(TENT), "t.obj", MeshFormat::Obj, normals).unwrap();
        assert!(read(Normals::AsWritten).normals.is_empty());
        assert!(read(Normals::Flat).normals.is_empty());
        let smooth = read(Normals::Smooth);
        let ridge = smooth.positions.iter().position(|p| p.to_array() == [0.0, 1.0, 0.0]).unwrap();
        assert!((smooth.normals[ridge] - crate::math::Vec3::Y).length() < 1e-6, "the ridge looks straight up");
        let eave = smooth.positions.iter().position(|p| p.to_array() == [-1.0, 0.0, 0.0]).unwrap();
        assert!((smooth.normals[eave] - crate::math::Vec3::new(-1.0, 1.0, 0.0).normalize()).length() < 1e-6);
    }

    #[test]
    fn an_empty_mesh_is_refused() {
        let error = read(&One(b"v 0 0 0\n"), "t.obj", MeshFormat::Obj, Normals::Flat).unwrap_err();
        assert!(error.to_string().contains("t.obj: found no face"), "{error}");
    }
}
