//! Workers that an operator lets rest: they finish what they hold and get nothing new. It is kept in the store, so that it holds over
//! restarts and for every coordinator that the worker is connected to.

use std::collections::BTreeSet;
use std::time::Duration;

use tokio::sync::mpsc;

use super::command::Command;
use super::handle::Handle;
use crate::error::Error;
use crate::job::WorkerId;
use crate::store::{Records, StoreError};

/// Kind of the records.
const KIND: &str = "resting-worker";
/// Most workers that rest at the same time.
const MOST: u32 = 10_000;
/// How often it is looked what other coordinators were told.
const LOOK: Duration = Duration::from_secs(2);

/// Who rests, as the store has it.
pub(super) async fn resting(store: &dyn Records) -> Result<BTreeSet<WorkerId>, StoreError> {
    Ok(store.records(KIND, None, MOST).await?.into_iter().filter_map(|(key, _)| key.parse().ok()).collect())
}

impl Handle {
    /// Lets a worker rest, or work again. Twice changes nothing.
    ///
    /// # Errors
    /// [`Error::NoWorker`] if it is neither connected nor resting, or if the store cannot be written.
    pub async fn rest(&self, worker: WorkerId, rests: bool) -> Result<(), Error> {
        let key = worker.to_string();
        let before = self.store.record(KIND, &key).await?;
        let connected = self.look(move |dispatcher| dispatcher.roster.get_mut(worker).is_some()).await?;
        if before.is_none() && !connected {
            return Err(Error::NoWorker(worker));
        }
        if before.is_some() != rests {
            // If somebody else was faster, it is as they wanted it.
            self.store.replace_record(KIND, &key, before.as_deref(), rests.then_some(&b"rests"[..])).await?;
        }
        let resting = resting(self.store.as_ref()).await?;
        self.look(move |dispatcher| dispatcher.roster.set_resting(resting)).await
    }
}

/// Looks now and then who rests, until the loop is gone: another coordinator may have been told.
pub(super) async fn keep_looking(store: std::sync::Arc<dyn crate::store::Store>, commands: mpsc::WeakSender<Command>) {
    let mut known = BTreeSet::new();
    loop {
        match resting(store.as_ref()).await {
            Ok(found) if found != known => {
                known = found.clone();
                let Some(commands) = commands.upgrade() else { return };
                let look = Command::Look(Box::new(move |dispatcher| dispatcher.roster.set_resting(found)));
                if commands.send(look).await.is_err() {
                    return;
                }
            }
            Ok(_) => {}
            Err(error) => tracing::debug!(%error, "cannot tell which workers rest"),
        }
        tokio::time::sleep(LOOK).await;
        if commands.strong_count() == 0 {
            return;
        }
    }
}
