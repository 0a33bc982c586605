//! Compiled scenes, kept between units: what is seen of a scene at a moment, the least recently used going first. Where a scene moves, what
//! its moments share is kept with it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use gradfarm_core::lattice::Moment;
use gradfarm_core::plan::Plan;
use gradfarm_core::scene::{self, Assets, Exposure, SceneDescription, Stage};
use gradfarm_proto::{Digest, Manifest};
use tokio::sync::OnceCell;

use crate::asset_cache::AssetCache;

/// Assets that are fetched at the same time.
const FETCHES: usize = 4;
/// Moments of one scene that are kept: units come in the order of time, so what is needed are the one at hand, the one before, the next one.
const MOMENTS: usize = 3;

/// What units are rendered from: a scene and, where it moves, a moment of it as a plan exposes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Sight {
    pub(crate) manifest: Digest,
    moment: Option<Seen>,
}

/// What the scenes of a moment depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Seen {
    moment: Moment,
    /// Frames per second, share of the open shutter: bits, for they are compared and nothing else.
    timeline: (u64, u64, u32),
    seed: u64,
    follows: bool,
}

impl Sight {
    pub(crate) fn new(manifest: Digest, plan: &Plan, moment: Moment) -> Self {
        let seen = |timeline: gradfarm_core::plan::Timeline| Seen {
            moment,
            timeline: (timeline.fps.to_bits(), timeline.shutter.to_bits(), timeline.instants),
            seed: plan.seed,
            follows: plan.temporal.is_some_and(|temporal| temporal.motion),
        };
        Self { manifest, moment: plan.timeline.map(seen) }
    }
}

/// A description with its files, made once and then shared by all that wait for it.
pub(crate) type SharedStage = Arc<OnceCell<Arc<Stage>>>;

/// A moment that was made ready, and how long that took [s].
pub(crate) struct Prepared {
    pub(crate) exposure: Arc<Exposure>,
    pub(crate) load_seconds: f64,
    pub(crate) compile_seconds: f64,
}

/// The moments that are ready, and the scenes that more of them can be made of.
pub(crate) struct SceneCache {
    most: usize,
    /// Least recently used first.
    exposures: Vec<(Sight, Arc<Exposure>)>,
    /// Least recently used first.
    stages: Vec<(Digest, SharedStage)>,
}

impl SceneCache {
    /// Keeps at most `most` scenes; units that are being rendered keep theirs alive beyond that.
    pub(crate) fn new(most: usize) -> Self {
        Self { most, exposures: Vec::new(), stages: Vec::new() }
    }

    /// What is seen of a scene, if it is ready.
    pub(crate) fn get(&mut self, sight: &Sight) -> Option<Arc<Exposure>> {
        let at = self.exposures.iter().position(|(other, _)| other == sight)?;
        let entry = self.exposures.remove(at);
        let exposure = entry.1.clone();
        self.exposures.push(entry);
        Some(exposure)
    }

    /// The stage of a scene, there or not.
    pub(crate) fn stage(&mut self, manifest: Digest) -> SharedStage {
        let known = self.stages.iter().position(|(digest, _)| *digest == manifest).map(|at| self.stages.remove(at).1);
        let stage = known.unwrap_or_default();
        self.stages.push((manifest, stage.clone()));
        let surplus = self.stages.len().saturating_sub(self.most);
        self.stages.drain(..surplus);
        stage
    }

    /// Adds what is seen of a scene. The files of one that rests are not needed any more.
    pub(crate) fn insert(&mut self, sight: Sight, exposure: Arc<Exposure>) {
        if sight.moment.is_none() {
            self.stages.retain(|(digest, _)| *digest != sight.manifest);
        }
        self.exposures.retain(|(other, _)| *other != sight);
        self.exposures.push((sight, exposure));
        let mut moments: BTreeMap<Digest, usize> = BTreeMap::new();
        let most = self.most;
        // From the last used one back.
        let mut keeps: Vec<bool> = Vec::with_capacity(self.exposures.len());
        for (sight, _) in self.exposures.iter().rev() {
            let is_one_more = !moments.contains_key(&sight.manifest) && moments.len() >= most;
            let of_scene = moments.get(&sight.manifest).copied().unwrap_or(0);
            keeps.push(!is_one_more && of_scene < MOMENTS);
            if keeps.last() == Some(&true) {
                moments.insert(sight.manifest, of_scene + 1);
            }
        }
        let mut keeps = keeps.into_iter().rev();
        self.exposures.retain(|_| keeps.next() == Some(true));
    }

