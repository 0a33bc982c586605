//! Scenes of other formats in a submission: read from the files that came with them, and only from these.

use std::collections::BTreeMap;

use axum::body::Bytes;
use gradfarm_core::scene::read::{self, Format};
use gradfarm_core::scene::{self, Assets, SceneDescription};
use gradfarm_proto::Digest;

use super::problem::Problem;
use crate::service::Handle;

/// The files of a submission, by name.
struct Uploaded(BTreeMap<String, Bytes>);

impl Assets for Uploaded {
    fn open(&self, name: &str) -> Result<Vec<u8>, scene::Error> {
        let absent = || scene::Error::new(scene::ErrorKind::Unreadable, name, "", "no such file in the submission", "the file, sent along");
        self.0.get(name).map(|bytes| bytes.to_vec()).ok_or_else(absent)
    }
}

/// Imports a scene; files that the importer makes are stored and join `assets`. Returns the description, also as text.
///
/// # Errors
/// What is wrong with the scene or a file of it, or with storing what was made.
pub(super) async fn import(
    format: Format,
    file: &str,
    bytes: Bytes,
    assets: &mut BTreeMap<String, Digest>,
    service: &Handle,
) -> Result<(SceneDescription, String), Problem> {
    let mut files = BTreeMap::new();
    for (name, digest) in assets.iter() {
        files.insert(name.clone(), service.get_blob(*digest).await?);
    }
    let name = file.to_owned();
    let read = tokio::task::spawn_blocking(move || read::read(format, bytes.to_vec(), &name, &Uploaded(files)));
    let imported = read.await.map_err(|fault| Problem::internal(&fault))??;
    for remark in &imported.report {
        tracing::info!(file, %remark, "importing");
    }
    for (name, made) in imported.made {
        assets.insert(name, service.put_asset(made.into()).await?);
    }
    let text = imported.description.to_json();
    Ok((imported.description, text))
}
