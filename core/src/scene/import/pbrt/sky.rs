//! Images of the sky in pbrt's equal-area mapping of the sphere onto a square, made into equirectangular ones.
//!
//! # Source
//! Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", Journal of Graphics Tools 13(3), 2008.

use std::io::Cursor;

use exr::prelude::{Image, SpecificChannels, WritableImage};
use glam::{DMat3, DVec3};

use crate::texture::{Pixels, Texels, srgb_to_linear};

/// An OpenEXR image with −Z in its middle and +Y at its top, of a sky whose image is the square `pixels` in its own frame.
/// `None` where the image cannot be written.
pub(super) fn equirectangular(pixels: &Pixels, to_world: DMat3) -> Option<Vec<u8>> {
    let (width, height) = (pixels.width as usize * 2, pixels.height as usize);
    let from_world = to_world.inverse();
    let look = |place: exr::prelude::Vec2<usize>| {
        let azimuth = ((place.0 as f64 + 0.5) / width as f64 - 0.5) * std::f64::consts::TAU;
        let polar = (place.1 as f64 + 0.5) / height as f64 * std::f64::consts::PI;
        let (sin, cos) = libm::sincos(polar);
        let direction = DVec3::new(sin * libm::sin(azimuth), cos, -sin * libm::cos(azimuth));
        let [u, v] = square((from_world * direction).normalize_or(DVec3::Z));
        let [r, g, b] = bilinear(pixels, u, v);
        (r, g, b)
    };
    let image = Image::from_channels((width, height), SpecificChannels::rgb(look));
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).ok()?;
    Some(bytes.into_inner())
}

/// Where a direction lies in the unit square.
fn square(direction: DVec3) -> [f64; 2] {
    let (x, y, z) = (direction.x.abs(), direction.y.abs(), direction.z.abs());
    let radius = (1.0 - z).max(0.0).sqrt();
    let (greater, lesser) = (x.max(y), x.min(y));
    let angle = if greater == 0.0 { 0.0 } else { libm::atan(lesser / greater) * std::f64::consts::FRAC_2_PI };
    let angle = if x < y { 1.0 - angle } else { angle };
    let (mut u, mut v) = (radius - angle * radius, angle * radius);
    if direction.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [(u.copysign(direction.x) + 1.0) * 0.5, (v.copysign(direction.y) + 1.0) * 0.5]
}

/// A blend of the four nearest texels; past the border its texels go on.
fn bilinear(pixels: &Pixels, u: f64, v: f64) -> [f32; 3] {
    let (x, y) = (u * f64::from(pixels.width) - 0.5, v * f64::from(pixels.height) - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (across, down) = ((x - left) as f32, (y - top) as f32);
    let clamp = |place: f64, side: u32| (place.max(0.0) as u32).min(side - 1) as usize;
    let texel = |dx: f64, dy: f64| {
        let index = clamp(top + dy, pixels.height) * pixels.width as usize + clamp(left + dx, pixels.width);
        linear(&pixels.texels, index)
    };
    let corners = [texel(0.0, 0.0), texel(1.0, 0.0), texel(0.0, 1.0), texel(1.0, 1.0)];
    [0, 1, 2].map(|k| {
        let row = |a: usize, b: usize| corners[a][k] * (1.0 - across) + corners[b][k] * across;
        row(0, 1) * (1.0 - down) + row(2, 3) * down
    })
}

/// Red, green and blue of a texel as light.
pub(super) fn linear(texels: &Texels, index: usize) -> [f32; 3] {
    match texels {
        Texels::Bytes(texels) => [0, 1, 2].map(|k| srgb_to_linear(f32::from(texels[index][k]) / 255.0)),
        Texels::Words(texels) => [0, 1, 2].map(|k| srgb_to_linear(f32::from(texels[index][k]) / 65535.0)),
        Texels::Floats(texels) => [0, 1, 2].map(|k| texels[index][k]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mapping_keeps_areas_and_knows_its_corners() {
        let close = |direction: DVec3, expected: [f64; 2]| {
            let found = square(direction);
            assert!((found[0] - expected[0]).abs() + (found[1] - expected[1]).abs() < 1e-9, "{direction} at {found:?}");
        };
        close(DVec3::Z, [0.5, 0.5]);
        close(DVec3::X, [1.0, 0.5]);
        close(DVec3::Y, [0.5, 1.0]);
        close(DVec3::NEG_X, [0.0, 0.5]);
        // The cap of a quarter of the sphere around +Z fills the diamond of a quarter of the square.
        let edge = DVec3::new(0.75f64.sqrt(), 0.0, 0.5);
        close(edge, [0.5 + 0.5 * 0.5f64.sqrt(), 0.5]);
    }

    #[test]
    fn a_sky_with_one_bright_side_is_bright_there() {
        let mut texels = vec![[0.0f32, 0.0, 0.0, 1.0]; 64 * 64];
        // The right half of the square is +X.
        for (index, texel) in texels.iter_mut().enumerate() {
            if index % 64 >= 32 {
                *texel = [1.0, 2.0, 3.0, 1.0];
            }
        }
        let pixels = Pixels { width: 64, height: 64, texels: Texels::Floats(texels) };
        let bytes = equirectangular(&pixels, DMat3::IDENTITY).unwrap();
        let found = crate::scene::image::read(&bytes, "sky.exr").unwrap();
        assert_eq!((found.width, found.height), (128, 64));
        // +X is a quarter to the right of the middle.
        let bright = linear(&found.texels, 32 * 128 + 96);
        assert!(bright.iter().zip([1.0, 2.0, 3.0]).all(|(found, expected)| (found - expected).abs() < 1e-5), "{bright:?}");
        assert_eq!(linear(&found.texels, 32 * 128 + 32), [0.0; 3]);
    }
}
