//! The encoding of a result: one fixed byte string for each block, and its compressed form for the wire and the store.
//!
//! Encoding, all numbers little-endian: `GFB1`; tile x, y, width, height and first sample, sample count as u32; number of
//! counters as u32 and each as u64; number of planes as u32 and each plane's code as u32; then the values of the planes, one
//! after the other, as f32. Equal blocks have equal encodings, so the digest of the encoding names the result.
//!
//! Compressed form: the same with the values' bytes regrouped (all first bytes, then all second bytes, …), through zstd.
//! Noise leaves the mantissas as they are, but signs and exponents then lie together and shrink.

use bytes::Bytes;
use gradfarm_core::film::{FilmBlock, PlaneKind, Statistics};
use gradfarm_core::lattice::{SampleRange, Tile};

use crate::digest::Digest;
use crate::limits;

const MAGIC: &[u8; 4] = b"GFB1";
/// Magic, six numbers, the two counts.
const FIXED: usize = 4 + 6 * 4 + 4 + 4;
/// Fast: the data is mostly noise.
pub(crate) const LEVEL: i32 = 1;

/// A block ready to be sent or stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedBlock {
    /// Digest of the encoding before compression.
    pub digest: Digest,
    /// Size of the encoding before compression [bytes].
    pub size: u64,
    /// The compressed form.
    pub compressed: Bytes,
}

