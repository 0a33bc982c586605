//! Errors of a storage over the network, and how long they are borne.

use std::future::Future;
use std::time::{Duration, Instant};

use object_store::Error;

use super::Blobs;

/// How long a storage may be away.
const PATIENCE: Duration = Duration::from_secs(60);
/// Between tries: from the first pause, doubling, up to the longest.
const PAUSES: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(2));

impl Blobs {
    /// Tries until it works, fails for good, or the patience is over. Whatever is tried must be safe to do twice, as writing content is.
    pub(super) async fn patiently<T, F: Future<Output = Result<T, Error>>>(&self, mut attempt: impl FnMut() -> F) -> Result<T, Error> {
        let start = Instant::now();
        let mut pause = PAUSES.0;
        loop {
            match attempt().await {
                Err(error) if self.remote && is_transient(&error) && start.elapsed() < PATIENCE => {
                    tracing::warn!(%error, seconds = start.elapsed().as_secs(), "the blob storage failed, trying again");
                }
                outcome => return outcome,
            }
            tokio::time::sleep(pause).await;
            pause = (pause * 2).min(PAUSES.1);
        }
    }
}

/// Whether another try may end otherwise.
fn is_transient(error: &Error) -> bool {
    matches!(error, Error::Generic { .. } | Error::JoinError { .. })
}
