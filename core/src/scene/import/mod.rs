//! Importers: scenes that were written for other renderers, turned into the native description and a report of what changed.

use super::assets::MadeAssets;
use super::description::SceneDescription;

pub(super) mod gltf;
pub(super) mod mitsuba;
mod naming;
mod spectra;
mod xml;

/// What an importer makes of a scene.
#[derive(Clone, Debug)]
pub(super) struct Imported {
    /// The scene in the native description.
    pub(super) description: SceneDescription,
    /// Files that it refers to and that the importer made.
    pub(super) made: MadeAssets,
    /// What was changed or left out, one sentence each.
    pub(super) report: Vec<String>,
}
