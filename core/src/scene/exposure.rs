//! What a camera sees while its shutter is open: the scene at one instant, or at several.

use std::sync::Arc;

use super::runtime::Scene;

/// The scenes that one moment is rendered from.
///
/// Motion is sampled, not traced: sample k of a half sees instant k mod n, all pixels alike. So whatever moves (camera, things, their
/// form, lights, materials) is exact at each instant, base and offset paths meet the same instant, and rays need no time.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// The instants, in the order of time. At least one.
    pub instants: Vec<Arc<Scene>>,
    /// The scene as the moment before saw it at its first instant, where motion is to be followed.
    pub before: Option<Arc<Scene>>,
}

impl Exposure {
    /// A scene that rests while the shutter is open.
    pub fn still(scene: Arc<Scene>) -> Exposure {
        Exposure { instants: vec![scene], before: None }
    }

    /// What a unit is rendered from.
    pub fn view(&self) -> Instants<'_> {
        Instants { scenes: self.instants.iter().map(Arc::as_ref).collect(), before: self.before.as_deref() }
    }
}

/// An [`Exposure`] as the renderer borrows it.
#[derive(Clone, Debug)]
pub struct Instants<'a> {
    /// The instants, in the order of time. At least one.
    pub scenes: Vec<&'a Scene>,
    /// The scene at the first instant of the moment before.
    pub before: Option<&'a Scene>,
}

impl<'a> From<&'a Scene> for Instants<'a> {
    fn from(scene: &'a Scene) -> Self {
        Instants { scenes: vec![scene], before: None }
    }
}

impl<'a> From<&'a Arc<Scene>> for Instants<'a> {
    fn from(scene: &'a Arc<Scene>) -> Self {
        Instants::from(scene.as_ref())
    }
}

impl<'a> From<&'a Exposure> for Instants<'a> {
    fn from(exposure: &'a Exposure) -> Self {
        exposure.view()
    }
}
