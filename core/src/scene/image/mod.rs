//! Image files: PNG, JPEG, OpenEXR and Radiance HDR, known by their first bytes, measured before anything is allocated.

mod hdr;
mod jpeg;
mod openexr;
mod png;

use super::error::{Error, ErrorKind};
use super::limits;
use crate::texture::Pixels;

/// Decodes an image; `name` is the name that errors carry.
///
/// # Errors
/// A format that is none of the four, a file that is faulty, or more than [`limits::IMAGE_PIXELS`] texels.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Pixels, Error> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png::read(bytes, name),
        [0xff, 0xd8, ..] => jpeg::read(bytes, name),
        [0x76, 0x2f, 0x31, 0x01, ..] => openexr::read(bytes, name),
        [b'#', b'?', ..] => hdr::read(bytes, name),
        _ => Err(Error::new(ErrorKind::Unsupported, name, "", "an image of unknown format", "PNG, JPEG, OpenEXR or Radiance HDR")),
    }
}

/// Holds the size that a file claims against the limit.
fn check(width: u64, height: u64, name: &str) -> Result<(u32, u32), Error> {
    let pixels = width.saturating_mul(height);
    if pixels == 0 || pixels > limits::IMAGE_PIXELS || width > u64::from(u32::MAX) || height > u64::from(u32::MAX) {
        let kind = if pixels == 0 { ErrorKind::Malformed } else { ErrorKind::TooLarge };
        let expected = format!("1 to {} texels", limits::IMAGE_PIXELS);
        return Err(Error::new(kind, name, "", format!("an image of {width} × {height} texels"), expected));
    }
    Ok((width as u32, height as u32))
}

fn malformed(name: &str, fault: impl std::fmt::Display, expected: &str) -> Error {
    Error::new(ErrorKind::Malformed, name, "", fault.to_string(), expected)
}

#[cfg(test)]
mod tests;
