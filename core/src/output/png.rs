//! PNG: eight bits of sRGB, for the eye.

use super::Error;
use crate::film::Image;

/// Encodes the first three channels (or one as grey) times `exposure`, clamped to [0, 1], by the exact sRGB curve. NaN is black.
///
/// # Errors
/// If the image has neither 1 nor 3 channels, or no pixels.
pub fn encode(image: &Image, exposure: f32) -> Result<Vec<u8>, Error> {
    let extent = image.extent();
    let channels = match image.channels() {
        1 => [0, 0, 0],
        3 => [0, 1, 2],
        found => return Err(Error::Channels { layer: String::new(), found }),
    };
    let mut pixels = Vec::with_capacity(3 * extent.pixels());
    for k in 0..extent.pixels() {
        pixels.extend(channels.map(|c| byte(image.plane(c)[k] * exposure)));
    }
    let mut out = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut out, extent.width, extent.height);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(out)
}

/// The sRGB curve (IEC 61966-2-1), 0..=1 to 0..=1.
pub fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

fn byte(linear: f32) -> u8 {
    // NaN fails the comparison and becomes black.
    let value = if linear > 0.0 { srgb(linear.min(1.0)) } else { 0.0 };
    (value * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Extent;

    #[test]
    fn curve_and_clamping() {
        assert_eq!([0.0, 1.0, 5.0, -1.0, f32::NAN, f32::INFINITY].map(byte), [0, 255, 255, 0, 0, 255]);
        assert_eq!(byte(0.214_041_14), 128);
        assert_eq!(byte(0.002), 7);
    }

    #[test]
    fn files_start_as_png_and_repeat() {
        let image = Image::from_planes(Extent { width: 2, height: 1 }, 3, vec![0.0, 1.0, 0.5, 0.5, 0.2, 0.1]).unwrap();
        let bytes = encode(&image, 1.0).unwrap();
        assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
        assert_eq!(bytes, encode(&image, 1.0).unwrap());
        assert!(encode(&Image::new(Extent { width: 1, height: 1 }, 2), 1.0).is_err());
    }
}
