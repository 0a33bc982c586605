//! Reading a scene from disk, in any format that this renderer knows: by the file's extension, and where that says nothing by its content.

use std::path::Path;

use super::assets::{Assets, DirectoryAssets, MadeAssets, SceneAssets, read_bounded};
use super::description::SceneDescription;
use super::error::{Error, ErrorKind};
pub use super::import::Imported;
use super::import::{gltf, mitsuba, pbrt};

/// A scene read from disk.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// What the file says, in the native description.
    pub description: SceneDescription,
    /// Its files: those that an importer made, and those beside it.
    pub assets: SceneAssets,
    /// What an importer changed or left out, one sentence each; empty for native scenes.
    pub report: Vec<String>,
}

/// The formats of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The native description in JSON.
    Native,
    /// Mitsuba's XML.
    Mitsuba,
    /// glTF 2.0, as JSON or as one binary file.
    Gltf,
    /// pbrt's text, version 4.
    Pbrt,
}

impl Format {
    /// The format of a file by the extension of its name, else by how its bytes start. JSON without a telling extension is glTF where
    /// it has an `asset`, which every glTF file must have and no native one may.
    pub fn of(path: &Path, bytes: &[u8]) -> Option<Format> {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "xml" => return Some(Format::Mitsuba),
            "gltf" | "glb" => return Some(Format::Gltf),
            "pbrt" => return Some(Format::Pbrt),
            _ => {}
        }
        if bytes.starts_with(gltf::MAGIC) {
            return Some(Format::Gltf);
        }
        match bytes.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'<') => Some(Format::Mitsuba),
            Some(b'{') if extension != "json" && is_gltf(bytes) => Some(Format::Gltf),
            _ if extension == "json" => Some(if is_gltf(bytes) { Format::Gltf } else { Format::Native }),
            Some(b'{') => Some(Format::Native),
            _ => None,
        }
    }
}

fn is_gltf(json: &[u8]) -> bool {
    #[derive(serde::Deserialize)]
    struct Telling {
        asset: Option<serde::de::IgnoredAny>,
    }
    serde_json::from_slice::<Telling>(json).is_ok_and(|telling| telling.asset.is_some())
}

/// Loads the scene in `path`, of any [`Format`].
///
/// # Errors
/// The file cannot be read, is of no known format, or is faulty.
pub fn load(path: impl AsRef<Path>) -> Result<Loaded, Error> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let bytes = read_bounded(path, &file)?;
    let Some(format) = Format::of(path, &bytes) else {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        return Err(Error::new(ErrorKind::Unsupported, &file, "", format!("the extension {extension:?}"), FORMATS));
    };
    // An empty parent means the current folder.
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => Path::new(".").to_path_buf(),
    };
    let folder = DirectoryAssets::new(folder);
    let Imported { description, made, report } = read(format, bytes, &file, &folder)?;
    Ok(Loaded { description, assets: SceneAssets::new(folder, made), report })
}

/// Reads a scene of a known format from the bytes of its file; `file` is the name that errors carry, `assets` are the files beside it.
///
/// # Errors
/// The scene, or a file that it is made of, is faulty.
pub fn read(format: Format, bytes: Vec<u8>, file: &str, assets: &dyn Assets) -> Result<Imported, Error> {
    match format {
        Format::Gltf => gltf::import(&bytes, file, assets),
        Format::Mitsuba => mitsuba::import(&text(bytes, file)?, file, assets),
        Format::Pbrt => pbrt::import(&text(bytes, file)?, file, assets),
        Format::Native => {
            let description = SceneDescription::from_json(&text(bytes, file)?, file)?;
            Ok(Imported { description, made: MadeAssets::new(), report: Vec::new() })
        }
    }
}

fn text(bytes: Vec<u8>, file: &str) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(|fault| {
        let valid = fault.utf8_error().valid_up_to();
        Error::new(ErrorKind::Malformed, file, "", format!("bytes that are not UTF-8 after byte {valid}"), "text in UTF-8")
    })
}

const FORMATS: &str = "a native scene (.json), Mitsuba (.xml), glTF (.gltf, .glb) or pbrt (.pbrt)";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_name_and_else_by_content() {
        let of = |name: &str, bytes: &[u8]| Format::of(Path::new(name), bytes);
        assert_eq!(of("a.PBRT", b""), Some(Format::Pbrt));
        assert_eq!(of("a.glb", b""), Some(Format::Gltf));
        assert_eq!(of("a", b"glTF\x02"), Some(Format::Gltf));
        assert_eq!(of("a.json", b"{\"asset\": {\"version\": \"2.0\"}}"), Some(Format::Gltf));
        assert_eq!(of("a.json", b"nonsense"), Some(Format::Native));
        assert_eq!(of("a.scene", b" {\"version\": 1}"), Some(Format::Native));
        assert_eq!(of("a.scene", b"\n<scene/>"), Some(Format::Mitsuba));
        assert_eq!(of("a.obj", b"v 0 0 0"), None);
    }
}
