//! Files made here, in both versions and both precisions, and what damage does to them.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::*;

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// The unpacked bytes of a square at height `z`, with normals, texture coordinates and, if asked for, colours.
fn square(version: u16, flags: u32, z: f64) -> Vec<u8> {
    let mut bytes = flags.to_le_bytes().to_vec();
    if version == 4 {
        bytes.extend(b"square\0");
    }
    bytes.extend(4u64.to_le_bytes());
    bytes.extend(2u64.to_le_bytes());
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut put = |values: Vec<f64>| {
        for value in values {
            if flags & DOUBLE != 0 {
                bytes.extend(value.to_le_bytes());
            } else {
                bytes.extend((value as f32).to_le_bytes());
            }
        }
    };
    put(corners.iter().flat_map(|[x, y]| [*x, *y, z]).collect());
    if flags & HAS_NORMALS != 0 {
        put([0.0, 0.0, 2.0].repeat(4));
    }
    if flags & HAS_UVS != 0 {
        put(corners.concat());
    }
    if flags & HAS_COLOURS != 0 {
        put([0.5, 0.25, 1.0].repeat(4));
    }
    bytes.extend([0u32, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    bytes
}

/// A file of meshes with its table.
fn file(version: u16, meshes: &[Vec<u8>]) -> Vec<u8> {
    let (mut bytes, mut table) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let start = bytes.len();
        if version == 4 {
            table.extend((start as u64).to_le_bytes());
        } else {
            table.extend((start as u32).to_le_bytes());
        }
        bytes.extend(MAGIC.to_le_bytes());
        bytes.extend(version.to_le_bytes());
        bytes.extend(packed(mesh));
    }
    bytes.extend(table);
    bytes.extend((meshes.len() as u32).to_le_bytes());
    bytes
}

#[test]
fn both_versions_and_both_precisions_are_read() {
    let all = HAS_NORMALS | HAS_UVS | HAS_COLOURS;
    for version in [3, 4] {
        for precision in [0x1000, DOUBLE] {
            let bytes = file(version, &[square(version, precision, 1.0), square(version, precision | all | FACETED, 2.0)]);
            let first = parse(&bytes, 0, "t.serialized").unwrap();
            assert_eq!((first.mesh.normals.len(), first.mesh.uvs.len(), first.mesh.colours.len(), first.faceted), (0, 0, 0, false));
            assert_eq!(first.mesh.positions[2], Vec3::new(1.0, 1.0, 1.0));
            let second = parse(&bytes, 1, "t.serialized").unwrap();
            assert_eq!(second.mesh.positions[2], Vec3::new(1.0, 1.0, 2.0));
            assert_eq!(second.mesh.normals, [Vec3::Z; 4]);
            assert_eq!(second.mesh.uvs[1], Vec2::X);
            assert_eq!(second.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(second.mesh.colours, [Vec3::new(0.5, 0.25, 1.0); 4]);
            assert!(second.faceted);
        }
    }
}

#[test]
fn faults_are_named() {
    let bytes = file(4, &[square(4, 0, 1.0), square(4, 0, 2.0)]);
    let message = |bytes: &[u8], index| parse(bytes, index, "t.serialized").unwrap_err().to_string();
    assert!(message(&bytes, 2).contains("mesh number 2, expected a number below 2"));
    assert!(message(b"", 0).contains("the end of the file"));
    assert!(message(b"ply\nformat", 0).contains("expected 0x041c"));
    assert!(message(&[0x1c, 4, 9, 0], 0).contains("version 9, expected version 3 or 4"));
    assert!(message(&bytes[..20], 0).starts_with("t.serialized: at mesh 0: found"), "{}", message(&bytes[..20], 0));
    let mut wrong = square(4, 0, 1.0);
    let last = wrong.len() - 4;
    wrong[last] = 4;
    assert!(message(&file(4, &[wrong]), 0).contains("triangle 1: found vertex 4, expected 0 to 3"));
}

#[test]
fn claims_that_the_file_cannot_hold_are_refused_before_anything_is_allocated() {
    for (place, what) in [(11, "vertices"), (19, "triangles")] {
        for claim in [u64::MAX, 1 << 40, 1 << 30] {
            let mut mesh = square(4, 0, 1.0);
            mesh[place..place + 8].copy_from_slice(&claim.to_le_bytes());
            let message = parse(&file(4, &[mesh]), 0, "t.serialized").unwrap_err().to_string();
            assert!(message.contains(what) && message.contains("sizes that the file can hold"), "{message}");
        }
    }
    // A table that claims more meshes than there are bytes, or one that leads out of the file.
    let mut bytes = file(4, &[square(4, 0, 1.0), square(4, 0, 2.0)]);
    let end = bytes.len();
    bytes[end - 12..end - 4].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(parse(&bytes, 1, "t").unwrap_err().to_string().contains("expected a place before"));
    bytes[end - 4..].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(parse(&bytes, 1, "t").unwrap_err().to_string().contains("4294967295 meshes"));
}

#[test]
fn damage_never_panics() {
    let whole = file(4, &[square(4, HAS_NORMALS | HAS_UVS, 1.0), square(4, DOUBLE, 2.0)]);
    for cut in 0..whole.len() {
        let _ = parse(&whole[..cut], cut % 2, "t");
    }
    for byte in 0..whole.len() {
        for bit in 0..8 {
            let mut bytes = whole.clone();
            bytes[byte] ^= 1 << bit;
            let _ = parse(&bytes, byte % 2, "t");
        }
    }
}
