//! The renderers of a unit: one for each instant that the open shutter sees.

use super::pixel::PixelRenderer;
use crate::lattice::Half;
use crate::plan::{Plan, WorkUnit};
use crate::sampling::SampleKey;
use crate::scene::Instants;

/// One renderer an instant. Sample k of a half belongs to instant k mod n.
pub(super) struct Shutter<'a> {
    renderers: Vec<PixelRenderer<'a>>,
}

impl<'a> Shutter<'a> {
    pub(super) fn new(scene: &Instants<'a>, plan: &'a Plan, unit: &WorkUnit) -> Self {
        Self { renderers: scene.scenes.iter().map(|scene| PixelRenderer::new(scene, plan, unit.moment)).collect() }
    }

    /// The renderer of a sample, by its index within its half.
    #[inline]
    pub(super) fn at(&self, (_, index): (Half, u32)) -> &PixelRenderer<'a> {
        &self.renderers[(index % SampleKey::GUIDED) as usize % self.renderers.len()]
    }

    /// The renderer of the first instant.
    pub(super) fn first(&self) -> &PixelRenderer<'a> {
        &self.renderers[0]
    }
}
