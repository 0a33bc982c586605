//! A four-wide bounding volume hierarchy over boxes: obvhs builds the binary tree, `collapse` widens it, `traverse` walks it.

mod collapse;
mod traverse;

pub use collapse::Bounds;
pub(super) use collapse::Tree;
pub(super) use traverse::{Probe, any, closest};
