//! The encoding of an image between two stages of a job: its bits as they are, so that what is read is what was written.
//!
//! Encoding, all numbers little-endian: `GFI1`; width, height and channels as u32; then the values, channel after channel, as f32. Stored
//! are the values' bytes regrouped as in blocks, through zstd.

use bytes::Bytes;
use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;

use crate::block::{DecodeBlockError, LEVEL, regroup, restore};
use crate::limits;

const MAGIC: &[u8; 4] = b"GFI1";
/// Magic and three numbers.
const HEAD: usize = 16;
/// Most channels.
const CHANNELS: u32 = 64;

/// Encodes and compresses an image: its size before compression [bytes], and the compressed form.
///
/// # Errors
/// If the compressor has no memory.
pub fn encode(image: &Image) -> std::io::Result<(u64, Bytes)> {
    let extent = image.extent();
    let mut bytes = Vec::with_capacity(HEAD + 4 * image.data().len());
    bytes.extend_from_slice(MAGIC);
    for number in [extent.width, extent.height, image.channels() as u32] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    let values: Vec<u8> = image.data().iter().flat_map(|value| value.to_le_bytes()).collect();
    bytes.extend(regroup(&values));
    Ok((bytes.len() as u64, zstd::bulk::compress(&bytes, LEVEL)?.into()))
}

/// The image of an encoding. Nothing larger than `size`, nor than what blocks may have, is ever allocated.
///
/// # Errors
/// If the bytes are no image of that size.
pub fn decode(compressed: &[u8], size: u64) -> Result<Image, DecodeBlockError> {
    if size > limits::IMAGE {
        return Err(DecodeBlockError::Size { found: size, allowed: limits::IMAGE });
    }
    let bytes = zstd::bulk::decompress(compressed, size as usize)
        .map_err(|error| DecodeBlockError::Decompress { expected: size, reason: error.to_string() })?;
    if bytes.len() as u64 != size || bytes.len() < HEAD || bytes[..4] != *MAGIC {
        return Err(DecodeBlockError::Malformed("it does not begin with GFI1, or breaks off"));
    }
    let number = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let (extent, channels) = (Extent { width: number(4), height: number(8) }, number(12));
    let values = u64::from(extent.width).checked_mul(u64::from(extent.height)).and_then(|n| n.checked_mul(4 * u64::from(channels)));
    if channels > CHANNELS || values != Some((bytes.len() - HEAD) as u64) {
        return Err(DecodeBlockError::Malformed("the values do not fill the image"));
    }
    let values = restore(&bytes[HEAD..]);
    let values = values.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    Image::from_planes(extent, channels as usize, values).ok_or(DecodeBlockError::Malformed("the values do not fill the image"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_come_back_bit_by_bit() {
        let extent = Extent { width: 5, height: 3 };
        let values = (0..15 * 9).map(|k| if k == 7 { -0.0 } else { (k as f32).exp().min(f32::MAX) }).collect();
        let image = Image::from_planes(extent, 9, values).unwrap();
        let (size, compressed) = encode(&image).unwrap();
        let back = decode(&compressed, size).unwrap();
        assert_eq!((back.extent(), back.channels()), (extent, 9));
        assert!(back.data().iter().zip(image.data()).all(|(a, b)| a.to_bits() == b.to_bits()));
        for bad in [size - 1, size + 1, u64::MAX] {
            assert!(decode(&compressed, bad).is_err(), "{bad}");
        }
        assert!(decode(&compressed[1..], size).is_err());
    }
}
