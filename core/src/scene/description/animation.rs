//! Animation as written: frames of reference that hang on one another, and tracks of keys that move numbers of the description.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::map;
use super::transform::Transform;

/// What moves. Without it a scene is the same at all times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Animation {
    /// Frames of reference by name. `{"node": "name"}` in a `to_world` puts a thing into one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "map::unique_names")]
    pub nodes: BTreeMap<String, Node>,
    /// What changes, and how. No number is moved by two tracks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tracks: Vec<Track>,
}

impl Animation {
    /// Seconds of the first and the last key of all tracks; `None` where nothing moves.
    pub fn span(&self) -> Option<[f64; 2]> {
        let times = || self.tracks.iter().flat_map(|track| &track.times).copied();
        self.tracks
            .iter()
            .any(|track| !track.times.is_empty())
            .then(|| [times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max)])
    }
}

/// A frame of reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Node {
    /// The node whose frame it stands in; without one it stands in the world. No circles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<String>,
    /// From its own frame to its parent's. Names no node itself.
    #[serde(default, skip_serializing_if = "Transform::is_identity")]
    pub to_parent: Transform,
}

/// One number, or one list of numbers, of the description as a function of time.
///
/// Before the first key and after the last one their values hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Track {
    /// What it moves, by its path in the description, as errors say it: `shapes[3].to_world[0].translate`,
    /// `animation.nodes.hip.to_parent[1].quaternion`, `lights[0].point.intensity`. Under `camera`, `textures`, `media`, `materials`,
    /// `groups`, `shapes`, `lights`, `environment` and `animation.nodes`.
    pub target: String,
    /// Times of the keys [s], from 0 on, each later than the one before.
    pub times: Vec<f64>,
    /// The value at each key.
    pub values: Vec<Value>,
    /// What lies between keys.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// Slopes at the keys, for `cubic` only; without them those of Catmull and Rom.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangents: Option<Tangents>,
    /// Starts over after the last key: time runs round between the first key and the last one.
    #[serde(default, rename = "loop", skip_serializing_if = "is_no")]
    pub repeat: bool,
}

/// A number, or a list of numbers, as the target asks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Value {
    /// One number.
    Number(f64),
    /// Several.
    List(Vec<f64>),
}

impl Value {
    /// Its numbers.
    pub fn numbers(&self) -> &[f64] {
        match self {
            Value::Number(number) => std::slice::from_ref(number),
            Value::List(list) => list,
        }
    }
}

/// What lies between two keys. A target that ends in `.quaternion` is turned along the shortest way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// The value of the earlier key.
    Step,
    /// A straight line; for quaternions the great arc, at even speed (slerp).
    #[default]
    Linear,
    /// Hermite's cubic with the slopes of `tangents`, as in glTF, else with (next − previous) / (their times' difference), at the first
    /// and the last key with that to their neighbour. Quaternions are interpolated by component and brought back to length 1.
    Cubic,
}

/// Slopes at the keys [per second]: one value for each key, of the same form as the values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tangents {
    /// Slopes as the key is reached.
    pub incoming: Vec<Value>,
    /// Slopes as it is left.
    pub outgoing: Vec<Value>,
}

fn is_no(value: &bool) -> bool {
    !*value
}
