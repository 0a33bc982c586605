//! PNG.

use super::{check, malformed};
use crate::scene::error::Error;
use crate::scene::limits;
use crate::texture::{Pixels, Texels};
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use std::io::Cursor;

const EXPECTED: &str = "a PNG image";

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Pixels, Error> {
    let fault = |fault: png::DecodingError| malformed(name, fault, EXPECTED);
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: limits::IMAGE_PIXELS as usize * 8 });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(fault)?;
    let (width, height) = check(u64::from(reader.info().width), u64::from(reader.info().height), name)?;
    let size = reader.output_buffer_size().ok_or_else(|| malformed(name, "an image without a size", EXPECTED))?;
    let mut buffer = vec![0; size];
    let frame = reader.next_frame(&mut buffer).map_err(fault)?;
    let buffer = &buffer[..frame.buffer_size()];
    let count = frame.color_type.samples();
    let texels = match frame.bit_depth {
        BitDepth::Sixteen => {
            let samples: Vec<u16> = buffer.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect();
            Texels::Words(samples.chunks_exact(count).map(|s| texel(frame.color_type, s, u16::MAX)).collect())
        }
        _ => Texels::Bytes(buffer.chunks_exact(count).map(|s| texel(frame.color_type, s, u8::MAX)).collect()),
    };
    if texels.len() != width as usize * height as usize {
        return Err(malformed(name, format!("{} texels of {width} × {height}", texels.len()), EXPECTED));
    }
    Ok(Pixels { width, height, texels })
}

fn texel<T: Copy>(kind: ColorType, samples: &[T], opaque: T) -> [T; 4] {
    match (kind, samples) {
        (ColorType::Grayscale, [grey, ..]) => [*grey, *grey, *grey, opaque],
        (ColorType::GrayscaleAlpha, [grey, alpha, ..]) => [*grey, *grey, *grey, *alpha],
        (ColorType::Rgba, [r, g, b, a, ..]) => [*r, *g, *b, *a],
        (_, [r, g, b, ..]) => [*r, *g, *b, opaque],
        _ => [opaque; 4],
    }
}
