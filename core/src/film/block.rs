//! The result of one unit of work: sums over its samples, for the pixels of its tile.

use super::plane::PlaneKind;
use super::statistics::Statistics;
use crate::lattice::{SampleRange, Tile};

/// What [`render_unit`](crate::render::render_unit) returns and a worker delivers.
///
/// Gradients are kept by base pixel and direction, so the block needs no apron: a pixel's sums never depend on which tile
/// traced its neighbour.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmBlock {
    /// The pixels.
    pub tile: Tile,
    /// The samples that were summed.
    pub samples: SampleRange,
    /// The planes in the order of the plan's layout; each holds `tile.pixels() × channels` sums, channel planes one after the other.
    pub planes: Vec<(PlaneKind, Vec<f32>)>,
    /// What happened on the way.
    pub statistics: Statistics,
}

/// Why a block cannot be part of a film.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockError {
    /// The planes are not those of the plan.
    #[error("block has planes {found:?}, the plan lists {expected:?}")]
    Layout {
        /// What the plan lists.
        expected: Vec<PlaneKind>,
        /// What the block has.
        found: Vec<PlaneKind>,
    },
    /// A plane has the wrong number of values.
    #[error("plane {plane:?} holds {found} values, its tile needs {expected}")]
    Length {
        /// Which plane.
        plane: PlaneKind,
        /// `tile.pixels() × channels`.
        expected: usize,
        /// Its length.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("plane {plane:?} holds a value that is not finite at index {index}")]
    NotFinite {
        /// Which plane.
        plane: PlaneKind,
        /// Where in it.
        index: usize,
    },
}

impl FilmBlock {
    /// Checks shape and finiteness against the planes that the plan lists.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, layout: &[PlaneKind]) -> Result<(), BlockError> {
        if !self.planes.iter().map(|(kind, _)| kind).eq(layout) {
            return Err(BlockError::Layout { expected: layout.to_vec(), found: self.planes.iter().map(|(kind, _)| *kind).collect() });
        }
        for (plane, values) in &self.planes {
            let expected = self.tile.pixels() * plane.channels();
            if values.len() != expected {
                return Err(BlockError::Length { plane: *plane, expected, found: values.len() });
            }
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                return Err(BlockError::NotFinite { plane: *plane, index });
            }
        }
        Ok(())
    }
}
