//! A checkerboard.

use super::{ColourInput, TexturePoint};
use crate::math::Vec2;
use crate::spectrum::Spectrum;

/// Two colours in square fields, two by two for each unit of the texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkerboard {
    /// Where the fields, counted along u and along v, are both even or both odd.
    pub even: ColourInput,
    /// Elsewhere.
    pub odd: ColourInput,
    /// Rows of the affine map (u, v, 1) → texture coordinates.
    pub uv: [[f32; 3]; 2],
}

impl Checkerboard {
    #[inline]
    pub(super) fn colour(&self, at: &TexturePoint) -> Spectrum {
        let [a, b] = self.uv;
        let place = Vec2::new(a[0] * at.uv.x + a[1] * at.uv.y + a[2], b[0] * at.uv.x + b[1] * at.uv.y + b[2]);
        let odd = |x: f32| x - x.floor() >= 0.5;
        if odd(place.x) == odd(place.y) { self.even.at(at) } else { self.odd.at(at) }
    }
}
