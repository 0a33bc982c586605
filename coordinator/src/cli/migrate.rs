//! `gradfarm migrate`: from one store to another, such as from a file to PostgreSQL when the farm grows.

use futures::{StreamExt, TryStreamExt, stream};

use super::error::Error;
use super::terminal;
use crate::store::{BlobUri, Blobs, StoreUri, migrate};

/// Arguments of `gradfarm migrate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Stop the coordinator first. The target must be empty; the source stays as it is. Blobs are checked as they are copied, and what is there \
already is not copied again, so a copy that broke off can be repeated. Endpoint, region and keys of an S3 storage come from the \
environment (AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY).

Example:
  gradfarm migrate --from sqlite:gradfarm-data/farm.db --to postgres://farm@db/farm \\
                   --blobs-from file:gradfarm-data/blobs --blobs-to s3://films/farm")]
pub(super) struct Migrate {
    /// Jobs to copy: sqlite:PATH or postgres://USER:PASSWORD@HOST/DATABASE
    #[arg(long, value_name = "URI")]
    from: StoreUri,
    /// Where to copy them
    #[arg(long, value_name = "URI")]
    to: StoreUri,
    /// Assets, results and images to copy, too: file:PATH or s3://BUCKET/PREFIX
    #[arg(long, value_name = "URI", requires = "blobs_to")]
    blobs_from: Option<BlobUri>,
    /// Where to copy these
    #[arg(long, value_name = "URI", requires = "blobs_from")]
    blobs_to: Option<BlobUri>,
}

/// Blobs that are copied at the same time.
const AT_ONCE: usize = 8;

impl Migrate {
    /// Copies blobs, then rows: a row never names what is not there.
    pub(super) async fn run(self) -> Result<(), Error> {
        let failed = |fault: &dyn std::fmt::Display| Error::Failed(fault.to_string());
        if let (Some(from), Some(to)) = (&self.blobs_from, &self.blobs_to) {
            let [source, target] = [from, to].map(|uri| uri.open(true).map_err(|fault| failed(&fault)));
            let (count, copied) = copy(&source?, &target?).await.map_err(|fault| failed(&fault))?;
            terminal::line(format_args!("{copied} of {count} blobs copied from {from} to {to}"))?;
        }
        for (table, rows) in migrate(&self.from, &self.to).await.map_err(|fault| failed(&fault))? {
            terminal::line(format_args!("{rows:>10} {table}"))?;
        }
        terminal::line(format_args!("copied from {} to {}", self.from, self.to))
    }
}

/// Copies what is not there yet: how many there are, and how many were copied.
async fn copy(source: &Blobs, target: &Blobs) -> Result<(usize, usize), crate::store::BlobError> {
    let all = source.all().await?;
    let count = all.len();
    let one = |digest| async move {
        let there = target.has(digest).await?;
        if !there {
            target.put(source.get(digest).await?).await?;
        }
        Ok::<usize, crate::store::BlobError>(usize::from(!there))
    };
    let copied = stream::iter(all).map(one).buffer_unordered(AT_ONCE).try_fold(0, |sum, one| async move { Ok(sum + one) }).await?;
    Ok((count, copied))
}