/// Bytes that are not the block they claim to be.
#[derive(Debug, thiserror::Error)]
pub enum DecodeBlockError {
    /// Larger than allowed.
    #[error("block of {found} bytes, at most {allowed} are expected")]
    Size {
        /// Announced size.
        found: u64,
        /// The bound.
        allowed: u64,
    },
    /// The compressed form does not decompress to the announced size.
    #[error("block does not decompress to {expected} bytes: {reason}")]
    Decompress {
        /// Announced size.
        expected: u64,
        /// What went wrong.
        reason: String,
    },
    /// Another content than announced.
    #[error("block has digest {found}, announced was {expected}")]
    Digest {
        /// What was announced.
        expected: Digest,
        /// What the content hashes to.
        found: Digest,
    },
    /// The encoding breaks off or says something impossible.
    #[error("block encoding: {0}")]
    Malformed(&'static str),
    /// A plane that this version does not know.
    #[error("block encoding: unknown plane code {0}")]
    Plane(u32),
}

/// Size of the encoding of a block with these planes and this many counters [bytes].
pub fn encoded_size(tile: Tile, planes: &[PlaneKind], counters: usize) -> u64 {
    let values: u64 = planes.iter().map(|plane| tile.pixels() as u64 * plane.channels() as u64).sum();
    FIXED as u64 + 8 * counters as u64 + 4 * planes.len() as u64 + 4 * values
}

/// Encodes and compresses a block.
///
/// # Errors
/// If the compressor has no memory.
pub fn encode(block: &FilmBlock) -> std::io::Result<EncodedBlock> {
    let values: usize = block.planes.iter().map(|(_, values)| values.len()).sum();
    let counts = block.statistics.counts();
    let mut bytes = Vec::with_capacity(FIXED + 8 * counts.len() + 4 * block.planes.len() + 4 * values);
    bytes.extend_from_slice(MAGIC);
    let (tile, samples) = (block.tile, block.samples);
    for number in [tile.x, tile.y, tile.width, tile.height, samples.first, samples.count, counts.len() as u32] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    for count in counts {
        bytes.extend_from_slice(&count.to_le_bytes());
    }
    bytes.extend_from_slice(&(block.planes.len() as u32).to_le_bytes());
    for (plane, _) in &block.planes {
        bytes.extend_from_slice(&plane.code().to_le_bytes());
    }
    let head = bytes.len();
    for (_, values) in &block.planes {
        for value in values {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    let digest = Digest::of(&bytes);
    let size = bytes.len() as u64;
    let regrouped = regroup(&bytes[head..]);
    bytes[head..].copy_from_slice(&regrouped);
    let compressed = zstd::bulk::compress(&bytes, LEVEL)?.into();
    Ok(EncodedBlock { digest, size, compressed })
}

/// Decompresses, checks size and digest, and decodes. Nothing larger than `allowed` is ever allocated.
///
/// # Errors
/// If the bytes are not the block that `digest` and `size` announce.
pub fn decode(compressed: &[u8], digest: Digest, size: u64, allowed: u64) -> Result<FilmBlock, DecodeBlockError> {
    let allowed = allowed.min(limits::BLOCK);
    if size > allowed || compressed.len() as u64 > allowed + 1024 {
        return Err(DecodeBlockError::Size { found: size.max(compressed.len() as u64), allowed });
    }
    let mut bytes = zstd::bulk::decompress(compressed, size as usize)
        .map_err(|error| DecodeBlockError::Decompress { expected: size, reason: error.to_string() })?;
    if bytes.len() as u64 != size {
        return Err(DecodeBlockError::Decompress { expected: size, reason: format!("it gives {} bytes", bytes.len()) });
    }
    let (mut block, shapes, head) = read_head(&bytes)?;
    let values: usize = shapes.iter().map(|(_, count)| count).sum();
    if bytes.len() - head != 4 * values {
        return Err(DecodeBlockError::Malformed("the values do not fill the planes"));
    }
    let restored = restore(&bytes[head..]);
    bytes[head..].copy_from_slice(&restored);
    let found = Digest::of(&bytes);
    if found != digest {
        return Err(DecodeBlockError::Digest { expected: digest, found });
    }
    let mut rest = &bytes[head..];
    for (plane, count) in shapes {
        let (mine, after) = rest.split_at(4 * count);
        block.planes.push((plane, mine.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()));
        rest = after;
    }
    Ok(block)
}

/// A plane and its number of values.
type Shape = (PlaneKind, usize);

/// Everything before the values: a block without planes, the planes with their numbers of values, and where the values start.
fn read_head(bytes: &[u8]) -> Result<(FilmBlock, Vec<Shape>, usize), DecodeBlockError> {
    let mut reader = Reader { bytes, at: 0 };
    if reader.take::<4>()? != *MAGIC {
        return Err(DecodeBlockError::Malformed("it does not begin with GFB1"));
    }
    let [x, y, width, height, first, count, counters] =
        [reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?];
    let tile = Tile { x, y, width, height };
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > limits::PIXELS {
        return Err(DecodeBlockError::Malformed("the tile is empty or too large"));
    }
    if first.checked_add(count).is_none() {
        return Err(DecodeBlockError::Malformed("the sample range passes the largest sample index"));
    }
    if counters as usize > limits::LINES {
        return Err(DecodeBlockError::Malformed("too many counters"));
    }
    let counts = (0..counters).map(|_| reader.take::<8>().map(u64::from_le_bytes)).collect::<Result<Vec<_>, _>>()?;
    let planes = reader.u32()?;
    if planes as usize > limits::LINES {
        return Err(DecodeBlockError::Malformed("too many planes"));
    }
    let mut shapes = Vec::with_capacity(planes as usize);
    for _ in 0..planes {
        let code = reader.u32()?;
        let plane = PlaneKind::from_code(code).ok_or(DecodeBlockError::Plane(code))?;
        shapes.push((plane, tile.pixels() * plane.channels()));
    }
    let block = FilmBlock {
        tile,
        samples: SampleRange { first, count },
        planes: Vec::with_capacity(shapes.len()),
        statistics: Statistics::from_counts(&counts),
    };
    Ok((block, shapes, reader.at))
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], DecodeBlockError> {
        let slice = self.bytes.get(self.at..self.at + N).and_then(|s| s.try_into().ok());
        self.at += N;
        slice.ok_or(DecodeBlockError::Malformed("it breaks off"))
    }

    fn u32(&mut self) -> Result<u32, DecodeBlockError> {
        Ok(u32::from_le_bytes(self.take()?))
    }
}

/// All first bytes of the f32 values, then all second bytes, and so on.
pub(crate) fn regroup(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(bytes.len());
    for k in 0..4 {
        out.extend(bytes.iter().skip(k).step_by(4));
    }
    out
}

/// The inverse of [`regroup`].
pub(crate) fn restore(bytes: &[u8]) -> Vec<u8> {
    let n = bytes.len() / 4;
    let (a, rest) = bytes.split_at(n);
    let (b, rest) = rest.split_at(n);
    let (c, d) = rest.split_at(n);
    let mut out = Vec::with_capacity(bytes.len());
    for (((a, b), c), d) in a.iter().zip(b).zip(c).zip(d) {
        out.extend_from_slice(&[*a, *b, *c, *d]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::film::Counter;
    use proptest::prelude::*;

    fn layout(gradients: bool, links: u8) -> Vec<PlaneKind> {
        PlaneKind::layout(gradients).into_iter().chain(PlaneKind::links(links)).collect()
    }

    fn sample(width: u32, height: u32, layout: &[PlaneKind], seed: u32) -> FilmBlock {
        let tile = Tile { x: 3, y: 5, width, height };
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 1e6 - 4.0
        };
        let planes = layout.iter().map(|kind| (*kind, (0..tile.pixels() * kind.channels()).map(|_| next()).collect())).collect();
        let mut statistics = Statistics::default();
        statistics.add(Counter::Rays, u64::from(seed) << 20);
        FilmBlock { tile, samples: SampleRange { first: 16, count: 16 }, planes, statistics }
    }

    proptest! {
        #[test]
        fn blocks_come_back_as_they_were(width in 1u32..20, height in 1u32..20, gradients: bool, links in 0..=PlaneKind::SLOTS, seed: u32) {
            let layout = layout(gradients, links);
            let block = sample(width, height, &layout, seed);
            let encoded = encode(&block).unwrap();
            prop_assert_eq!(encoded.size, encoded_size(block.tile, &layout, block.statistics.counts().len()));
            let back = decode(&encoded.compressed, encoded.digest, encoded.size, encoded.size).unwrap();
            prop_assert_eq!(back, block);
        }

        #[test]
        fn damage_never_passes_and_never_panics(seed: u32, at in 0usize..1 << 16, flip in 1u8..) {
            let encoded = encode(&sample(4, 3, &layout(false, 0), seed)).unwrap();
            let mut bytes = encoded.compressed.to_vec();
            let at = at % bytes.len();
            bytes[at] ^= flip;
            if let Ok(block) = decode(&bytes, encoded.digest, encoded.size, encoded.size) {
                prop_assert_eq!(block, sample(4, 3, &layout(false, 0), seed));
            }
        }
    }

    #[test]
    fn sizes_are_bounded_before_anything_is_allocated() {
        let encoded = encode(&sample(4, 4, &layout(true, 0), 1)).unwrap();
        let refused = decode(&encoded.compressed, encoded.digest, 1 << 40, u64::MAX);
        assert!(matches!(refused, Err(DecodeBlockError::Size { .. })));
        let refused = decode(&encoded.compressed, encoded.digest, encoded.size, encoded.size - 1);
        assert!(matches!(refused, Err(DecodeBlockError::Size { .. })));
        let refused = decode(&encoded.compressed, encoded.digest, encoded.size - 1, encoded.size);
        assert!(matches!(refused, Err(DecodeBlockError::Decompress { .. })));
    }
}
