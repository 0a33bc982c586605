//! Who shifts base paths.

use super::offset::OffsetSubpath;
use super::subpath::Subpath;
use crate::math::Ray;
use crate::scene::Scene;

/// Maps a base path to a neighbouring pixel; knows nothing of how it was drawn. Called once for each path and neighbour.
///
/// Laws, tested for every implementation: the same rule applied from the offset path leads back to the base path, or fails
/// there too; the product of the steps' Jacobians is the determinant of the map in solid-angle measure.
pub trait ShiftMap: Send + Sync {
    /// Shifts `base` so that it starts along `camera`, the neighbour's ray of the same sub-pixel and lens position.
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath);
}
