//! A scene that moves, compiled as it goes: what rests is read and built once, and shared between all instants.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::animate::Motion;
use super::assets::Assets;
use super::compile::{Kept, instant};
use super::description::SceneDescription;
use super::error::Error;
use super::exposure::Exposure;
use super::runtime::Scene;

/// A description with its files, ready to be compiled at any time.
///
/// Shapes, groups, instances and triangles have the same numbers at all instants of a stage. A scene in which nothing moves
/// compiles to the bits of [`Scene::compile`].
pub struct Stage {
    description: SceneDescription,
    assets: Arc<dyn Assets + Send + Sync>,
    motion: Motion,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    kept: Kept,
    /// The latest instants, as far as somebody still holds them.
    recent: Vec<(SceneDescription, Weak<Scene>)>,
}

/// How many instants are looked through for one that is the same.
const RECENT: usize = 4;

impl Stage {
    /// A stage for a description whose files come from `assets`. Nothing is compiled yet.
    ///
    /// # Errors
    /// The description is invalid.
    pub fn new(description: SceneDescription, assets: Arc<dyn Assets + Send + Sync>) -> Result<Stage, Error> {
        description.validate("scene")?;
        let motion = Motion::of(&description);
        Ok(Stage { description, assets, motion, state: Mutex::default() })
    }

    /// The description over time.
    pub fn description(&self) -> &SceneDescription {
        &self.description
    }

    /// The scene at a time [s]. Times at which nothing differs share one scene while anybody holds it.
    ///
    /// # Errors
    /// A file is missing or faulty, or a value between keys leaves its domain.
    pub fn scene(&self, seconds: f64) -> Result<Arc<Scene>, Error> {
        let still = self.description.at(seconds)?;
        // What a compilation that failed or panicked left behind is whole: entries are added when they are done.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let known = state.recent.iter().find(|(description, _)| *description == still).and_then(|(_, scene)| scene.upgrade());
        if let Some(scene) = known {
            return Ok(scene);
        }
        let scene = Arc::new(instant(&still, &self.motion, &mut state.kept, self.assets.as_ref())?);
        if self.motion.is_none() {
            state.kept.forget_files();
        }
        state.recent.retain(|(_, scene)| scene.strong_count() > 0);
        let excess = (state.recent.len() + 1).saturating_sub(RECENT);
        state.recent.drain(..excess);
        state.recent.push((still, Arc::downgrade(&scene)));
        Ok(scene)
    }

    /// What a camera sees whose shutter is open at these times [s], of which there is at least one; `before` is the time that motion is
    /// followed from, where it is. Where nothing moves while the shutter is open, there is a single instant.
    ///
    /// # Errors
    /// As [`scene`](Self::scene).
    pub fn exposure(&self, seconds: &[f64], before: Option<f64>) -> Result<Exposure, Error> {
        // Before first, in the order of time: the moment before has mostly compiled it already.
        let before = before.map(|seconds| self.scene(seconds)).transpose()?;
        let mut instants = seconds.iter().map(|seconds| self.scene(*seconds)).collect::<Result<Vec<_>, _>>()?;
        if instants.is_empty() {
            instants.push(self.scene(0.0)?);
        }
        if instants.iter().all(|scene| Arc::ptr_eq(scene, &instants[0])) {
            instants.truncate(1);
        }
        Ok(Exposure { instants, before })
    }
}

impl std::fmt::Debug for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Stage").field("motion", &self.motion).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
