//! Content that has been there for long: what may be removed if nobody names it, and how it becomes young again.
//!
//! Content is old when it was last written longer ago than the grace. Whoever is about to name content that is there already writes it
//! again if it is past half of that, so that it cannot be removed before its name is stored. Within a process a lock keeps the two apart.
//! Between processes, who wrote content that was old enough to be removed looks again after a moment, and writes it once more if it is gone.

use std::time::Duration;

use bytes::Bytes;
use futures::TryStreamExt;
use gradfarm_proto::Digest;
use object_store::{ObjectMeta, ObjectStore, ObjectStoreExt, PutPayload};

use super::{BlobError, Blobs, digest, key};
use crate::clock::Clock;

/// How long after the last look at content another process may still remove it.
const SETTLE: Duration = Duration::from_secs(2);

/// What there is of blobs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stock {
    /// How many there are.
    pub count: u64,
    /// Their sizes together [bytes].
    pub bytes: u64,
    /// Those that are older than the grace.
    pub aged: Vec<Digest>,
}

impl Blobs {
    /// Everything that is there.
    ///
    /// # Errors
    /// If the storage cannot be listed.
    pub async fn all(&self) -> Result<Vec<Digest>, BlobError> {
        let found = self.store.list(None).try_filter_map(|meta| std::future::ready(Ok(digest(&meta.location))));
        Ok(found.try_collect().await?)
    }

    /// How much is there, and what of it is old.
    ///
    /// # Errors
    /// If the storage cannot be listed.
    pub async fn stock(&self) -> Result<Stock, BlobError> {
        let mut stock = Stock::default();
        let mut all = self.store.list(None);
        while let Some(meta) = all.try_next().await? {
            let Some(digest) = digest(&meta.location) else { continue };
            stock.count += 1;
            stock.bytes += meta.size;
            if age(&meta) > self.grace {
                stock.aged.push(digest);
            }
        }
        self.traffic.stocked(stock.count, stock.bytes);
        Ok(stock)
    }

    /// Removes content that nobody names, if it is still old; how many bytes that freed.
    ///
    /// # Errors
    /// If the storage fails.
    pub async fn remove(&self, unnamed: Digest) -> Result<Option<u64>, BlobError> {
        let key = key(unnamed);
        let _alone = self.removal.write().await;
        let meta = match self.store.head(&key).await {
            Ok(meta) => meta,
            Err(object_store::Error::NotFound { .. }) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        if age(&meta) <= self.grace {
            return Ok(None);
        }
        match tokio::time::timeout(SETTLE / 2, self.store.delete(&key)).await {
            Ok(Ok(())) => Ok(Some(meta.size)),
            Ok(Err(object_store::Error::NotFound { .. })) | Err(_) => Ok(None),
            Ok(Err(error)) => Err(error.into()),
        }
    }

    /// Makes content young, if it is there: whether it is. `known` saves reading it.
    pub(super) async fn refresh(&self, digest: Digest, known: Option<&Bytes>) -> Result<bool, BlobError> {
        let key = key(digest);
        let _together = self.removal.read().await;
        let meta = match self.patiently(|| self.store.head(&key)).await {
            Ok(meta) => meta,
            Err(object_store::Error::NotFound { .. }) => return Ok(false),
            Err(error) => return Err(error.into()),
        };
        let age = age(&meta);
        if age <= self.grace / 2 {
            return Ok(true);
        }
        let bytes = match known {
            Some(bytes) => bytes.clone(),
            None => match self.get(digest).await {
                Ok(bytes) => bytes,
                Err(BlobError::Missing(_)) => return Ok(false),
                Err(error) => return Err(error),
            },
        };
        let write = || self.store.put(&key, PutPayload::from_bytes(bytes.clone()));
        self.patiently(write).await?;
        if self.remote && age > self.grace {
            tokio::time::sleep(SETTLE).await;
            if let Err(object_store::Error::NotFound { .. }) = self.patiently(|| self.store.head(&key)).await {
                self.patiently(write).await?;
            }
        }
        Ok(true)
    }
}

/// How long ago content was written, by this machine's clock; zero if that is in the future.
fn age(meta: &ObjectMeta) -> Duration {
    let millis = Clock::new().now().millis().saturating_sub(meta.last_modified.timestamp_millis());
    Duration::from_millis(u64::try_from(millis).unwrap_or(0))
}
