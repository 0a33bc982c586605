//! Reads the scene that a command names and the files beside it, and passes the importer's remarks on.

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

/// What to call a job that renders this scene.
pub(super) fn job_name(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
