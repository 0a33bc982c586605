//! Removes content that nobody names any more, and jobs that were over for long.
//!
//! Order matters. First everything old is listed, then what is named is gathered, then the rest of the list is removed. Content that is
//! named later was young, or was made young, when it was last asked for; removal looks at its age once more.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use gradfarm_proto::{Digest, Manifest};
use tokio::sync::mpsc;
use tokio::time::MissedTickBehavior;

use super::command::Command;
use super::dispatch::{Dispatcher, Turn};
use crate::error::Error;
use crate::job::{self, Change, JobId};
use crate::store::{BlobError, Blobs, Singleton, Store};

/// Longest time between two sweeps.
const EVERY: Duration = Duration::from_secs(600);
/// Most jobs that are forgotten in one turn of the loop.
const FORGOTTEN: usize = 64;

/// What a sweep did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Swept {
    /// Contents that were there before.
    pub(super) found: u64,
    /// Contents that were removed.
    pub(super) removed: u64,
    /// What that freed [bytes].
    pub(super) bytes: u64,
}

/// Sweeps now and then until the service is gone.
pub(super) struct Sweeper {
    pub(super) store: Arc<dyn Store>,
    pub(super) blobs: Blobs,
    /// Weak, so that sweeping does not keep a stopped service alive.
    pub(super) commands: mpsc::WeakSender<Command>,
    /// How long content that nobody names is kept.
    pub(super) grace: Duration,
    /// How long jobs are kept that are over.
    pub(super) keep_jobs: Option<Duration>,
}

impl Sweeper {
    /// Works until the loop is gone.
    pub(super) async fn run(self) {
        let mut tick = tokio::time::interval((self.grace / 4).clamp(Duration::from_millis(100), EVERY));
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut manifests = BTreeMap::new();
        loop {
            tick.tick().await;
            let Some(commands) = self.commands.upgrade() else { return };
            if let Some(keep) = self.keep_jobs {
                let forget = Command::Forget { keep };
                if commands.send(forget).await.is_err() {
                    return;
                }
            }
            drop(commands);
            match self.alone(&mut manifests).await {
                Ok(Some(Swept { found, removed, bytes })) if removed > 0 => tracing::info!(found, removed, bytes, "unnamed blobs removed"),
                Ok(_) => {}
                Err(error) => tracing::warn!(%error, "blobs not swept"),
            }
        }
    }

    /// Sweeps, unless somebody else does.
    async fn alone(&self, manifests: &mut BTreeMap<Digest, Vec<Digest>>) -> Result<Option<Swept>, Error> {
        let Some(_alone) = self.store.alone(Singleton::Sweep).await? else { return Ok(None) };
        sweep(self.store.as_ref(), &self.blobs, manifests).await.map(Some)
    }
}

/// Sweeps once. `manifests` remembers what scenes consist of.
pub(super) async fn sweep(store: &dyn Store, blobs: &Blobs, manifests: &mut BTreeMap<Digest, Vec<Digest>>) -> Result<Swept, Error> {
    let stock = blobs.stock().await?;
    let mut swept = Swept { found: stock.count, ..Swept::default() };
    if stock.aged.is_empty() {
        return Ok(swept);
    }
    let named = named(store, blobs, manifests).await?;
    for digest in stock.aged {
        if !named.contains(&digest)
            && let Some(bytes) = blobs.remove(digest).await?
        {
            swept.removed += 1;
            swept.bytes += bytes;
        }
    }
    Ok(swept)
}

/// Everything that a job names, directly or through its scene's manifest.
async fn named(store: &dyn Store, blobs: &Blobs, manifests: &mut BTreeMap<Digest, Vec<Digest>>) -> Result<BTreeSet<Digest>, Error> {
    let mut named: BTreeSet<Digest> = store.files().await?.into_iter().collect();
    let mut scenes = BTreeMap::new();
    for stored in store.jobs().await? {
        named.extend(job::named(&stored)?);
        let scene = stored.record.scene;
        let parts = match manifests.remove(&scene).or_else(|| scenes.remove(&scene)) {
            Some(parts) => parts,
            None => parts(blobs, scene).await?,
        };
        named.extend(parts.iter().copied().chain([scene]));
        scenes.insert(scene, parts);
    }
    *manifests = scenes;
    Ok(named)
}

/// What a scene consists of. A manifest that is lost names nothing; one that cannot be read stops the sweep.
async fn parts(blobs: &Blobs, scene: Digest) -> Result<Vec<Digest>, Error> {
    let bytes = match blobs.get(scene).await {
        Ok(bytes) => bytes,
        Err(BlobError::Missing(_)) => return Ok(Vec::new()),
        Err(error) => return Err(error.into()),
    };
    let Manifest { description, assets } = Manifest::decode(bytes).map_err(|error| Error::Io {
        what: format!("manifest {scene}"),
        source: std::io::Error::new(std::io::ErrorKind::InvalidData, error),
    })?;
    Ok(assets.into_values().chain([description]).collect())
}

