//! Meshes that change their form, as written: shapes to blend towards, and joints to hang on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Forms that a mesh is blended towards: positions and normals are those of the mesh plus Σ weightᵢ · deltaᵢ.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Morph {
    /// One weight for each target; usually from 0 to 1.
    pub weights: Vec<f64>,
    /// The forms, as differences from the mesh.
    pub targets: Vec<MorphTarget>,
}

/// One form, as differences from the mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MorphTarget {
    /// What is added to each vertex [m]; without it, nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub positions: Option<Vec<[f32; 3]>>,
    /// What is added to each shading normal before it is brought back to length 1; without it, nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<Vec<[f32; 3]>>,
}

/// Joints that a mesh hangs on: each vertex moves by the weighted mean of its joints' matrices (linear blend skinning).
///
/// The mesh is placed by its joints; the shape's `to_world` comes after.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Skin {
    /// The joints.
    pub joints: Vec<Joint>,
    /// Up to four joints of each vertex, twice where more are needed.
    pub influences: Vec<Influences>,
}

/// A joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// The node that moves it.
    pub node: String,
    /// From the mesh's frame to the joint's as the mesh was bound, four rows of four: glTF's inverse bind matrix.
    pub bind: [[f64; 4]; 4],
}

/// Four joints and weights for each vertex. Weights are divided by their sum over all influences.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Influences {
    /// Indices into the joints.
    pub joints: Vec<[u16; 4]>,
    /// Their weights ≥ 0; 0 where there are fewer joints than four.
    pub weights: Vec<[f32; 4]>,
}
