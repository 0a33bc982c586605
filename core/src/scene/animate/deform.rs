//! Meshes in their form of one instant: blended towards other forms, then hung on joints.

use glam::{DMat3, DMat4, DVec3};

use super::{DESCRIPTION, Frames};
use crate::scene::description::{Geometry, MeshInline, Morph, SceneDescription, Skin};
use crate::scene::error::{Error, ErrorKind};
use crate::scene::limits;

/// Puts every mesh into its form; none has a morph or a skin afterwards.
///
/// # Errors
/// A vertex that overflows.
pub(super) fn bake(still: &mut SceneDescription, frames: &Frames) -> Result<(), Error> {
    let shapes = still.groups.values_mut().flatten().chain(&mut still.shapes);
    for shape in shapes {
        let Geometry::Mesh(mesh) = &mut shape.geometry else { continue };
        if let Some(morph) = mesh.morph.take() {
            blend(mesh, &morph);
        }
        if let Some(skin) = mesh.skin.take() {
            hang(mesh, &skin, frames);
        }
        let numbers = mesh.positions.iter().chain(mesh.normals.iter().flatten());
        if !numbers.flatten().all(|x| x.is_finite()) {
            let found = format!("a vertex of {:?} that overflows", shape.name);
            return Err(Error::new(ErrorKind::Invalid, DESCRIPTION, "animation", found, "finite numbers"));
        }
    }
    Ok(())
}

/// The mesh plus Σ weightᵢ · deltaᵢ, added in the order of the targets.
fn blend(mesh: &mut MeshInline, morph: &Morph) {
    let wide = |list: &[[f32; 3]]| list.iter().map(|v| DVec3::from(v.map(f64::from))).collect::<Vec<_>>();
    let mut positions = wide(&mesh.positions);
    let mut normals = mesh.normals.as_deref().map(wide);
    for (target, weight) in morph.targets.iter().zip(&morph.weights).filter(|(_, weight)| **weight != 0.0) {
        let deltas = [(Some(&mut positions), &target.positions), (normals.as_mut(), &target.normals)];
        for (list, deltas) in deltas {
            if let (Some(list), Some(deltas)) = (list, deltas) {
                list.iter_mut().zip(deltas).for_each(|(sum, delta)| *sum += DVec3::from(delta.map(f64::from)) * *weight);
            }
        }
    }
    mesh.positions = positions.into_iter().map(|p| p.as_vec3().to_array()).collect();
    if let Some(normals) = normals {
        mesh.normals = Some(normals.into_iter().map(|n| n.normalize_or_zero().as_vec3().to_array()).collect());
    }
}

/// Moves every vertex by the weighted mean of its joints' matrices. One that hangs on none stays where it is.
fn hang(mesh: &mut MeshInline, skin: &Skin, frames: &Frames) {
    let matrices: Vec<DMat4> = skin
        .joints
        .iter()
        .map(|joint| frames.get(&joint.node).copied().unwrap_or(DMat4::NAN) * DMat4::from_cols_array_2d(&joint.bind).transpose())
        .collect();
    for vertex in 0..mesh.positions.len() {
        let (mut sum, mut whole) = (DMat4::ZERO, 0.0);
        for influences in &skin.influences {
            for (joint, weight) in influences.joints[vertex].iter().zip(influences.weights[vertex]) {
                if weight > 0.0 {
                    sum += matrices[usize::from(*joint)] * f64::from(weight);
                    whole += f64::from(weight);
                }
            }
        }
        if whole <= 0.0 {
            continue;
        }
        let matrix = sum * (1.0 / whole);
        let position = &mut mesh.positions[vertex];
        *position = matrix.transform_point3(DVec3::from(position.map(f64::from))).as_vec3().to_array();
        if let Some(normal) = mesh.normals.as_mut().map(|normals| &mut normals[vertex]) {
            let turned = DMat3::from_mat4(matrix).inverse().transpose() * DVec3::from(normal.map(f64::from));
            let turned = turned.normalize_or_zero();
            // A joint that is flat has no normal: zero means that of the face.
            *normal = if turned.is_finite() { turned.as_vec3().to_array() } else { [0.0; 3] };
        }
    }
}

/// Checks the sizes, indices and numbers of a mesh's forms and joints; `known` says which nodes there are. Gives place, found, expected.
pub(in crate::scene) fn check(mesh: &MeshInline, known: impl Fn(&str) -> bool) -> Result<(), (String, String, String)> {
    let vertices = mesh.positions.len();
    let fault = |place: String, found: String, expected: &str| Err((place, found, expected.to_string()));
    let each = format!("{vertices}, one for each vertex");
    if let Some(morph) = &mesh.morph {
        let targets = morph.targets.len();
        if targets > limits::MORPH_TARGETS {
            return fault("morph.targets".into(), format!("{targets} targets"), &format!("at most {}", limits::MORPH_TARGETS));
        }
        if morph.weights.len() != targets || !morph.weights.iter().all(|weight| weight.is_finite()) {
            return fault(
                "morph.weights".into(),
                format!("{:?}", morph.weights),
                &format!("{targets} finite numbers, one for each target"),
            );
        }
        for (k, target) in morph.targets.iter().enumerate() {
            for (field, list) in [("positions", &target.positions), ("normals", &target.normals)] {
                let Some(list) = list else { continue };
                let place = format!("morph.targets[{k}].{field}");
                if list.len() != vertices {
                    return fault(place, format!("{} entries", list.len()), &each);
                }
                if !list.iter().flatten().all(|x| x.is_finite()) {
                    return fault(place, "a number that overflows".into(), "finite numbers");
                }
            }
        }
    }
    let Some(skin) = &mesh.skin else { return Ok(()) };
    for (place, count, most) in
        [("skin.joints", skin.joints.len(), limits::JOINTS), ("skin.influences", skin.influences.len(), limits::INFLUENCES)]
    {
        if count == 0 || count > most {
            return fault(place.into(), format!("{count} entries"), &format!("1 to {most}"));
        }
    }
    for (k, joint) in skin.joints.iter().enumerate() {
        if !known(&joint.node) {
            return fault(format!("skin.joints[{k}].node"), format!("{:?}", joint.node), "the name of a node in `animation.nodes`");
        }
        if !joint.bind.iter().flatten().all(|x| x.is_finite()) || joint.bind[3] != [0.0, 0.0, 0.0, 1.0] {
            return fault(format!("skin.joints[{k}].bind"), format!("{:?}", joint.bind), "a matrix, its last row [0, 0, 0, 1]");
        }
    }
    for (k, influences) in skin.influences.iter().enumerate() {
        let place = |field: &str| format!("skin.influences[{k}].{field}");
        for (field, count) in [("joints", influences.joints.len()), ("weights", influences.weights.len())] {
            if count != vertices {
                return fault(place(field), format!("{count} entries"), &each);
            }
        }
        if let Some(joint) = influences.joints.iter().flatten().find(|joint| usize::from(**joint) >= skin.joints.len()) {
            return fault(place("joints"), joint.to_string(), &format!("0 to {}", skin.joints.len() - 1));
        }
        if let Some(weight) = influences.weights.iter().flatten().find(|weight| !(**weight >= 0.0 && weight.is_finite())) {
            return fault(place("weights"), weight.to_string(), "finite weights ≥ 0");
        }
    }
    Ok(())
}
