//! The scene: what was said, and what it compiles to.

mod runtime;

pub use runtime::{Scene, Shape};
