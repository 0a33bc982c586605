//! Which blobs: `file:PATH` or `s3://BUCKET/PREFIX`.

use std::fmt;
use std::net::IpAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::prefix::PrefixStore;
use object_store::{BackoffConfig, RetryConfig};

use super::{BlobError, Blobs};
use crate::crypto;

/// Where blobs are kept. Keys to a storage are never part of it: they come from the environment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BlobUri {
    /// In a folder.
    File(PathBuf),
    /// In a bucket of an S3 storage, below a prefix that may be empty.
    S3 {
        /// The bucket.
        bucket: String,
        /// What every key begins with.
        prefix: String,
    },
}

/// Why a text names no blobs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}; expected file:PATH or s3://BUCKET/PREFIX")]
pub struct ParseBlobsError {
    reason: String,
}

impl BlobUri {
    /// Opens the blobs. `durable` waits for the disk, where that is ours to say. Endpoint, region and keys of an S3 storage come from the
    /// environment: `AWS_ENDPOINT_URL`, `AWS_REGION`, `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY` and others of that kind.
    ///
    /// # Errors
    /// If the folder cannot be used or the settings are incomplete.
    pub fn open(&self, durable: bool) -> Result<Blobs, BlobError> {
        match self {
            BlobUri::File(folder) => Blobs::in_folder(folder, durable),
            BlobUri::S3 { bucket, prefix } => {
                crypto::provide();
                let store = s3(AmazonS3Builder::from_env().with_bucket_name(bucket))?.build()?;
                Ok(Blobs::over(Arc::new(PrefixStore::new(store, prefix.as_str())), true))
            }
        }
    }
}

/// Settings on top of those of the environment.
pub(super) fn s3(builder: AmazonS3Builder) -> Result<AmazonS3Builder, BlobError> {
    let set = |key| builder.get_config_value(&key);
    let endpoint = set(AmazonS3ConfigKey::Endpoint).unwrap_or_default();
    let allowed = std::env::var("AWS_ALLOW_HTTP").is_ok_and(|value| value.eq_ignore_ascii_case("true"));
    let plain = endpoint.starts_with("http://");
    if plain && !allowed && !is_local(&endpoint) {
        return Err(BlobError::Unencrypted { endpoint });
    }
    let region = set(AmazonS3ConfigKey::Region).or_else(|| set(AmazonS3ConfigKey::DefaultRegion)).unwrap_or_else(|| "us-east-1".to_owned());
    // Longer absences are borne by whoever asks.
    let backoff = BackoffConfig { init_backoff: Duration::from_millis(100), max_backoff: Duration::from_secs(2), base: 2.0 };
    let retry = RetryConfig { backoff, max_retries: 5, retry_timeout: Duration::from_secs(20) };
    Ok(builder.with_region(region).with_allow_http(plain).with_retry(retry))
}

/// Whether an address `http://HOST:PORT/…` is on this machine.
fn is_local(endpoint: &str) -> bool {
    let rest = endpoint.trim_start_matches("http://");
    let authority = rest.split('/').next().unwrap_or_default();
    let host = match authority.strip_prefix('[') {
        Some(six) => six.split(']').next().unwrap_or_default(),
        None => authority.rsplit_once(':').map_or(authority, |(host, _)| host),
    };
    host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

impl FromStr for BlobUri {
    type Err = ParseBlobsError;

    fn from_str(text: &str) -> Result<Self, ParseBlobsError> {
        let refused = |reason: &str| Err(ParseBlobsError { reason: reason.to_owned() });
        match text.split_once(':') {
            Some(("file", path)) => match path.strip_prefix("//").unwrap_or(path) {
                "" => refused("the path is empty"),
                path => Ok(BlobUri::File(path.into())),
            },
            Some(("s3", rest)) => {
                let Some(rest) = rest.strip_prefix("//") else { return refused("the bucket is missing") };
                let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
                let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || ".-_".contains(c);
                if bucket.is_empty() || !bucket.chars().all(good) {
                    return refused("a bucket's name has lower-case letters, digits, dots and hyphens");
                }
                Ok(BlobUri::S3 { bucket: bucket.to_owned(), prefix: prefix.trim_matches('/').to_owned() })
            }
            _ => refused("the kind of storage is missing or not known"),
        }
    }
}

impl fmt::Display for BlobUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BlobUri::File(folder) => write!(f, "file:{}", folder.display()),
            BlobUri::S3 { bucket, prefix } => write!(f, "s3://{bucket}/{prefix}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn storages_have_names() {
        for (text, shown) in [
            ("file:blobs", "file:blobs"),
            ("file:///var/blobs", "file:/var/blobs"),
            ("s3://films", "s3://films/"),
            ("s3://films/farm/a/", "s3://films/farm/a"),
        ] {
            assert_eq!(text.parse::<BlobUri>().unwrap().to_string(), shown);
        }
        for bad in ["", "blobs", "file:", "s3:films", "s3:///x", "s3://Films@host", "gs://films"] {
            assert!(bad.parse::<BlobUri>().unwrap_err().to_string().contains("expected file:PATH"), "{bad}");
        }
    }

    #[test]
    fn only_storages_on_this_machine_are_reached_without_tls() {
        for local in ["http://127.0.0.1:9000", "http://localhost/", "http://[::1]:9000/x"] {
            assert!(is_local(local), "{local}");
        }
        for remote in ["http://10.0.0.1:9000", "http://minio:9000", "http://localhost.example.org", "http://[2001:db8::1]:9000"] {
            assert!(!is_local(remote), "{remote}");
        }
        let builder = AmazonS3Builder::new().with_bucket_name("films").with_endpoint("http://minio:9000");
        assert!(matches!(s3(builder), Err(BlobError::Unencrypted { .. })));
    }
}
