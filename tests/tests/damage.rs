//! Damaged and hostile files: every reader answers each with an error or a scene, in bounded memory, and never panics.
//!
//! Ten thousand of them, made from the small files in `tests/scenes` by a counter-based sequence: what fails once fails always.

#![allow(clippy::unwrap_used)]

use gradfarm_core::scene::read::{Format, read};
use gradfarm_core::scene::{Assets, Error, ErrorKind, Scene, SceneDescription};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Damaged inputs in all.
const INPUTS: u64 = 10_000;
/// Most memory that all of it may take at once [kB]; the largest seed has four.
const MEMORY: u64 = 2 << 20;

/// Files by name, in memory.
struct Files(BTreeMap<String, Vec<u8>>);

impl Assets for Files {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        let missing = || Error::new(ErrorKind::Unreadable, name, "", "no such file", "one of the seeds");
        self.0.get(name).cloned().ok_or_else(missing)
    }
}

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

/// The files that seeds refer to.
fn files() -> Files {
    let read = |name: &str| (name.to_string(), std::fs::read(scenes().join("seeds").join(name)).unwrap());
    Files(["square.ply", "picture.png", "more.pbrt"].iter().map(|name| read(name)).collect())
}

/// How the bytes of a seed are read.
#[derive(Clone, Copy, Debug)]
enum Reader {
    /// As a scene.
    Scene(Format),
    /// As a mesh of a scene, by the word for its geometry.
    Mesh(&'static str),
    /// As a texture of a scene.
    Image,
}

const SEEDS: &[(&str, Reader)] = &[
    ("seeds/square.gltf", Reader::Scene(Format::Gltf)),
    ("seeds/square.glb", Reader::Scene(Format::Gltf)),
    ("seeds/room.pbrt", Reader::Scene(Format::Pbrt)),
    ("seeds/room.xml", Reader::Scene(Format::Mitsuba)),
    ("seeds/room.json", Reader::Scene(Format::Native)),
    ("urn.ply", Reader::Mesh("ply")),
    ("seeds/square.ply", Reader::Mesh("ply")),
    ("column.obj", Reader::Mesh("obj")),
    ("seeds/picture.png", Reader::Image),
    ("seeds/picture.jpg", Reader::Image),
    ("seeds/picture.hdr", Reader::Image),
    ("seeds/picture.exr", Reader::Image),
];

/// A scene whose one mesh or image is the file `x`.
fn around(reader: Reader) -> SceneDescription {
    let (texture, geometry, reflectance) = match reader {
        Reader::Mesh(word) => (String::new(), format!(r#"{{"{word}": {{"file": "x"}}}}"#), "0.5".to_string()),
        _ => (r#""t": {"bitmap": {"file": "x"}}"#.to_string(), r#""cube""#.to_string(), r#"{"texture": "t"}"#.to_string()),
    };
    let text = format!(
        r#"{{"version": 1, "camera": {{"perspective": {{"fov": 40}}}}, "textures": {{{texture}}},
            "materials": {{"m": {{"diffuse": {{"reflectance": {reflectance}}}}}}}, "shapes": [{{"geometry": {geometry}, "material": "m"}}]}}"#
    );
    SceneDescription::from_json(&text, "around.json").unwrap()
}

/// Reads bytes as the reader does; whether a scene came of it.
fn outcome(reader: Reader, bytes: Vec<u8>, files: &mut Files) -> Result<(), Error> {
    match reader {
        Reader::Scene(format) => {
            let imported = read(format, bytes, "s", files)?;
            imported.description.validate("s")
        }
        Reader::Mesh(_) | Reader::Image => {
            files.0.insert("x".to_string(), bytes);
            Scene::compile(&around(reader), files).map(drop)
        }
    }
}

/// Numbers that follow from a seed (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// What numbers of a text are replaced with.
const HUGE: &[&str] = &["1000000000", "4294967295", "18446744073709551615", "-1", "0", "1e308", "1e-320", "0.5", "99999999999999999999999"];
/// What is put into texts.
const WORDS: &[&str] = &[
    "../../etc/passwd",
    "..",
    "/",
    "\"",
    "[",
    "]",
    "{",
    "}",
    "<",
    ">",
    "\0",
    "\n",
    "#",
    ",",
    "nan",
    "inf",
    "null",
    "true",
    "Include \"room.pbrt\" ",
    "ObjectBegin \"a\" ",
    "AttributeBegin ",
    "\u{fffd}",
];

/// Damages some bytes in one of a dozen ways.
fn damage(bytes: &mut Vec<u8>, numbers: &mut Numbers) {
    let length = bytes.len();
    let at = numbers.below(length);
    match numbers.below(9) {
        0 => (0..=numbers.below(8)).for_each(|_| {
            let place = numbers.below(length);
            bytes[place] ^= 1 << numbers.below(8);
        }),
        1 => bytes.truncate(at),
        2 => bytes[at] = numbers.pick(&[0, 1, 0x20, 0x30, 0x39, 0x7f, 0x80, 0xff]),
        3 => {
            // A run of digits, wherever there is one after this place, becomes a number that nobody expects.
            let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) else { return };
            let end = bytes[start..].iter().position(|byte| !b"0123456789.eE".contains(byte)).map_or(length, |k| start + k);
            let huge = numbers.pick(HUGE);
            bytes.splice(start..end, huge.bytes());
        }
        4 => {
            let claim = numbers.pick(&[u32::MAX, 0x3fff_ffff, 0x7fff_ffff, 0x4000_0000, 1 << 24, 0]);
            for (byte, claimed) in bytes[at..].iter_mut().zip(claim.to_le_bytes()) {
                *byte = claimed;
            }
        }
        5 => {
            let word = numbers.pick(WORDS);
            bytes.splice(at..at, word.bytes());
        }
        6 => {
            let end = (at + 1 + numbers.below(64)).min(length);
            bytes.drain(at..end);
        }
        7 => {
            let end = (at + 1 + numbers.below(256)).min(length);
            let copy = bytes[at..end].to_vec();
            let to = numbers.below(length);
            bytes.splice(to..to, copy);
        }
        _ => {
            let end = (at + 1 + numbers.below(32)).min(length);
            bytes[at..end].fill(numbers.pick(&[0, 0xff, b'9', b'[', b'"']));
        }
    }
}

#[test]
fn ten_thousand_damaged_files_give_an_error_or_a_scene() {
    let mut files = files();
    let seeds: Vec<(&str, Reader, Vec<u8>)> =
        SEEDS.iter().map(|(name, reader)| (*name, *reader, std::fs::read(scenes().join(name)).unwrap())).collect();
    for (name, reader, bytes) in &seeds {
        // Whole, each is a scene; or at least nothing but the abilities of the renderer speaks against it.
        if let Err(fault) = outcome(*reader, bytes.clone(), &mut files) {
            assert_eq!(fault.kind, ErrorKind::Unsupported, "{name}: {fault}");
        }
    }
    let mut scenes_of = BTreeMap::new();
    for index in 0..INPUTS {
        let (name, reader, whole) = &seeds[index as usize % seeds.len()];
        let mut numbers = Numbers(index);
        let mut bytes = whole.clone();
        for _ in 0..=numbers.below(3) {
            if !bytes.is_empty() {
                damage(&mut bytes, &mut numbers);
            }
        }
        let answer = catch_unwind(AssertUnwindSafe(|| outcome(*reader, bytes, &mut files)));
        let answer = answer.unwrap_or_else(|_| panic!("input {index}, made from {name}, made its reader panic"));
        match answer {
            Ok(()) => *scenes_of.entry(name).or_insert(0) += 1,
            Err(fault) => assert!(!fault.found.is_empty() && !fault.place.file.is_empty(), "input {index}, from {name}: {fault}"),
        }
    }
    eprintln!("of {INPUTS} damaged files these were read all the same: {scenes_of:?}");
    let survivors: u64 = scenes_of.values().sum();
    assert!(
        (INPUTS / 100..INPUTS * 9 / 10).contains(&survivors),
        "{survivors} of {INPUTS}: the damage is too small or too large to test anything"
    );
    if let Some(peak) = peak_memory() {
        assert!(peak < MEMORY, "{peak} kB at the peak");
    }
}

/// Most memory that this process has held [kB], where the system tells.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_ascii_whitespace().nth(1)?.parse().ok()
}

