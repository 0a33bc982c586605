//! The store in one SQLite file: write-ahead log, one writer, every commit on the disk before it is answered.

use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use async_trait::async_trait;
use gradfarm_proto::Digest;
use sqlx::SqlitePool;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};

use super::sql::read::Scope;
use super::sql::{Connection, read, records, write};
use super::{Records, Store, StoreError};
use crate::job::{Change, DeliveredRecord, FileKind, FileRecord, JobId, StoredJob};

/// Jobs in a SQLite database.
#[derive(Debug)]
pub struct Sqlite {
    /// One connection: there is one writer.
    writer: SqlitePool,
    readers: SqlitePool,
}

impl Sqlite {
    /// Opens the database file, makes it if it is not there, and brings its tables up to date. `durable` waits for the disk.
    ///
    /// # Errors
    /// If the file is damaged, of a newer version, or cannot be opened.
    pub async fn open(file: &Path, durable: bool) -> Result<Self, StoreError> {
        let synchronous = if durable { SqliteSynchronous::Full } else { SqliteSynchronous::Off };
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(synchronous)
            .foreign_keys(true)
            .busy_timeout(Duration::from_secs(5));
        let writer = SqlitePoolOptions::new().max_connections(1).connect_with(options.clone()).await?;
        check_version(&sqlx::query_scalar::<_, String>("SELECT sqlite_version()").fetch_one(&writer).await?)?;
        let found: String = sqlx::query_scalar("PRAGMA quick_check(1)").fetch_one(&writer).await?;
        if found != "ok" {
            return Err(StoreError::Corrupt { row: file.display().to_string(), found });
        }
        let enforced: i64 = sqlx::query_scalar("PRAGMA foreign_keys").fetch_one(&writer).await?;
        if enforced != 1 {
            return Err(StoreError::Corrupt { row: "foreign_keys".into(), found: enforced.to_string() });
        }
        sqlx::migrate!("migrations/sqlite").run(&writer).await?;
        let readers = SqlitePoolOptions::new().max_connections(2).connect_with(options.read_only(true)).await?;
        Ok(Self { writer, readers })
    }
}

#[async_trait]
impl Records for Sqlite {
    async fn record(&self, kind: &str, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        records::one(&mut Connection::Sqlite(&mut connection), kind, key).await
    }

    async fn records(&self, kind: &str, before: Option<&str>, most: u32) -> Result<Vec<(String, Vec<u8>)>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        records::many(&mut Connection::Sqlite(&mut connection), kind, before, most).await
    }

    async fn replace_record(&self, kind: &str, key: &str, old: Option<&[u8]>, new: Option<&[u8]>) -> Result<bool, StoreError> {
        let mut connection = self.writer.acquire().await?;
        records::replace(&mut Connection::Sqlite(&mut connection), kind, key, old, new).await
    }
}

#[async_trait]
impl Store for Sqlite {
    async fn commit(&self, changes: &[Change]) -> Result<(), StoreError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        for change in changes {
            write::make(&mut Connection::Sqlite(&mut transaction), change).await?;
        }
        Ok(transaction.commit().await?)
    }

    async fn jobs(&self) -> Result<Vec<StoredJob>, StoreError> {
        // One snapshot for all tables.
        let mut transaction = self.readers.begin().await?;
        read::jobs(&mut Connection::Sqlite(&mut transaction), Scope::All).await
    }

    async fn results(&self, job: JobId, units: Range<u32>) -> Result<Vec<(u32, DeliveredRecord)>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        read::results(&mut Connection::Sqlite(&mut connection), job, units).await
    }

    async fn files(&self) -> Result<Vec<Digest>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        read::files(&mut Connection::Sqlite(&mut connection)).await
    }

    async fn file(&self, job: JobId, position: u32, kind: FileKind) -> Result<Option<FileRecord>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        read::file(&mut Connection::Sqlite(&mut connection), job, position, kind).await
    }
}

/// Earlier versions can damage the write-ahead log when a checkpoint meets a reset.
const LEAST_VERSION: (u32, u32, u32) = (3, 51, 3);

fn check_version(found: &str) -> Result<(), StoreError> {
    let mut parts = found.split('.').map(|part| part.parse::<u32>().unwrap_or(0));
    let mut next = || parts.next().unwrap_or(0);
    let version = (next(), next(), next());
    if version >= LEAST_VERSION {
        return Ok(());
    }
    let (major, minor, patch) = LEAST_VERSION;
    Err(StoreError::Version { software: "SQLite", found: found.to_owned(), least: format!("{major}.{minor}.{patch}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_versions_are_refused() {
        for good in ["3.51.3", "3.51.10", "3.52.0", "4.0.0"] {
            assert!(check_version(good).is_ok(), "{good}");
        }
        for bad in ["3.51.2", "3.46.0", "2.99.99", ""] {
            let refused = check_version(bad).unwrap_err().to_string();
            assert!(refused.contains("expected 3.51.3 or later"), "{refused}");
        }
    }
}
