//! Reads the scene that a command names and the files beside it, and passes the importer's remarks on.

use std::ffi::OsStr;
use std::path::Path;

use bytes::Bytes;
use gradfarm_core::scene::{self, Assets, Loaded, SceneAssets};

use super::error::Error;
use super::terminal;

/// Reads a scene of any supported format. What an importer could not carry over exactly is told on standard error.
///
/// # Errors
/// [`Error::Scene`], naming file and place.
pub(super) fn read(path: &Path) -> Result<Loaded, Error> {
    let loaded = scene::load(path)?;
    for remark in &loaded.report {
        terminal::warn(remark);
    }
    Ok(loaded)
}

/// Reads one of the files that the scene refers to.
///
/// # Errors
/// [`Error::Scene`], naming the file.
pub(super) async fn read_asset(assets: &SceneAssets, name: &str) -> Result<Bytes, Error> {
    let (assets, name) = (assets.clone(), name.to_owned());
    let read = tokio::task::spawn_blocking(move || assets.open(&name)).await;
    Ok(read.map_err(|fault| Error::Failed(fault.to_string()))??.into())
}

/// What to call a job that renders this scene: the file's name, or its folder's where all files are called alike. Hidden folders name nothing.
pub(super) fn job_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let named = |folder: &&OsStr| stem == "scene" && !folder.to_string_lossy().starts_with('.');
    let folder = path.parent().and_then(Path::file_name).filter(named);
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_called_by_what_tells_them_apart() {
        let names = ["hall.json", "a/hall.json", "a/door/scene.xml", "scene.xml", "/scene.xml", "/t/.x/scene.xml"]
            .map(|path| job_name(Path::new(path)));
        assert_eq!(names, ["hall", "hall", "door", "scene", "scene", "scene"]);
    }
}
