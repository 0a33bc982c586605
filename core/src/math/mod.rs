//! Vectors, frames, rays and transforms. Vectors are `glam`'s; nothing here calls the system's mathematical library.

mod frame;
mod ray;
mod transform;

pub use frame::Frame;
pub use glam::{Vec2, Vec3, Vec4};
pub use ray::{Ray, segment, spawn};
pub use transform::Transform;

/// π as f32.
pub const PI: f32 = std::f32::consts::PI;
/// 1/π as f32.
pub const INV_PI: f32 = std::f32::consts::FRAC_1_PI;

/// Square root that takes rounding below zero as zero.
#[inline]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

/// `sin` and `cos` from one pure-Rust implementation, the same bits everywhere.
#[inline]
pub fn sin_cos(x: f32) -> (f32, f32) {
    libm::sincosf(x)
}
