//! Everything of one store into another one, of the same kind or not: rows as they are, table by table.
//!
//! What there is to copy follows from the databases' own catalogues, so that a new table or column is copied without being named here.
//! Runs of coordinators, and who owns which job, are of their database alone and stay behind.

mod catalogue;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::path::Path;

use futures::TryStreamExt;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous};
use sqlx::{Connection as _, PgConnection, SqliteConnection};

use super::sql::{Connection, Statement};
use super::{Sqlite, StoreError, StoreUri, postgres};
use catalogue::Table;

/// Most values of one statement.
const VALUES: usize = 8_000;

/// Why a store could not be copied.
#[derive(Debug, thiserror::Error)]
pub enum MigrateError {
    /// One of the two could not be read or written.
    #[error("{store}: {source}")]
    Store {
        /// Which.
        store: String,
        /// Why.
        source: StoreError,
    },
    /// A coordinator works on it.
    #[error("{store} is in use by a coordinator: stop it first")]
    InUse {
        /// Which.
        store: String,
    },
    /// There is no such store.
    #[error("there is no store {store}")]
    Absent {
        /// Which.
        store: String,
    },
    /// The target has jobs.
    #[error("{store} is not empty: nothing is ever mixed or overwritten")]
    NotEmpty {
        /// Which.
        store: String,
    },
    /// The two do not have the same tables.
    #[error("{store} has no place for {what}")]
    NoPlace {
        /// Which.
        store: String,
        /// The table, or table and column.
        what: String,
    },
}

/// A connection, and what keeps coordinators away from its store.
enum Side {
    Sqlite { connection: SqliteConnection, _lock: Option<File> },
    Postgres(PgConnection),
}

impl Side {
    fn on(&mut self) -> Connection<'_> {
        match self {
            Side::Sqlite { connection, .. } => Connection::Sqlite(connection),
            Side::Postgres(connection) => Connection::Postgres(connection),
        }
    }

    async fn run(&mut self, statement: &'static str) -> Result<u64, StoreError> {
        self.on().execute(Statement::new(statement)).await
    }
}

/// Copies all rows of one store into another one, which must be empty: how many rows of each table. All of them are there at the end, or
/// none.
///
/// # Errors
/// If a coordinator works on one of the two, the target has jobs, or a database fails.
pub async fn migrate(from: &StoreUri, to: &StoreUri) -> Result<Vec<(String, u64)>, MigrateError> {
    if let StoreUri::Sqlite(file) = from
        && !file.exists()
    {
        return Err(MigrateError::Absent { store: from.to_string() });
    }
    let mut source = open(from, None).await?;
    let mut target = open(to, folder(from)).await?;
    let of_target = |error| MigrateError::Store { store: to.to_string(), source: error };
    let of_source = |error| MigrateError::Store { store: from.to_string(), source: error };
    if target.on().first(Statement::new("SELECT 1 FROM jobs LIMIT 1")).await.map_err(of_target)?.is_some() {
        return Err(MigrateError::NotEmpty { store: to.to_string() });
    }
    let tables = catalogue::tables(&mut source).await.map_err(of_source)?;
    let places = catalogue::tables(&mut target).await.map_err(of_target)?;
    let begin = if matches!(source, Side::Postgres(_)) { "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY" } else { "BEGIN" };
    source.run(begin).await.map_err(of_source)?;
    target.run("BEGIN").await.map_err(of_target)?;
    let mut copied = Vec::new();
    for place in &places {
        let Some(table) = tables.iter().find(|table| table.name == place.name) else { continue };
        if let Some(column) = table.columns.iter().find(|column| !place.columns.contains(column)) {
            return Err(MigrateError::NoPlace { store: to.to_string(), what: format!("{}.{}", table.name, column.name) });
        }
        // Tables that a migration filled already.
        target.on().execute(Statement::of_names(format!("DELETE FROM \"{}\"", table.name))).await.map_err(of_target)?;
        copied.push((table.name.clone(), copy(table, &mut source, &mut target, from, to).await?));
    }
    if let Some(table) = tables.iter().find(|table| places.iter().all(|place| place.name != table.name)) {
        return Err(MigrateError::NoPlace { store: to.to_string(), what: table.name.clone() });
    }
    target.run("COMMIT").await.map_err(of_target)?;
    Ok(copied)
}