impl Dispatcher {
    /// Forgets jobs that were over for longer than this, the oldest first, a few at a time.
    pub(super) fn forget(&mut self, keep: Duration, turn: &mut Turn) {
        let now = self.clock.now();
        let old = |job: &&job::Job| job.state.is_final() && job.finished.is_some_and(|finished| finished + keep <= now);
        let old: Vec<JobId> = self.jobs.values().filter(old).map(|job| job.record.id).take(FORGOTTEN).collect();
        for id in old {
            tracing::info!(job = %id, "job forgotten");
            turn.changes.push(Change::Forgotten { job: id });
            if let Some(token) = self.jobs.remove(&id).and_then(|job| job.record.client_token) {
                self.tokens.remove(&token);
            }
            self.watchers.remove(&id);
        }
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::job::tests::record;
    use crate::job::{DeliveredRecord, FileKind, FileRecord, Frame, FrameState, JobState, Timestamp, WorkerId};
    use crate::store::Memory;

    /// A store, and blobs of which everything is old at once.
    struct Farm {
        store: Memory,
        blobs: Blobs,
        manifests: BTreeMap<Digest, Vec<Digest>>,
    }

    impl Farm {
        async fn put(&self, content: &'static str) -> Digest {
            self.blobs.put(Bytes::from_static(content.as_bytes())).await.unwrap()
        }

        /// What is left after a sweep, once everything has become old.
        async fn left(&mut self) -> BTreeSet<Digest> {
            let all = self.blobs.all().await.unwrap().len();
            while self.blobs.stock().await.unwrap().aged.len() < all {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
            sweep(&self.store, &self.blobs, &mut self.manifests).await.unwrap();
            self.blobs.all().await.unwrap().into_iter().collect()
        }
    }

    #[tokio::test]
    async fn content_goes_when_nobody_names_it_any_more() {
        let blobs = Blobs::in_memory().with_grace(Duration::ZERO);
        let mut farm = Farm { store: Memory::new(), blobs, manifests: BTreeMap::new() };
        let [asset, description, block, png] =
            [farm.put("asset").await, farm.put("description").await, farm.put("block").await, farm.put("png").await];
        let manifest = Manifest { description, assets: [("a.obj".to_owned(), asset)].into() };
        let scene = farm.blobs.put(manifest.encode()).await.unwrap();
        farm.put("nobody's").await;
        let record = job::JobRecord { scene, ..record("swept") };
        let (id, worker) = (record.id, WorkerId::fresh());
        let result = DeliveredRecord { content: block, blob: block, size: 5, load: 0.0, compile: 0.0, render: 0.0 };
        let changes = [
            Change::Submitted(Box::new(record)),
            Change::Leased { job: id, unit: 0, epoch: 1, worker, at: Timestamp::from_millis(0) },
            Change::Delivered { job: id, unit: 0, epoch: 1, worker, result },
            Change::File { job: id, position: 0, file: FileRecord { kind: FileKind::Png, blob: png, size: 3 } },
        ];
        farm.store.commit(&changes).await.unwrap();
        assert_eq!(farm.left().await, [asset, description, block, png, scene].into());
        let done = Frame { state: FrameState::Done, ..Frame::waiting(20) };
        farm.store.commit(&[Change::Frame { job: id, position: 0, frame: Box::new(done) }]).await.unwrap();
        assert_eq!(farm.left().await, [asset, description, png, scene].into(), "the frame's files are there: its results go");
        let over = Change::Job { job: id, state: JobState::Done, error: None, started: None, finished: None };
        farm.store.commit(&[over]).await.unwrap();
        assert_eq!(farm.left().await, [asset, description, png, scene].into(), "what is over is kept");
        farm.store.commit(&[Change::Forgotten { job: id }]).await.unwrap();
        assert_eq!(farm.left().await, [].into());
    }

    #[tokio::test]
    async fn nothing_is_removed_while_a_manifest_cannot_be_read() {
        let blobs = Blobs::in_memory().with_grace(Duration::ZERO);
        let mut farm = Farm { store: Memory::new(), blobs, manifests: BTreeMap::new() };
        let scene = farm.put("no manifest").await;
        let unnamed = farm.put("nobody's").await;
        farm.store.commit(&[Change::Submitted(Box::new(job::JobRecord { scene, ..record("odd") }))]).await.unwrap();
        while farm.blobs.stock().await.unwrap().aged.is_empty() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        assert!(sweep(&farm.store, &farm.blobs, &mut farm.manifests).await.is_err());
        assert!(farm.blobs.has(unnamed).await.unwrap());
    }
}
