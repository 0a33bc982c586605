//! Importers: scenes that were written for other renderers, turned into the native description and a report of what changed.

use super::assets::MadeAssets;
use super::description::SceneDescription;

#[cfg(test)]
mod coverage;
pub(super) mod gltf;
mod inline;
pub(super) mod mitsuba;
mod naming;
pub(super) mod pbrt;
mod spectra;
mod xml;

/// What an importer makes of a scene.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The scene in the native description.
    pub description: SceneDescription,
    /// Files that it refers to and that the importer made.
    pub made: MadeAssets,
    /// What was changed or left out, one sentence each.
    pub report: Vec<String>,
}