/// Copies the rows of a table.
async fn copy(table: &Table, source: &mut Side, target: &mut Side, from: &StoreUri, to: &StoreUri) -> Result<u64, MigrateError> {
    let of_target = |error| MigrateError::Store { store: to.to_string(), source: error };
    let of_source = |error| MigrateError::Store { store: from.to_string(), source: error };
    let most = (VALUES / table.columns.len().max(1)).max(1);
    let mut on = source.on();
    let mut rows = on.stream(Statement::of_names(table.select()));
    let (mut waiting, mut count) = (Vec::new(), 0);
    loop {
        let row = rows.try_next().await.map_err(of_source)?;
        let over = row.is_none();
        if let Some(row) = row {
            waiting.push(table.values(&row).map_err(of_source)?);
        }
        if waiting.len() == most || (over && !waiting.is_empty()) {
            count += waiting.len() as u64;
            let insert = Statement::of_names(table.insert(waiting.len()));
            let insert = waiting.drain(..).flatten().fold(insert, Statement::value);
            target.on().execute(insert).await.map_err(of_target)?;
        }
        if over {
            return Ok(count);
        }
    }
}

/// Opens a store for copying: its tables are brought up to date, and no coordinator is at work on it. The lock of the folder `held` is
/// ours already.
async fn open(store: &StoreUri, held: Option<&Path>) -> Result<Side, MigrateError> {
    let failed = |source| MigrateError::Store { store: store.to_string(), source };
    match store {
        StoreUri::Sqlite(file) => {
            let lock = if folder(store) == held { Ok(None) } else { lock_beside(file) };
            let lock = lock.map_err(|()| MigrateError::InUse { store: store.to_string() })?;
            // All that opening checks and brings up to date.
            drop(Sqlite::open(file, true).await.map_err(failed)?);
            let options = SqliteConnectOptions::new()
                .filename(file)
                .journal_mode(SqliteJournalMode::Wal)
                .synchronous(SqliteSynchronous::Full)
                .foreign_keys(true);
            let connection = SqliteConnection::connect_with(&options).await.map_err(|error| failed(error.into()))?;
            Ok(Side::Sqlite { connection, _lock: lock })
        }
        StoreUri::Postgres(options) => {
            let mut connection = postgres::connect(options).await.map_err(failed)?;
            let alive = "SELECT 1 FROM coordinators WHERE ended IS NULL AND heard > clock_timestamp() - INTERVAL '10 seconds'";
            if Connection::Postgres(&mut connection).first(Statement::new(alive)).await.map_err(failed)?.is_some() {
                return Err(MigrateError::InUse { store: store.to_string() });
            }
            Ok(Side::Postgres(connection))
        }
    }
}

/// The folder of a store in a file.
fn folder(store: &StoreUri) -> Option<&Path> {
    match store {
        StoreUri::Sqlite(file) => file.parent(),
        StoreUri::Postgres(_) => None,
    }
}

/// The lock that a coordinator holds on the folder of its database, if there is one. The error is that it does.
fn lock_beside(file: &Path) -> Result<Option<File>, ()> {
    let Some(lock) = file.parent().map(|folder| folder.join("lock")).filter(|lock| lock.exists()) else { return Ok(None) };
    let Ok(lock) = File::open(lock) else { return Ok(None) };
    match lock.try_lock() {
        Err(std::fs::TryLockError::WouldBlock) => Err(()),
        _ => Ok(Some(lock)),
    }
}
