//! An eight-wide bounding volume hierarchy over boxes: obvhs builds the binary tree, `collapse` widens it, `traverse` walks it.

mod bounds;
mod collapse;
mod node;
mod traverse;

pub use bounds::Bounds;
pub(super) use collapse::Tree;
pub(super) use traverse::{Probe, any, closest};
