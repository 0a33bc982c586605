//! Bytes by content: assets, results and files, each under the digest of what it holds.
//!
//! Content is written once and checked whenever it is read. What nobody names any more is removed when it is old enough (`aged`, and the
//! service's sweep); so whoever is about to name content that is there already makes it young again first.

mod aged;
mod patience;
#[cfg(test)]
mod tests;
mod traffic;
mod uri;

use std::path::Path as FolderPath;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use gradfarm_proto::Digest;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutPayload};
use tokio::sync::RwLock;

pub use traffic::{Counted, Traffic};
pub use uri::{BlobUri, ParseBlobsError};

/// How long content that nobody names is kept, unless said otherwise.
pub const GRACE: Duration = Duration::from_secs(3600);

/// Bytes by content. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
    /// Whether it is worth trying again.
    remote: bool,
    /// How old content must be to be removed.
    grace: Duration,
    /// Held by whoever removes content, shared by those who make it young again.
    removal: Arc<RwLock<()>>,
    traffic: Traffic,
}

/// Why bytes could not be stored or read.
#[derive(Debug, thiserror::Error)]
pub enum BlobError {
    /// There is no such content.
    #[error("blob {0} is not there")]
    Missing(Digest),
    /// The bytes are not what their name says.
    #[error("blob {0} is damaged: its content has digest {1}")]
    Damaged(Digest, Digest),
    /// The storage failed.
    #[error("blob storage: {0}")]
    Storage(#[from] object_store::Error),
    /// The folder cannot be used.
    #[error("blob folder {folder}: {source}")]
    Folder {
        /// Which.
        folder: String,
        /// Why.
        source: std::io::Error,
    },
    /// The storage would be reached without encryption.
    #[error("the blob storage {endpoint} is not on this machine and would be reached without TLS; AWS_ALLOW_HTTP=true allows it")]
    Unencrypted {
        /// Where it is.
        endpoint: String,
    },
}

impl Blobs {
    /// Blobs in a folder, made if it is not there. `durable` waits for the disk.
    ///
    /// # Errors
    /// If the folder cannot be made or opened.
    pub fn in_folder(folder: &FolderPath, durable: bool) -> Result<Self, BlobError> {
        let describe = |source| BlobError::Folder { folder: folder.display().to_string(), source };
        std::fs::create_dir_all(folder).map_err(describe)?;
        // Without being told to, the storage would not wait for the disk.
        let store = object_store::local::LocalFileSystem::new_with_prefix(folder)?.with_fsync(durable);
        Ok(Self::over(Arc::new(store), false))
    }

    /// Blobs that are gone with the process.
    pub fn in_memory() -> Self {
        Self::over(Arc::new(object_store::memory::InMemory::new()), false)
    }

    fn over(store: Arc<dyn ObjectStore>, remote: bool) -> Self {
        Self { store, remote, grace: GRACE, removal: Arc::default(), traffic: Traffic::default() }
    }

    /// What went in and out.
    pub fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    /// The same with another time that unnamed content is kept.
    #[must_use]
    pub fn with_grace(self, grace: Duration) -> Self {
        Self { grace, ..self }
    }

    /// Stores bytes under their digest. If they are there already, they are only made young.
    ///
    /// # Errors
    /// If the storage fails.
    pub async fn put(&self, bytes: Bytes) -> Result<Digest, BlobError> {
        let digest = Digest::of(&bytes);
        self.traffic.wrote(bytes.len());
        while !self.create(digest, &bytes).await? {
            if self.refresh(digest, Some(&bytes)).await? {
                break;
            }
            // It was removed in between.
        }
        Ok(digest)
    }

    /// Writes bytes unless they are there; whether they were not.
    async fn create(&self, digest: Digest, bytes: &Bytes) -> Result<bool, BlobError> {
        let payload = || PutPayload::from_bytes(bytes.clone());
        let key = key(digest);
        match self.patiently(|| self.store.put_opts(&key, payload(), PutMode::Create.into())).await {
            Ok(_) => Ok(true),
            Err(object_store::Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Reads bytes and checks that they are what their name says.
    ///
    /// # Errors
    /// If they are not there, or damaged.
    pub async fn get(&self, digest: Digest) -> Result<Bytes, BlobError> {
        let key = key(digest);
        let read = || async { self.store.get(&key).await?.bytes().await };
        let mut tries = if self.remote { 2 } else { 1 };
        loop {
            let bytes = match self.patiently(read).await {
                Ok(bytes) => bytes,
                Err(object_store::Error::NotFound { .. }) => return Err(BlobError::Missing(digest)),
                Err(error) => return Err(error.into()),
            };
            tries -= 1;
            self.traffic.read(bytes.len());
            match Digest::of(&bytes) {
                found if found == digest => return Ok(bytes),
                found if tries == 0 => return Err(BlobError::Damaged(digest, found)),
                // It may have been damaged on the way.
                _ => {}
            }
        }
    }

    /// Whether there is such content. If so, it stays for a while, whether it is named or not.
    ///
    /// # Errors
    /// If the storage fails.
    pub async fn has(&self, digest: Digest) -> Result<bool, BlobError> {
        self.refresh(digest, None).await
    }
}

/// Two levels, so that no folder grows too long.
fn key(digest: Digest) -> Path {
    let text = digest.to_string();
    Path::from(format!("{}/{}", &text[..2], &text[2..]))
}

/// The digest that a key stands for; nothing else is ever looked at.
fn digest(key: &Path) -> Option<Digest> {
    let (folder, rest) = key.as_ref().split_once('/')?;
    format!("{folder}{rest}").parse().ok().filter(|digest| self::key(*digest) == *key)
}
