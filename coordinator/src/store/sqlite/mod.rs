//! The store in one SQLite file: write-ahead log, one writer, every commit on the disk before it is answered.

mod read;
mod write;

use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use async_trait::async_trait;
use sqlx::SqlitePool;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};

use super::{Store, StoreError};
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
impl Store for Sqlite {
    async fn commit(&self, changes: &[Change]) -> Result<(), StoreError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        for change in changes {
            write::make(&mut transaction, change).await?;
        }
        Ok(transaction.commit().await?)
    }

    async fn jobs(&self) -> Result<Vec<StoredJob>, StoreError> {
        read::jobs(&self.readers).await
    }

    async fn results(&self, job: JobId, units: Range<u32>) -> Result<Vec<(u32, DeliveredRecord)>, StoreError> {
        read::results(&self.readers, job, units).await
    }

    async fn file(&self, job: JobId, position: u32, kind: FileKind) -> Result<Option<FileRecord>, StoreError> {
        read::file(&self.readers, job, position, kind).await
    }
}
