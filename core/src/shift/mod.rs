//! Shifts of base paths to neighbouring pixels: `reconnection` and `half_vector` are the local rules, `hybrid` picks one at each vertex.

mod half_vector;
mod hybrid;
mod reconnection;

pub use half_vector::half_vector;
pub use hybrid::HybridShift;
pub use reconnection::reconnect;

#[cfg(test)]
mod tests;
