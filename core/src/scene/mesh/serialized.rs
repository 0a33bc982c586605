//! Mitsuba's `.serialized` meshes: several in one file, each a zlib stream, and a table of their places at the end.
//!
//! # Source
//! Jakob, "Mitsuba Documentation", version 0.5, section 8.1.9, which describes versions 3 and 4.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::{bounded, faulty};
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};
use crate::scene::error::{Error, ErrorKind};

/// The first two bytes of the file, and of each mesh in it.
const MAGIC: u16 = 0x041C;
/// Bytes before each zlib stream: magic number and version.
const HEADER: usize = 4;
/// No zlib stream unpacks to more than this many times its length.
const INFLATION: u128 = 1_032;
/// Longest name of a mesh [bytes].
const NAME: usize = 4_096;

const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLOURS: u32 = 0x0008;
const FACETED: u32 = 0x0010;
const DOUBLE: u32 = 0x2000;

/// A mesh of a `.serialized` file.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::scene) struct Serialized {
    /// Its triangles, checked.
    pub(in crate::scene) mesh: Mesh,
    /// Whether it is written to be shown with the normals of its faces.
    pub(in crate::scene) faceted: bool,
}

/// Reads mesh number `index`, from 0; `file` is the name that errors carry.
///
/// # Errors
/// No `.serialized` file of version 3 or 4, no such mesh, sizes that the file cannot hold, a damaged stream, a faulty mesh.
pub(in crate::scene) fn parse(bytes: &[u8], index: usize, file: &str) -> Result<Serialized, Error> {
    let version = header(bytes, 0, file)?;
    let start = place(bytes, version, index, file)?;
    header(bytes, start, file)?;
    let packed = &bytes[start + HEADER..];
    let mut stream = Stream { inflated: ZlibDecoder::new(packed), packed: packed.len(), index, file };
    let flags = stream.u32()?;
    let width = if flags & DOUBLE == 0 { 4 } else { 8 };
    if version == 4 {
        stream.name()?;
    }
    let (vertices, triangles) = (stream.u64()?, stream.u64()?);
    let index_width: u64 = if vertices > u64::from(u32::MAX) { 8 } else { 4 };
    let floats = [(3, true), (3, flags & HAS_NORMALS != 0), (2, flags & HAS_UVS != 0), (3, flags & HAS_COLOURS != 0)];
    let floats: u64 = floats.into_iter().filter_map(|(count, there)| there.then_some(count)).sum();
    // Told before anything is allocated: what this much zlib data can never hold.
    let claimed = u128::from(vertices) * u128::from(floats * width) + u128::from(triangles) * u128::from(3 * index_width);
    if claimed > packed.len() as u128 * INFLATION {
        return Err(stream.fault(format!("{vertices} vertices and {triangles} triangles"), "sizes that the file can hold"));
    }
    bounded(vertices as usize, "vertices", file)?;
    bounded(triangles as usize, "triangles", file)?;
    let (vertices, triangles) = (vertices as usize, triangles as usize);
    let mut triple = |there: bool| stream.floats(if there { 3 * vertices } else { 0 }, width);
    let positions = triple(true)?.chunks_exact(3).map(Vec3::from_slice).collect();
    let normals = triple(flags & HAS_NORMALS != 0)?.chunks_exact(3).map(|n| Vec3::from_slice(n).normalize_or_zero()).collect();
    let uvs = stream.floats(if flags & HAS_UVS != 0 { 2 * vertices } else { 0 }, width)?;
    let uvs = uvs.chunks_exact(2).map(Vec2::from_slice).collect();
    let coloured = flags & HAS_COLOURS != 0;
    let colours = stream.floats(if coloured { 3 * vertices } else { 0 }, width)?;
    let colours = colours.chunks_exact(3).map(Vec3::from_slice).collect();
    let corners = stream.take(12 * triangles)?;
    let corner = |k: usize, bytes: &[u8]| u32::from_le_bytes(std::array::from_fn(|b| bytes[4 * k + b]));
    let triangles = corners.chunks_exact(12).map(|bytes| [corner(0, bytes), corner(1, bytes), corner(2, bytes)]).collect();
    let mesh = Mesh { positions, normals, uvs, colours, triangles };
    mesh.check().map_err(|fault| faulty(&fault, file))?;
    Ok(Serialized { mesh, faceted: flags & FACETED != 0 })
}

