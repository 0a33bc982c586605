//! Gradients: the difference between a base path and its shift, weighted so that both directions of the shift add up to the truth.

mod estimate;
mod offset;
mod pair;
mod reuse;
#[cfg(test)]
mod tests;

pub use estimate::difference;
pub use pair::Pair;
pub use reuse::Sharing;
