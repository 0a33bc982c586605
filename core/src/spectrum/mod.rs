//! Spectral values: four f32 lanes. RGB uses three of them; spectral rendering will carry four hero wavelengths.

use crate::math::Vec4;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// Radiance, reflectance or throughput per lane. Lanes are linear Rec.709 red, green, blue; the fourth is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spectrum(Vec4);

impl Spectrum {
    /// All lanes zero.
    pub const BLACK: Spectrum = Spectrum(Vec4::ZERO);
    /// Red, green and blue one.
    pub const WHITE: Spectrum = Spectrum::rgb(1.0, 1.0, 1.0);

    /// From linear Rec.709.
    #[inline]
    pub const fn rgb(r: f32, g: f32, b: f32) -> Self {
        Self(Vec4::new(r, g, b, 0.0))
    }

    /// The same value in red, green and blue.
    #[inline]
    pub const fn grey(v: f32) -> Self {
        Self::rgb(v, v, v)
    }

    /// Linear Rec.709.
    #[inline]
    pub fn to_rgb(self) -> [f32; 3] {
        [self.0.x, self.0.y, self.0.z]
    }

    /// Largest lane.
    #[inline]
    pub fn max(self) -> f32 {
        self.0.x.max(self.0.y).max(self.0.z)
    }

    /// Mean of red, green and blue.
    #[inline]
    pub fn mean(self) -> f32 {
        (self.0.x + self.0.y + self.0.z) * (1.0 / 3.0)
    }

    /// Whether every lane is zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec4::ZERO
    }

    /// Whether no lane is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Sum of squares of the lanes.
    #[inline]
    pub fn square_sum(self) -> f32 {
        self.0.dot(self.0)
    }

    /// Each lane held between two numbers.
    #[inline]
    pub fn clamp(self, least: f32, most: f32) -> Self {
        self.map(|v| v.clamp(least, most))
    }

    /// Applies a function to red, green and blue.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::rgb(f(self.0.x), f(self.0.y), f(self.0.z))
    }
}

impl Add for Spectrum {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0)
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}

impl Sub for Spectrum {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0)
    }
}

impl Mul for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0)
    }
}

impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        self.0 *= o.0;
    }
}

impl Mul<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, s: f32) -> Self {
        Self(self.0 * s)
    }
}

impl Div<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, s: f32) -> Self {
        Self(self.0 / s)
    }
}
