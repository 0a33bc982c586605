//! Bytes by content: assets, results and files, each under the digest of what it holds.

use std::path::Path as FolderPath;
use std::sync::Arc;

use bytes::Bytes;
use gradfarm_proto::Digest;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutPayload};

/// Bytes by content. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
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
}

impl Blobs {
    /// Blobs in a folder, made if it is not there. `durable` waits for the disk.
    ///
    /// # Errors
    /// If the folder cannot be made or opened.
    pub fn in_folder(folder: &FolderPath, durable: bool) -> Result<Self, BlobError> {
        let describe = |source| BlobError::Folder { folder: folder.display().to_string(), source };
        std::fs::create_dir_all(folder).map_err(describe)?;
        let store = object_store::local::LocalFileSystem::new_with_prefix(folder)?.with_fsync(durable);
        Ok(Self { store: Arc::new(store) })
    }

    /// Blobs that are gone with the process.
    pub fn in_memory() -> Self {
        Self { store: Arc::new(object_store::memory::InMemory::new()) }
    }

    /// Stores bytes under their digest. If they are there already, nothing changes.
    ///
    /// # Errors
    /// If the storage fails.
    pub async fn put(&self, bytes: Bytes) -> Result<Digest, BlobError> {
        let digest = Digest::of(&bytes);
        match self.store.put_opts(&key(digest), PutPayload::from_bytes(bytes), PutMode::Create.into()).await {
            Ok(_) | Err(object_store::Error::AlreadyExists { .. }) => Ok(digest),
            Err(error) => Err(error.into()),
        }
    }

    /// Reads bytes and checks that they are what their name says.
    ///
    /// # Errors
    /// If they are not there, or damaged.
    pub async fn get(&self, digest: Digest) -> Result<Bytes, BlobError> {
        let bytes = match self.store.get(&key(digest)).await {
            Ok(found) => found.bytes().await?,
            Err(object_store::Error::NotFound { .. }) => return Err(BlobError::Missing(digest)),
            Err(error) => return Err(error.into()),
        };
        let found = Digest::of(&bytes);
        if found == digest { Ok(bytes) } else { Err(BlobError::Damaged(digest, found)) }
    }

    /// Whether there is such content.
    ///
    /// # Errors
    /// If the storage fails.
    pub async fn has(&self, digest: Digest) -> Result<bool, BlobError> {
        match self.store.head(&key(digest)).await {
            Ok(_) => Ok(true),
            Err(object_store::Error::NotFound { .. }) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }
}

/// Two levels, so that no folder grows too long.
fn key(digest: Digest) -> Path {
    let text = digest.to_string();
    Path::from(format!("{}/{}", &text[..2], &text[2..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn content_is_kept_once_and_checked() {
        let folder = tempfile::tempdir().unwrap();
        for blobs in [Blobs::in_memory(), Blobs::in_folder(folder.path(), true).unwrap()] {
            let content = Bytes::from_static(b"a tile");
            let digest = blobs.put(content.clone()).await.unwrap();
            assert_eq!(blobs.put(content.clone()).await.unwrap(), digest);
            assert_eq!(blobs.get(digest).await.unwrap(), content);
            assert!(blobs.has(digest).await.unwrap());
            let other = Digest::of(b"another tile");
            assert!(!blobs.has(other).await.unwrap());
            assert!(matches!(blobs.get(other).await, Err(BlobError::Missing(_))));
        }
    }

    #[tokio::test]
    async fn damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let blobs = Blobs::in_folder(folder.path(), false).unwrap();
        let digest = blobs.put(Bytes::from_static(b"a tile")).await.unwrap();
        let text = digest.to_string();
        std::fs::write(folder.path().join(&text[..2]).join(&text[2..]), b"a bug!").unwrap();
        assert!(matches!(blobs.get(digest).await, Err(BlobError::Damaged(d, _)) if d == digest));
    }
}
