//! Radiance HDR.

use super::{check, malformed};
use crate::scene::error::Error;
use crate::texture::{Pixels, Texels};
use zune_core::bytestream::ZCursor;
use zune_core::options::DecoderOptions;
use zune_hdr::HdrDecoder;

const EXPECTED: &str = "a Radiance HDR image";

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Pixels, Error> {
    let options = DecoderOptions::new_safe().set_max_width(1 << 16).set_max_height(1 << 16);
    let mut decoder = HdrDecoder::new_with_options(ZCursor::new(bytes), options);
    let fault = |fault: zune_hdr::HdrDecodeErrors| malformed(name, format!("{fault:?}"), EXPECTED);
    decoder.decode_headers().map_err(fault)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| malformed(name, "an image without a size", EXPECTED))?;
    let (width, height) = check(width as u64, height as u64, name)?;
    let samples = decoder.decode().map_err(fault)?;
    if samples.len() != width as usize * height as usize * 3 {
        return Err(malformed(name, format!("{} samples for {width} × {height} texels", samples.len()), EXPECTED));
    }
    Ok(Pixels { width, height, texels: Texels::Floats(samples.chunks_exact(3).map(|s| [s[0], s[1], s[2], 1.0]).collect()) })
}
