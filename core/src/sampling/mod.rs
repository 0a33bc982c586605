//! Random numbers and the maps that turn them into directions, points and choices.

mod discrete;
mod stream;
pub mod warp;

pub use discrete::Discrete;
pub use stream::{Dimension, SampleKey, SampleStream};
