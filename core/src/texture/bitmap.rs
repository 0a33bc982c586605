//! Textures from images.

use super::TexturePoint;
use super::pixels::{Pixels, Texels, srgb_to_linear};
use crate::math::Vec4;
use crate::spectrum::Spectrum;
use std::sync::Arc;

/// What lies outside [0, 1]².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// Its border texels.
    Clamp,
    /// Its mirror image.
    Mirror,
}

impl Wrap {
    /// The texel that stands for one of any index.
    #[inline]
    fn index(self, i: i64, size: i64) -> usize {
        let index = match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Clamp => i.clamp(0, size - 1),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * size);
                if i < size { i } else { 2 * size - 1 - i }
            }
        };
        index as usize
    }
}

/// An image over a surface. Its first row is at the top, where the texture coordinate v is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Bitmap {
    /// Its texels.
    pub pixels: Arc<Pixels>,
    /// Light for each stored byte; words are looked up between its entries.
    pub decode: Box<[f32; 256]>,
    /// One channel in place of three, by its index.
    pub channel: Option<usize>,
    /// Whether texels are blended, or the nearest taken.
    pub bilinear: bool,
    /// What lies outside.
    pub wrap: Wrap,
    /// Rows of the affine map (u, v, 1) → texture coordinates.
    pub uv: [[f32; 3]; 2],
    /// Factor on the result.
    pub scale: Spectrum,
}

/// The table of a curve: sRGB's, or none at all.
pub fn decoding(srgb: bool) -> Box<[f32; 256]> {
    let mut table = Box::new([0.0; 256]);
    for (stored, light) in table.iter_mut().enumerate() {
        let stored = stored as f32 / 255.0;
        *light = if srgb { srgb_to_linear(stored) } else { stored };
    }
    table
}

impl Bitmap {
    #[inline]
    pub(super) fn colour(&self, at: &TexturePoint) -> Spectrum {
        let [a, b] = self.uv;
        let u = a[0] * at.uv.x + a[1] * at.uv.y + a[2];
        let v = b[0] * at.uv.x + b[1] * at.uv.y + b[2];
        if !(u.is_finite() && v.is_finite()) {
            return Spectrum::BLACK;
        }
        let (width, height) = (i64::from(self.pixels.width), i64::from(self.pixels.height));
        let (x, y) = (u * width as f32, (1.0 - v) * height as f32);
        let texel = if self.bilinear {
            // Texel centres lie at halves.
            let (x, y) = (x - 0.5, y - 0.5);
            let (x0, y0) = (x.floor(), y.floor());
            let (s, t) = (x - x0, y - y0);
            let (x0, y0) = (x0 as i64, y0 as i64);
            let [left, right] = [x0, x0 + 1].map(|x| self.wrap.index(x, width));
            let [top, bottom] = [y0, y0 + 1].map(|y| self.wrap.index(y, height) * width as usize);
            let row = |start: usize| self.texel(start + left) * (1.0 - s) + self.texel(start + right) * s;
            row(top) * (1.0 - t) + row(bottom) * t
        } else {
            let (x, y) = (self.wrap.index(x.floor() as i64, width), self.wrap.index(y.floor() as i64, height));
            self.texel(y * width as usize + x)
        };
        let colour = match self.channel {
            None => Spectrum::rgb(texel.x, texel.y, texel.z),
            Some(channel) => Spectrum::grey(texel[channel]),
        };
        colour * self.scale
    }

    /// A texel as light; alpha is never decoded.
    #[inline]
    fn texel(&self, index: usize) -> Vec4 {
        match &self.pixels.texels {
            Texels::Bytes(texels) => {
                let [r, g, b, a] = texels[index];
                let light = |stored: u8| self.decode[usize::from(stored)];
                Vec4::new(light(r), light(g), light(b), f32::from(a) / 255.0)
            }
            Texels::Words(texels) => {
                let [r, g, b, a] = texels[index];
                let light = |stored: u16| {
                    let place = f32::from(stored) / 257.0;
                    let below = (place as usize).min(254);
                    let rest = place - below as f32;
                    self.decode[below] * (1.0 - rest) + self.decode[below + 1] * rest
                };
                Vec4::new(light(r), light(g), light(b), f32::from(a) / 65535.0)
            }
            Texels::Floats(texels) => Vec4::from(texels[index]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;

    fn bitmap(bilinear: bool, wrap: Wrap) -> Bitmap {
        let texels = (0..6u8).map(|k| [k * 10, k * 20, k * 30, 255 - k]).collect();
        let pixels = Arc::new(Pixels { width: 3, height: 2, texels: Texels::Bytes(texels) });
        let uv = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        Bitmap { pixels, decode: decoding(false), channel: None, bilinear, wrap, uv, scale: Spectrum::WHITE }
    }

    fn red(bitmap: &Bitmap, u: f32, v: f32) -> f32 {
        bitmap.colour(&TexturePoint { uv: Vec2::new(u, v), ..TexturePoint::default() }).to_rgb()[0] * 25.5
    }

    #[test]
    fn texel_centres_are_exact_and_the_first_row_is_at_the_top() {
        for bilinear in [false, true] {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let image = bitmap(bilinear, wrap);
                for (k, v) in [(0, 0.75), (3, 0.25)] {
                    for x in 0..3 {
                        let found = red(&image, (x as f32 + 0.5) / 3.0, v);
                        assert!((found - (k + x) as f32).abs() < 1e-4, "{found} for texel {}", k + x);
                    }
                }
            }
        }
    }

    #[test]
    fn wraps_say_what_lies_outside() {
        let at = |wrap, x: f32| red(&bitmap(false, wrap), (x + 0.5) / 3.0, 0.75);
        assert_eq!([-1.0, 3.0, 4.0].map(|x| at(Wrap::Repeat, x).round()), [2.0, 0.0, 1.0]);
        assert_eq!([-1.0, 3.0, 9.0].map(|x| at(Wrap::Clamp, x).round()), [0.0, 2.0, 2.0]);
        assert_eq!([-1.0, -2.0, 3.0, 4.0].map(|x| at(Wrap::Mirror, x).round()), [0.0, 1.0, 2.0, 1.0]);
    }

    #[test]
    fn blends_are_linear_in_light() {
        let mut image = bitmap(true, Wrap::Clamp);
        assert!((red(&image, 1.0 / 3.0, 0.75) - 0.5).abs() < 1e-4);
        image.decode = decoding(true);
        let light = |stored: f32| srgb_to_linear(stored / 25.5) * 25.5;
        assert!((red(&image, 2.0 / 3.0, 0.75) - 0.5 * (light(1.0) + light(2.0))).abs() < 1e-4);
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-5);
    }

    #[test]
    fn single_channels_and_scales() {
        let mut image = bitmap(false, Wrap::Repeat);
        image.channel = Some(3);
        image.scale = Spectrum::grey(2.0);
        let alpha = image.colour(&TexturePoint { uv: Vec2::new(0.5, 0.75), ..TexturePoint::default() });
        assert!((alpha.to_rgb()[1] - 2.0 * 254.0 / 255.0).abs() < 1e-6);
    }
}