/// Claims of sizes that no file backs, and circles: by hand, since chance would not find them.
#[test]
fn lies_about_sizes_and_circles_are_found_before_memory_is_taken() {
    let camera = "Camera \"perspective\" WorldBegin ";
    let gltf = |rest: &str| format!(r#"{{"asset": {{"version": "2.0"}}, {rest}}}"#);
    let ply = |count: u64| {
        format!("ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
    };
    let png = |side: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        bytes.extend([side.to_be_bytes(), side.to_be_bytes()].concat());
        bytes.extend(b"\x08\x06\0\0\0\0\0\0\0");
        bytes
    };
    let cases: Vec<(Reader, Vec<u8>)> = vec![
        (Reader::Scene(Format::Pbrt), format!("{camera}Include \"loop.pbrt\"").into_bytes()),
        (Reader::Scene(Format::Pbrt), format!("{camera}{}", "AttributeBegin ".repeat(1 << 20)).into_bytes()),
        (Reader::Scene(Format::Pbrt), format!("{camera}{}", "ObjectBegin \"a\" ".repeat(2)).into_bytes()),
        (
            Reader::Scene(Format::Pbrt),
            format!("{camera}Shape \"loopsubdiv\" \"integer levels\" 30 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]")
                .into_bytes(),
        ),
        (Reader::Scene(Format::Pbrt), format!("{camera}Shape \"sphere\" {}", "\"float radius\" [".repeat(100_000)).into_bytes()),
        (Reader::Scene(Format::Gltf), gltf(r#""buffers": [{"byteLength": 1073741824, "uri": "data:;base64,AA=="}]"#).into_bytes()),
        (
            Reader::Scene(Format::Gltf),
            gltf(
                r#""nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                   "accessors": [{"componentType": 5126, "type": "VEC3", "count": 200000000}]"#,
            )
            .into_bytes(),
        ),
        (Reader::Scene(Format::Gltf), gltf(r#""nodes": [{"children": [1]}, {"children": [0]}], "scenes": [{"nodes": [0]}]"#).into_bytes()),
        (Reader::Scene(Format::Gltf), [&b"glTF\x02\0\0\0\xff\xff\xff\xff\xff\xff\xff\xffJSON{}"[..]].concat()),
        (Reader::Scene(Format::Gltf), vec![b'['; 1 << 20]),
        (Reader::Scene(Format::Native), vec![b'['; 1 << 20]),
        (Reader::Scene(Format::Mitsuba), "<scene version=\"3.0.0\">".repeat(100_000).into_bytes()),
        (Reader::Mesh("ply"), ply(1 << 30).into_bytes()),
        (Reader::Mesh("ply"), ply(u64::MAX).into_bytes()),
        (Reader::Mesh("obj"), b"v 0 0 0\nf 1 1 4000000000\n".to_vec()),
        (Reader::Image, png(u32::MAX)),
        (Reader::Image, png(1 << 20)),
        (Reader::Image, b"#?RADIANCE\n\n-Y 1000000 +X 1000000\n".to_vec()),
    ];
    let mut files = files();
    files.0.insert("loop.pbrt".to_string(), b"Include \"loop.pbrt\"".to_vec());
    let before = peak_memory();
    for (reader, bytes) in cases {
        let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(80)]).into_owned();
        assert!(outcome(reader, bytes, &mut files).is_err(), "{reader:?} took {shown}");
    }
    if let (Some(before), Some(after)) = (before, peak_memory()) {
        assert!(after < before + (512 << 10), "{} kB for lies", after - before);
    }
}
