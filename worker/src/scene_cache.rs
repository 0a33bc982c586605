//! Compiled scenes, kept between units: by the digest of their manifests, the least recently used going first.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use gradfarm_core::scene::{self, Assets, Scene, SceneDescription};
use gradfarm_proto::{Digest, Manifest};

use crate::asset_cache::AssetCache;

/// Assets that are fetched at the same time.
const FETCHES: usize = 4;

/// A scene that was made ready, and how long that took [s].
pub(crate) struct Prepared {
    pub(crate) scene: Arc<Scene>,
    pub(crate) load_seconds: f64,
    pub(crate) compile_seconds: f64,
}

/// The scenes that are ready.
pub(crate) struct SceneCache {
    most: usize,
    /// Least recently used first.
    scenes: Vec<(Digest, Arc<Scene>)>,
}

impl SceneCache {
    /// Keeps at most `most` scenes; units that are being rendered keep theirs alive beyond that.
    pub(crate) fn new(most: usize) -> Self {
        Self { most, scenes: Vec::new() }
    }

    /// A scene, if it is ready.
    pub(crate) fn get(&mut self, manifest: Digest) -> Option<Arc<Scene>> {
        let at = self.scenes.iter().position(|(digest, _)| *digest == manifest)?;
        let entry = self.scenes.remove(at);
        let scene = entry.1.clone();
        self.scenes.push(entry);
        Some(scene)
    }

    /// Adds a scene.
    pub(crate) fn insert(&mut self, manifest: Digest, scene: Arc<Scene>) {
        self.scenes.retain(|(digest, _)| *digest != manifest);
        self.scenes.push((manifest, scene));
        let surplus = self.scenes.len().saturating_sub(self.most);
        self.scenes.drain(..surplus);
    }

    /// Digests of the scenes that are ready.
    pub(crate) fn digests(&self) -> impl Iterator<Item = Digest> {
        self.scenes.iter().map(|(digest, _)| *digest)
    }
}

/// Fetches what a scene consists of and compiles it.
///
/// # Errors
/// If a part is missing or wrong, in words.
pub(crate) async fn prepare(manifest: Digest, assets: &AssetCache) -> Result<Prepared, String> {
    let start = Instant::now();
    let parts = Manifest::decode(assets.get(manifest).await?).map_err(|error| error.to_string())?;
    let description = assets.get(parts.description).await?;
    let fetches = parts.assets.into_iter().map(|(name, digest)| async move { Ok::<_, String>((name, assets.get(digest).await?)) });
    let files: BTreeMap<String, Bytes> = stream::iter(fetches).buffer_unordered(FETCHES).try_collect().await?;
    let load_seconds = start.elapsed().as_secs_f64();
    let compiling = tokio::task::spawn_blocking(move || {
        let start = Instant::now();
        let text = std::str::from_utf8(&description).map_err(|error| format!("the description is no UTF-8 text: {error}"))?;
        let description = SceneDescription::from_json(text, "scene").map_err(|error| error.to_string())?;
        let scene = Scene::compile(&description, &Files(files)).map_err(|error| error.to_string())?;
        Ok::<_, String>((Arc::new(scene), start.elapsed().as_secs_f64()))
    });
    let (scene, compile_seconds) = compiling.await.map_err(|error| format!("compiling the scene broke off: {error}"))??;
    Ok(Prepared { scene, load_seconds, compile_seconds })
}

/// Files of a scene in memory.
struct Files(BTreeMap<String, Bytes>);

impl Assets for Files {
    fn open(&self, name: &str) -> Result<Vec<u8>, scene::Error> {
        let missing = || scene::Error::new(scene::ErrorKind::Unreadable, name, "", "no such file in the scene's manifest", "the file");
        self.0.get(name).map(|bytes| bytes.to_vec()).ok_or_else(missing)
    }
}
