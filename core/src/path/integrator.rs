//! Who draws base paths.

use super::subpath::Subpath;
use crate::math::Ray;
use crate::sampling::SampleStream;
use crate::scene::Scene;

/// Draws base paths; knows nothing of shifts. Called once a path.
pub trait Integrator: Send + Sync {
    /// Walks from the camera ray and fills `out`, radiance gathered. Every number comes from `stream`.
    fn generate(&self, scene: &Scene, camera: &Ray, stream: &SampleStream, out: &mut Subpath);
}
