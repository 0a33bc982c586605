//! PNG: eight bits of sRGB, for the eye.

use super::Error;
use crate::film::Image;
use crate::lattice::Extent;

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
    encode_bytes(extent, &pixels)
}

/// Encodes bytes as they are: red, green and blue of each pixel, row by row.
///
/// # Errors
/// If there are no pixels, or not as many bytes as they have.
pub fn encode_bytes(extent: Extent, pixels: &[u8]) -> Result<Vec<u8>, Error> {
    let mut out = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut out, extent.width, extent.height);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(out)
}

/// Reads back what [`encode`] wrote: the size, and red, green and blue of each pixel, row by row.
///
/// # Errors
/// If it is no such file.
pub fn decode(file: &[u8]) -> Result<(Extent, Vec<u8>), Error> {
    let unreadable = |fault: ::png::DecodingError| Error::Unreadable(fault.to_string());
    let mut reader = ::png::Decoder::new(std::io::Cursor::new(file)).read_info().map_err(unreadable)?;
    let Some(size) = reader.output_buffer_size() else { return Err(Error::Unreadable("it is too large".to_string())) };
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).map_err(unreadable)?;
    if (info.color_type, info.bit_depth) != (::png::ColorType::Rgb, ::png::BitDepth::Eight) {
        return Err(Error::Unreadable(format!(
            "found {:?} of {:?} bits, expected red, green and blue of eight",
            info.color_type, info.bit_depth
        )));
    }
    bytes.truncate(info.buffer_size());
    Ok((Extent { width: info.width, height: info.height }, bytes))
}

/// The sRGB curve (IEC 61966-2-1), 0..=1 to 0..=1.
pub fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

/// The inverse of the sRGB curve, of a byte.
pub fn linear(byte: u8) -> f32 {
    let v = f32::from(byte) / 255.0;
    if v <= 0.040_45 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// The nearest byte on the sRGB curve.
pub(super) fn byte(linear: f32) -> u8 {
    // NaN fails the comparison and becomes black.
    let value = if linear > 0.0 { srgb(linear.min(1.0)) } else { 0.0 };
    (value * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::{Error, byte, encode};
    use crate::film::Image;
    use crate::lattice::Extent;

    #[test]
    fn curve_and_clamping() {
        assert_eq!([0.0, 1.0, 5.0, -1.0, f32::NAN, f32::INFINITY].map(byte), [0, 255, 255, 0, 0, 255]);
        assert_eq!(byte(0.214_041_14), 128);
        assert_eq!(byte(0.002), 7);
    }

    /// Width, height and bytes of a file.
    fn decoded(file: &[u8]) -> (u32, u32, Vec<u8>) {
        let (extent, bytes) = super::decode(file).unwrap();
        (extent.width, extent.height, bytes)
    }

    /// The inverse of the sRGB curve, in double precision.
    fn linear(byte: f64) -> f32 {
        let v = byte / 255.0;
        (if v <= 0.040_45 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }) as f32
    }

    #[test]
    fn every_byte_is_reached_and_rounding_is_to_the_nearest() {
        for wanted in 0..=255u8 {
            let nearby = [-0.49, 0.0, 0.49].map(|d| byte(linear((f64::from(wanted) + d).max(0.0))));
            assert_eq!(nearby, [wanted; 3]);
        }
    }

    #[test]
    fn pixels_and_channels_keep_their_places() {
        let image =
            Image::from_planes(Extent { width: 2, height: 1 }, 3, [10.0, 20.0, 30.0, 40.0, 50.0, 60.0].map(linear).to_vec()).unwrap();
        assert_eq!(decoded(&encode(&image, 1.0).unwrap()), (2, 1, vec![10, 30, 50, 20, 40, 60]));
        let grey = Image::from_planes(Extent { width: 1, height: 2 }, 1, vec![linear(200.0) / 4.0, f32::NAN]).unwrap();
        assert_eq!(decoded(&encode(&grey, 4.0).unwrap()), (1, 2, vec![200, 200, 200, 0, 0, 0]));
    }

    #[test]
    fn files_repeat_and_what_has_no_picture_is_refused() {
        let image = Image::from_planes(Extent { width: 2, height: 1 }, 3, vec![0.0, 1.0, 0.5, 0.5, 0.2, 0.1]).unwrap();
        assert_eq!(encode(&image, 1.0).unwrap(), encode(&image, 1.0).unwrap());
        assert!(matches!(encode(&Image::new(Extent { width: 1, height: 1 }, 2), 1.0), Err(Error::Channels { found: 2, .. })));
        assert!(matches!(encode(&Image::new(Extent { width: 0, height: 1 }, 3), 1.0), Err(Error::Png(_))));
    }
}
