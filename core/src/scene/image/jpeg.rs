//! JPEG.

use super::{check, malformed};
use crate::scene::error::Error;
use crate::texture::{Pixels, Texels};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

const EXPECTED: &str = "a JPEG image";

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Pixels, Error> {
    // The portable decoder everywhere: the same bits on every machine.
    let options = DecoderOptions::new_safe().set_use_unsafe(false).jpeg_set_out_colorspace(ColorSpace::RGB).set_strict_mode(false);
    let options = options.set_max_width(1 << 16).set_max_height(1 << 16);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let fault = |fault: zune_jpeg::errors::DecodeErrors| malformed(name, format!("{fault:?}"), EXPECTED);
    decoder.decode_headers().map_err(fault)?;
    let info = decoder.info().ok_or_else(|| malformed(name, "an image without a size", EXPECTED))?;
    let (width, height) = check(u64::from(info.width), u64::from(info.height), name)?;
    let samples = decoder.decode().map_err(fault)?;
    if samples.len() != width as usize * height as usize * 3 {
        return Err(malformed(name, format!("{} samples for {width} × {height} texels", samples.len()), EXPECTED));
    }
    Ok(Pixels { width, height, texels: Texels::Bytes(samples.chunks_exact(3).map(|s| [s[0], s[1], s[2], u8::MAX]).collect()) })
}