/// Checks magic number and version at `start`, and gives the version.
fn header(bytes: &[u8], start: usize, file: &str) -> Result<u16, Error> {
    let word = |at: usize| Some(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]));
    let fault = |kind, found, expected: &str| Err(Error::new(kind, file, &format!("byte {start}"), found, expected));
    match (word(start), word(start + 2)) {
        (Some(MAGIC), Some(version @ (3 | 4))) => Ok(version),
        (Some(MAGIC), Some(other)) => fault(ErrorKind::Unsupported, format!("version {other}"), "version 3 or 4"),
        (Some(MAGIC), None) | (None, _) => fault(ErrorKind::Malformed, "the end of the file".to_string(), "a mesh"),
        (Some(other), _) => fault(ErrorKind::Malformed, format!("the number {other:#06x}"), "0x041c, a .serialized mesh"),
    }
}

/// Where mesh number `index` starts: from the table at the end, places of eight bytes (version 4) or four, then their number.
fn place(bytes: &[u8], version: u16, index: usize, file: &str) -> Result<usize, Error> {
    // The first mesh needs no table, and a file of one mesh may lack it.
    if index == 0 {
        return Ok(0);
    }
    let fault = |found: String, expected: String| Error::new(ErrorKind::Malformed, file, "table of meshes", found, expected);
    let width = if version == 4 { 8 } else { 4 };
    let table = bytes.len().saturating_sub(4);
    let number = |at: usize, width: usize| {
        let mut word = [0; 8];
        word[..width].copy_from_slice(bytes.get(at..at + width)?);
        usize::try_from(u64::from_le_bytes(word)).ok()
    };
    let count = number(table, 4).unwrap_or(0);
    let room = table / width;
    if count > room {
        return Err(fault(format!("{count} meshes in {} bytes", bytes.len()), format!("at most {room}")));
    }
    if index >= count {
        return Err(fault(format!("mesh number {index}"), format!("a number below {count}, counted from 0")));
    }
    let start = number(table - width * (count - index), width).unwrap_or(usize::MAX);
    if start > table {
        return Err(fault(format!("a mesh at byte {start}"), format!("a place before byte {table}")));
    }
    Ok(start)
}

/// One mesh's zlib stream as it is unpacked.
struct Stream<'a> {
    inflated: ZlibDecoder<&'a [u8]>,
    packed: usize,
    index: usize,
    file: &'a str,
}

impl Stream<'_> {
    fn fault(&self, found: impl Into<String>, expected: &str) -> Error {
        Error::new(ErrorKind::Malformed, self.file, &format!("mesh {}", self.index), found, expected)
    }

    /// The next bytes; what is allocated grows with what is really there.
    fn take(&mut self, count: usize) -> Result<Vec<u8>, Error> {
        if count as u128 > self.packed as u128 * INFLATION {
            return Err(self.fault(format!("{count} bytes claimed"), "what the file can hold"));
        }
        let mut bytes = Vec::new();
        let read = (&mut self.inflated).take(count as u64).read_to_end(&mut bytes);
        match read {
            Ok(_) if bytes.len() == count => Ok(bytes),
            Ok(_) => Err(self.fault("the end of its data", "more")),
            Err(fault) => Err(self.fault(fault.to_string(), "zlib data")),
        }
    }

    fn word<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let bytes = self.take(N)?;
        bytes.try_into().map_err(|_| self.fault("the end of its data", "more"))
    }

    fn u32(&mut self) -> Result<u32, Error> {
        self.word().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Error> {
        self.word().map(u64::from_le_bytes)
    }

    /// Skips a name that ends in a zero.
    fn name(&mut self) -> Result<(), Error> {
        for _ in 0..NAME {
            if self.word::<1>()? == [0] {
                return Ok(());
            }
        }
        Err(self.fault(format!("a name of more than {NAME} bytes"), "a shorter one"))
    }

    fn floats(&mut self, count: usize, width: u64) -> Result<Vec<f32>, Error> {
        let bytes = self.take(count * width as usize)?;
        Ok(match width {
            4 => bytes.chunks_exact(4).map(|word| f32::from_le_bytes(std::array::from_fn(|k| word[k]))).collect(),
            _ => bytes.chunks_exact(8).map(|word| f64::from_le_bytes(std::array::from_fn(|k| word[k])) as f32).collect(),
        })
    }
}

#[cfg(test)]
mod tests;
