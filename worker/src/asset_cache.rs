//! Content by digest: from a folder if it is there, otherwise from the coordinator.
//!
//! Files bear their digests' names, are written beside and renamed, and are checked whenever they are read; so several workers may
//! share one folder, and a damaged file is fetched again.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use bytes::Bytes;
use gradfarm_proto::{Digest, limits, v1};
use tonic::{Code, Status};

use crate::backoff::Backoff;
use crate::dial::Dial;
use crate::metrics::Metrics;

/// Fetches and keeps content.
#[derive(Clone)]
pub(crate) struct AssetCache {
    /// Whom to ask, one after the other.
    dials: Vec<Dial>,
    folder: Option<Arc<Folder>>,
    metrics: Arc<Metrics>,
}

#[derive(Debug)]
struct Folder {
    path: PathBuf,
    most: u64,
}

impl AssetCache {
    /// A cache in `folder` of at most `most` bytes, or none.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub(crate) fn new(dials: Vec<Dial>, folder: Option<PathBuf>, most: u64, metrics: Arc<Metrics>) -> io::Result<Self> {
        if let Some(path) = &folder {
            fs::create_dir_all(path)?;
        }
        Ok(Self { dials, folder: folder.map(|path| Arc::new(Folder { path, most })), metrics })
    }

    /// The content of a digest. Waits for a coordinator that is away.
    ///
    /// # Errors
    /// If the coordinator does not have it, in words.
    pub(crate) async fn get(&self, digest: Digest) -> Result<Bytes, String> {
        if let Some(folder) = self.folder.clone() {
            let found = tokio::task::spawn_blocking(move || folder.read(digest)).await;
            if let Ok(Some(bytes)) = found {
                self.metrics.asset("cache", bytes.len());
                return Ok(bytes);
            }
        }
        let bytes = self.fetch_patiently(digest).await?;
        self.metrics.asset("coordinator", bytes.len());
        if let Some(folder) = self.folder.clone() {
            let copy = bytes.clone();
            let kept = tokio::task::spawn_blocking(move || folder.write(digest, &copy)).await;
            if let Ok(Err(problem)) = kept {
                tracing::warn!(%digest, %problem, "asset not kept");
            }
        }
        Ok(bytes)
    }

    async fn fetch_patiently(&self, digest: Digest) -> Result<Bytes, String> {
        let mut backoff = Backoff::new();
        for dial in self.dials.iter().cycle() {
            match fetch(dial, digest).await {
                Ok(bytes) => return Ok(bytes),
                Err(status) if matches!(status.code(), Code::NotFound | Code::InvalidArgument | Code::OutOfRange) => {
                    return Err(format!("asset {digest}: {}", status.message()));
                }
                Err(status) => tracing::debug!(%digest, problem = %status, "asset not fetched, trying again"),
            }
            tokio::time::sleep(backoff.wait()).await;
        }
        Err(format!("asset {digest}: there is nobody to ask"))
    }
}

async fn fetch(dial: &Dial, digest: Digest) -> Result<Bytes, Status> {
    let request = v1::FetchAssetRequest { digest: digest.to_bytes() };
    let mut chunks = dial.client()?.fetch_asset(request).await?.into_inner();
    let mut bytes = Vec::new();
    while let Some(chunk) = chunks.message().await? {
        if (bytes.len() + chunk.data.len()) as u64 > limits::ASSET {
            return Err(Status::out_of_range(format!("larger than {} bytes", limits::ASSET)));
        }
        bytes.extend_from_slice(&chunk.data);
    }
    let found = Digest::of(&bytes);
    if found == digest { Ok(bytes.into()) } else { Err(Status::data_loss(format!("content arrived with digest {found}"))) }
}

impl Folder {
    fn file(&self, digest: Digest) -> PathBuf {
        self.path.join(digest.to_string())
    }

    fn read(&self, digest: Digest) -> Option<Bytes> {
        let file = self.file(digest);
        let bytes = fs::read(&file).ok()?;
        if Digest::of(&bytes) != digest {
            // Damaged: out of the way. If that fails, the next write replaces it.
            let _kept = fs::remove_file(&file);
            return None;
        }
        // The time of the last use decides what goes first; without it the file merely goes earlier.
        let _untouched = fs::File::open(&file).and_then(|open| open.set_modified(SystemTime::now()));
        Some(bytes.into())
    }

    fn write(&self, digest: Digest, bytes: &[u8]) -> io::Result<()> {
        if bytes.len() as u64 > self.most {
            return Ok(());
        }
        self.make_room(bytes.len() as u64)?;
        let beside = self.path.join(format!("{digest}.{}", uuid::Uuid::now_v7()));
        fs::write(&beside, bytes)?;
        fs::rename(&beside, self.file(digest))
    }

    /// Removes what was not used for longest until `wanted` bytes fit.
    fn make_room(&self, wanted: u64) -> io::Result<()> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            // A file that another worker removed meanwhile takes no room.
            if let Ok(about) = entry.metadata()
                && about.is_file()
                && is_ours(&entry.path())
            {
                files.push((about.modified().unwrap_or(SystemTime::UNIX_EPOCH), about.len(), entry.path()));
            }
        }
        files.sort();
        let mut total: u64 = files.iter().map(|(_, size, _)| size).sum();
        for (_, size, path) in files {
            if total + wanted <= self.most {
                break;
            }
            if fs::remove_file(path).is_ok() {
                total -= size;
            }
        }
        Ok(())
    }
}

/// Whether a file's name begins with a digest: nothing else in the folder is ever removed.
fn is_ours(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.get(..64).is_some_and(|text| text.parse::<Digest>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_keeps_what_was_used_last_and_notices_damage() {
        let place = tempfile::tempdir().unwrap();
        let folder = Folder { path: place.path().to_owned(), most: 250 };
        fs::write(place.path().join("notes.txt"), [0; 500]).unwrap();
        let contents: Vec<Vec<u8>> = (0..3u8).map(|k| vec![k; 100]).collect();
        let digests: Vec<Digest> = contents.iter().map(|bytes| Digest::of(bytes)).collect();
        for k in [0, 1] {
            folder.write(digests[k], &contents[k]).unwrap();
            let old = SystemTime::now() - std::time::Duration::from_secs(100 - k as u64);
            fs::File::open(folder.file(digests[k])).unwrap().set_modified(old).unwrap();
        }
        assert_eq!(folder.read(digests[0]).unwrap(), contents[0]);
        folder.write(digests[2], &contents[2]).unwrap();
        assert!(folder.read(digests[0]).is_some(), "it was used last");
        assert!(folder.read(digests[1]).is_none(), "it made room");
        assert!(place.path().join("notes.txt").exists());
        fs::write(folder.file(digests[2]), b"damage").unwrap();
        assert!(folder.read(digests[2]).is_none());
        assert!(!folder.file(digests[2]).exists());
        folder.write(Digest::of(&[9; 300]), &[9; 300]).unwrap();
        assert!(folder.read(Digest::of(&[9; 300])).is_none(), "larger than the folder may be");
    }
}
