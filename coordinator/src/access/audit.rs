//! The audit log: who changed what, when, and how it ended. It is only appended to.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::gate::{decode, encode};
use crate::clock::{Clock, Timestamp};
use crate::error::Error;
use crate::store::Records;

/// Records of the log, by names that sort by time.
const AUDIT: &str = "audit";

/// One line of the log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct AuditEntry {
    /// When [ms since 1970].
    pub at_ms: i64,
    /// Who: the name of a token, a subject, a worker; or nobody, if they were not let in.
    pub who: String,
    /// Which credential that was.
    pub credential: String,
    /// What was asked: a method and an address, or an event among workers.
    pub what: String,
    /// How it ended: an HTTP status, or a word.
    pub outcome: String,
}

/// Writes and reads the log.
#[derive(Clone, Debug)]
pub struct Audit {
    records: Arc<dyn Records>,
    clock: Clock,
}

impl Audit {
    /// A log in this store.
    pub fn new(records: Arc<dyn Records>) -> Self {
        Self { records, clock: Clock::new() }
    }

    /// Appends a line. What it tells of has happened already: if it cannot be written, that is an error in the process's own log.
    pub async fn note(&self, who: &str, credential: &str, what: &str, outcome: &str) {
        let entry = AuditEntry {
            at_ms: self.now().millis(),
            who: who.chars().take(200).collect(),
            credential: credential.to_owned(),
            what: what.chars().take(500).collect(),
            outcome: outcome.chars().take(500).collect(),
        };
        tracing::info!(target: "gradfarm::audit", who = entry.who, what = entry.what, outcome = entry.outcome, "audit");
        // Drawn with the time in front: later ones sort after earlier ones.
        let key = uuid::Uuid::now_v7().to_string();
        let written = match encode(&entry) {
            Ok(row) => self.records.replace_record(AUDIT, &key, None, Some(&row)).await,
            Err(fault) => Err(fault),
        };
        if let Err(fault) = written {
            tracing::error!(%fault, who = entry.who, what = entry.what, "the audit log could not be written");
        }
    }

    /// The latest lines, newest first, at most so many; with `before` those before that one. Each with its name.
    ///
    /// # Errors
    /// If the store fails.
    pub async fn read(&self, before: Option<&str>, most: u32) -> Result<Vec<(String, AuditEntry)>, Error> {
        let rows = self.records.records(AUDIT, before, most).await?;
        rows.into_iter().map(|(key, row)| Ok((key.clone(), decode(AUDIT, &key, &row)?))).collect()
    }

    fn now(&self) -> Timestamp {
        self.clock.now()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{Memory, Sqlite};

    #[tokio::test]
    async fn the_latest_come_first_page_by_page() {
        let audit = Audit::new(Arc::new(Memory::new()));
        for what in ["one", "two", "three"] {
            audit.note("anna", "0123", what, "200").await;
        }
        let page = audit.read(None, 2).await.unwrap();
        assert_eq!(page.iter().map(|(_, entry)| entry.what.as_str()).collect::<Vec<_>>(), ["three", "two"]);
        let rest = audit.read(Some(&page[1].0), 2).await.unwrap();
        assert_eq!(rest.iter().map(|(_, entry)| entry.what.as_str()).collect::<Vec<_>>(), ["one"]);
    }

    #[tokio::test]
    async fn what_was_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let store = Arc::new(Sqlite::open(&folder.path().join("farm.db"), true).await.unwrap());
        let audit = Audit::new(store.clone());
        audit.note("anna", "0123", "DELETE /jobs/7", "200").await;
        let (key, row) = store.records(AUDIT, None, 1).await.unwrap().remove(0);
        for new in [None, Some(&b"{}"[..])] {
            let refused = store.replace_record(AUDIT, &key, Some(&row), new).await.unwrap_err().to_string();
            assert!(refused.contains("only appended to"), "{refused}");
        }
        assert_eq!(audit.read(None, 9).await.unwrap().len(), 1);
    }
}
