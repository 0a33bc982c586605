//! Skins: meshes that hang on joints, in the pose in which the joints stand.

use glam::{DMat3, DMat4};

use super::document::Skin;
use super::{Importer, Source, titled};
use crate::geometry::Mesh;
use crate::math::Vec3;
use crate::scene::error::{Error, ErrorKind};

impl Skin {
    /// For each joint, from the mesh as it was bound to the joint, and from there to the world. `globals` are the frames of the nodes that
    /// stand in the scene.
    ///
    /// # Errors
    /// Joints that are no nodes, or fewer matrices than joints.
    pub(super) fn matrices(&self, source: &Source<'_>, path: &str, globals: &[Option<DMat4>]) -> Result<Vec<[DMat4; 2]>, Error> {
        let bound = match self.inverse_bind_matrices {
            Some(accessor) => source.vectors::<16>(accessor, path)?,
            None => Vec::new(),
        };
        let mut matrices = Vec::with_capacity(self.joints.len());
        for (k, joint) in self.joints.iter().enumerate() {
            source.get(&source.document.nodes, *joint, path, "nodes")?;
            let global = globals.get(*joint).copied().flatten().unwrap_or(DMat4::IDENTITY);
            let inverse = match bound.get(k) {
                Some(columns) => DMat4::from_cols_array(&columns.map(f64::from)),
                None if bound.is_empty() => DMat4::IDENTITY,
                None => {
                    let found = format!("{} inverse bind matrices", bound.len());
                    return Err(source.fault(ErrorKind::Malformed, path, found, format!("{}, one for each joint", self.joints.len())));
                }
            };
            matrices.push([inverse, global]);
        }
        Ok(matrices)
    }
}

impl Importer {
    /// A primitive's triangles hung on joints, as a file of its own; `None` where it hangs on none or draws no triangles.
    ///
    /// # Errors
    /// Accessors that are missing, malformed or too large.
    pub(super) fn posed(
        &mut self,
        source: &Source<'_>,
        [mesh, primitive]: [usize; 2],
        uv_set: usize,
        matrices: &[DMat4],
    ) -> Result<Option<super::mesh::Written>, Error> {
        let written = &source.document.meshes[mesh];
        let path = format!("meshes[{mesh}].primitives[{primitive}]");
        let attributes = &written.primitives[primitive].attributes;
        let (Some(joints), Some(weights)) = (attributes.get("JOINTS_0"), attributes.get("WEIGHTS_0")) else { return Ok(None) };
        let Some(mut bound) = self.triangles(source, mesh, primitive, uv_set)? else { return Ok(None) };
        if attributes.contains_key("JOINTS_1") {
            let place = titled("meshes", mesh, &written.name);
            self.note(format!("{place}: joints past the fourth of a vertex are left out"));
        }
        let (joints, weights) = (source.vectors::<4>(*joints, &path)?, source.vectors::<4>(*weights, &path)?);
        let vertices = bound.positions.len();
        if joints.len() != vertices || weights.len() != vertices {
            let found = format!("{} joints and {} weights", joints.len(), weights.len());
            return Err(source.fault(ErrorKind::Malformed, &path, found, format!("{vertices}, one for each vertex")));
        }
        for (vertex, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
            // Vertices name joints by small whole numbers, which floats hold exactly.
            hang(&mut bound, vertex, joints.map(|joint| joint as u16).into_iter().zip(*weights), matrices);
        }
        self.keep(source, &bound, &written.name, &path).map(Some)
    }
}

/// Moves one vertex to where its joints put it.
pub(super) fn hang(mesh: &mut Mesh, vertex: usize, joints: impl Iterator<Item = (u16, f32)>, matrices: &[DMat4]) {
    let mut sum = DMat4::ZERO;
    let mut whole = 0.0;
    for (joint, weight) in joints {
        if let Some(matrix) = matrices.get(usize::from(joint)).filter(|_| weight > 0.0) {
            sum += *matrix * f64::from(weight);
            whole += f64::from(weight);
        }
    }
    if whole <= 0.0 {
        return;
    }
    let matrix = sum * whole.recip();
    mesh.positions[vertex] = matrix.transform_point3(mesh.positions[vertex].as_dvec3()).as_vec3();
    if let Some(normal) = mesh.normals.get_mut(vertex) {
        let turned = DMat3::from_mat4(matrix).inverse().transpose() * normal.as_dvec3();
        let turned = turned.as_vec3().normalize_or_zero();
        *normal = if turned.is_finite() { turned } else { Vec3::ZERO };
    }
}
