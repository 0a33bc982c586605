//! Reading a scene from disk, in any format that this renderer knows, by the file's extension.

use std::path::Path;

use super::assets::{DirectoryAssets, MadeAssets, SceneAssets, read_bounded};
use super::description::SceneDescription;
use super::error::{Error, ErrorKind};
use super::import::mitsuba;

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

/// Loads the scene in `path`: `.json` is the native description, `.xml` a Mitsuba scene.
///
/// # Errors
/// The file cannot be read, is of no known format, or is faulty.
pub fn load(path: impl AsRef<Path>) -> Result<Loaded, Error> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
    if !["json", "xml"].contains(&extension.as_str()) {
        return Err(Error::new(ErrorKind::Unsupported, &file, "", format!("the extension {extension:?}"), FORMATS));
    }
    let bytes = read_bounded(path, &file)?;
    let text = String::from_utf8(bytes).map_err(|fault| {
        let valid = fault.utf8_error().valid_up_to();
        Error::new(ErrorKind::Malformed, &file, "", format!("bytes that are not UTF-8 after byte {valid}"), "text in UTF-8")
    })?;
    // An empty parent means the current folder.
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => Path::new(".").to_path_buf(),
    };
    let folder = DirectoryAssets::new(folder);
    let (description, made, report) = match extension.as_str() {
        "xml" => {
            let imported = mitsuba::import(&text, &file, &folder)?;
            (imported.description, imported.made, imported.report)
        }
        _ => (SceneDescription::from_json(&text, &file)?, MadeAssets::new(), Vec::new()),
    };
    Ok(Loaded { description, assets: SceneAssets::new(folder, made), report })
}

const FORMATS: &str = "a native scene (.json) or a Mitsuba scene (.xml)";
