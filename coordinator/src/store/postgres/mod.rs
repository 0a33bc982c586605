//! The store on a PostgreSQL server.
//!
//! A server can be away for a while, and a connection can break between a commit and its answer. Such errors say nothing of what is
//! stored: they are tried again, for a minute. Every commit counts up a number in the row of this run of the coordinator, in the same
//! transaction; so a second try finds out whether the first one had worked, and a run that others hold for dead writes nothing more.

mod cluster;
mod session;
#[cfg(test)]
mod tests;
mod transient;

use std::ops::Range;
use std::time::Duration;

use async_trait::async_trait;
use gradfarm_proto::Digest;
use sqlx::postgres::{PgConnectOptions, PgPoolOptions};
use sqlx::{Connection as _, PgConnection, PgPool};
use tokio::sync::Mutex;

use super::sql::read::Scope;
use super::sql::{Connection, Statement, read, records, write};
use super::{Alone, Cluster, Presence, Records, Singleton, Store, StoreError};
use crate::job::{Change, DeliveredRecord, FileKind, FileRecord, JobId, StoredJob};
use session::Session;
use transient::patiently;

/// How long one try to commit may take. A transaction that hangs longer is given up and asked about again.
const TRY: Duration = Duration::from_secs(20);
/// The number that our locks have in common: "grad".
const LOCKS: i32 = 0x6772_6164;
/// Connections that read.
const READERS: u32 = 4;

/// Jobs in a PostgreSQL database.
#[derive(Debug)]
pub struct Postgres {
    options: PgConnectOptions,
    /// One at a time writes, so that commits are numbered.
    writer: Mutex<Writer>,
    readers: PgPool,
    session: Session,
    pulse: Mutex<cluster::Pulse>,
}

/// The connection that writes, and how many commits it made.
#[derive(Debug)]
struct Writer {
    /// None after an error: whatever was under way on it is over.
    connection: Option<PgConnection>,
    commits: i64,
}

impl Postgres {
    /// Connects, brings the tables up to date and begins a session, which ends earlier ones at the same place.
    ///
    /// # Errors
    /// If the server cannot be reached for a minute, or the database is of a newer version.
    pub async fn open(options: &PgConnectOptions, presence: &Presence) -> Result<Self, StoreError> {
        // A connection that broke in the middle of a transaction must not hold its locks for long.
        let options = options.clone().options([("idle_in_transaction_session_timeout", "10s"), ("lock_timeout", "15s")]);
        let mut connection = connect(&options).await?;
        let session = Session::begin(&mut connection, presence).await?;
        let readers =
            PgPoolOptions::new().max_connections(READERS).acquire_timeout(Duration::from_secs(5)).connect_lazy_with(options.clone());
        Ok(Self {
            options,
            writer: Mutex::new(Writer { connection: Some(connection), commits: 0 }),
            readers,
            session,
            pulse: Mutex::default(),
        })
    }

    /// One try to make changes durable as the commit of this number.
    async fn attempt(&self, connection: &mut Option<PgConnection>, number: i64, changes: &[Change]) -> Result<(), StoreError> {
        let connection = match connection {
            Some(connection) => connection,
            none => none.insert(PgConnection::connect_with(&self.options).await?),
        };
        let mut transaction = connection.begin().await?;
        if self.session.count(&mut transaction, number).await? == session::Counted::Before {
            return Ok(transaction.rollback().await?);
        }
        for change in changes {
            write::make(&mut Connection::Postgres(&mut transaction), change).await?;
            if let Change::Submitted(record) = change {
                let own = Statement::new("UPDATE jobs SET owner = $2 WHERE id = $1");
                let own = own.bytes(&record.id.to_bytes()).bytes(self.session.name());
                Connection::Postgres(&mut transaction).execute(own).await?;
            }
        }
        Ok(transaction.commit().await?)
    }
}

/// Connects and brings the tables up to date.
pub(super) async fn connect(options: &PgConnectOptions) -> Result<PgConnection, StoreError> {
    patiently("connect", || async {
        let mut connection = PgConnection::connect_with(options).await?;
        sqlx::migrate!("migrations/postgres").run(&mut connection).await?;
        Ok(connection)
    })
    .await
}

#[async_trait]
impl Records for Postgres {
    async fn record(&self, kind: &str, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        patiently("read a record", || async {
            let mut connection = self.readers.acquire().await?;
            records::one(&mut Connection::Postgres(&mut connection), kind, key).await
        })
        .await
    }

    async fn records(&self, kind: &str, before: Option<&str>, most: u32) -> Result<Vec<(String, Vec<u8>)>, StoreError> {
        patiently("read records", || async {
            let mut connection = self.readers.acquire().await?;
            records::many(&mut Connection::Postgres(&mut connection), kind, before, most).await
        })
        .await
    }

    async fn replace_record(&self, kind: &str, key: &str, old: Option<&[u8]>, new: Option<&[u8]>) -> Result<bool, StoreError> {
        // Tried once: a second try could not tell its own change from somebody else's equal one. Whoever asked may ask again.
        let mut connection = self.readers.acquire().await?;
        records::replace(&mut Connection::Postgres(&mut connection), kind, key, old, new).await
    }
}

#[async_trait]
impl Store for Postgres {
    async fn commit(&self, changes: &[Change]) -> Result<(), StoreError> {
        let writer = &mut *self.writer.lock().await;
        let number = writer.commits + 1;
        let connection = Mutex::new(&mut writer.connection);
        patiently("commit", || async {
            let connection = &mut **connection.lock().await;
            let outcome = match tokio::time::timeout(TRY, self.attempt(connection, number, changes)).await {
                Ok(outcome) => outcome,
                Err(_) => Err(StoreError::Database(sqlx::Error::PoolTimedOut)),
            };
            if outcome.is_err() {
                *connection = None;
            }
            outcome
        })
        .await?;
        writer.commits = number;
        Ok(())
    }

    async fn jobs(&self) -> Result<Vec<StoredJob>, StoreError> {
        patiently("read jobs", || async {
            // One snapshot for all tables.
            let mut transaction = self.readers.begin_with("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY").await?;
            read::jobs(&mut Connection::Postgres(&mut transaction), Scope::All).await
        })
        .await
    }

    async fn results(&self, job: JobId, units: Range<u32>) -> Result<Vec<(u32, DeliveredRecord)>, StoreError> {
        patiently("read results", || async {
            let mut connection = self.readers.acquire().await?;
            read::results(&mut Connection::Postgres(&mut connection), job, units.clone()).await
        })
        .await
    }

    async fn files(&self) -> Result<Vec<Digest>, StoreError> {
        patiently("read files", || async {
            let mut connection = self.readers.acquire().await?;
            read::files(&mut Connection::Postgres(&mut connection)).await
        })
        .await
    }

    fn cluster(&self) -> Option<&dyn Cluster> {
        Some(self)
    }

    async fn alone(&self, work: Singleton) -> Result<Option<Alone>, StoreError> {
        // The lock is the connection's, and goes with it, however that ends.
        let mut connection = PgConnection::connect_with(&self.options).await?;
        let query = sqlx::query_scalar("SELECT pg_try_advisory_lock($1, $2)").bind(LOCKS).bind(work.number());
        let taken: bool = query.fetch_one(&mut connection).await?;
        Ok(taken.then(|| Alone::with(connection)))
    }

    async fn file(&self, job: JobId, position: u32, kind: FileKind) -> Result<Option<FileRecord>, StoreError> {
        patiently("read file", || async {
            let mut connection = self.readers.acquire().await?;
            read::file(&mut Connection::Postgres(&mut connection), job, position, kind).await
        })
        .await
    }
}