    /// Digests of the scenes that are ready.
    pub(crate) fn digests(&self) -> impl Iterator<Item = Digest> {
        self.exposures.iter().map(|(sight, _)| sight.manifest).collect::<BTreeSet<_>>().into_iter()
    }
}

/// Fetches what a scene consists of, unless it is there, and compiles what a moment sees of it.
///
/// # Errors
/// If a part is missing or wrong, in words.
pub(crate) async fn prepare(
    sight: Sight,
    plan: Arc<Plan>,
    moment: Moment,
    stage: &SharedStage,
    assets: &AssetCache,
) -> Result<Prepared, String> {
    let start = Instant::now();
    let stage = stage.get_or_try_init(|| fetch(sight.manifest, assets)).await?.clone();
    let load_seconds = start.elapsed().as_secs_f64();
    let compiling = tokio::task::spawn_blocking(move || {
        let start = Instant::now();
        let exposure = plan.exposure(&stage, moment).map_err(|error| error.to_string())?;
        Ok::<_, String>((Arc::new(exposure), start.elapsed().as_secs_f64()))
    });
    let (exposure, compile_seconds) = compiling.await.map_err(|error| format!("compiling the scene broke off: {error}"))??;
    Ok(Prepared { exposure, load_seconds, compile_seconds })
}

async fn fetch(manifest: Digest, assets: &AssetCache) -> Result<Arc<Stage>, String> {
    let parts = Manifest::decode(assets.get(manifest).await?).map_err(|error| error.to_string())?;
    let description = assets.get(parts.description).await?;
    let fetches = parts.assets.into_iter().map(|(name, digest)| async move { Ok::<_, String>((name, assets.get(digest).await?)) });
    let files: BTreeMap<String, Bytes> = stream::iter(fetches).buffer_unordered(FETCHES).try_collect().await?;
    let reading = tokio::task::spawn_blocking(move || {
        let text = std::str::from_utf8(&description).map_err(|error| format!("the description is no UTF-8 text: {error}"))?;
        let description = SceneDescription::from_json(text, "scene").map_err(|error| error.to_string())?;
        Stage::new(description, Arc::new(Files(files))).map(Arc::new).map_err(|error| error.to_string())
    });
    reading.await.map_err(|error| format!("reading the scene broke off: {error}"))?
}

/// Files of a scene in memory.
struct Files(BTreeMap<String, Bytes>);

impl Assets for Files {
    fn open(&self, name: &str) -> Result<Vec<u8>, scene::Error> {
        let missing = || scene::Error::new(scene::ErrorKind::Unreadable, name, "", "no such file in the scene's manifest", "the file");
        self.0.get(name).map(|bytes| bytes.to_vec()).ok_or_else(missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradfarm_core::scene::{NoAssets, Scene};

    #[test]
    fn a_few_moments_of_a_few_scenes_are_kept() {
        let json = r#"{"version": 1, "camera": {"perspective": {"fov": 40}}}"#;
        let scene = Scene::compile(&SceneDescription::from_json(json, "scene").unwrap(), &NoAssets).unwrap();
        let exposure = Arc::new(Exposure::still(Arc::new(scene)));
        let sight = |name: &str, frame: Option<u32>| Sight {
            manifest: Digest::of(name.as_bytes()),
            moment: frame.map(|frame| Seen { moment: Moment::of(frame), timeline: (0, 0, 1), seed: 1, follows: false }),
        };
        let mut cache = SceneCache::new(2);
        for frame in 0..5 {
            cache.insert(sight("moving", Some(frame)), exposure.clone());
        }
        cache.insert(sight("resting", None), exposure.clone());
        let kept = |cache: &mut SceneCache| (0..5).filter(|frame| cache.get(&sight("moving", Some(*frame))).is_some()).collect::<Vec<_>>();
        assert_eq!(kept(&mut cache), [2, 3, 4]);
        cache.insert(sight("third", None), exposure);
        assert_eq!(cache.digests().count(), 2);
        assert!(cache.get(&sight("resting", None)).is_none(), "the moving one was used last");
        assert_eq!(kept(&mut cache), [2, 3, 4]);
    }
}
