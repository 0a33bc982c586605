//! What SQLite and PostgreSQL have in common: the statements, written once, and how rows become records again.
//!
//! Both take the same SQL: integers are 64 bits wide, names and digests are bytes, placeholders are `$1`. What differs (how a connection
//! is opened, what a commit waits for, who else may write) is told beside, in `sqlite` and `postgres`.

pub(super) mod read;
pub(super) mod records;
mod row;
mod statement;
pub(super) mod write;

use std::borrow::Cow;

use futures::stream::BoxStream;
use futures::{StreamExt, TryStreamExt};
use sqlx::{PgConnection, SqliteConnection};

pub(super) use row::{Kind, Row};
pub(super) use statement::{Statement, Value};

use super::StoreError;

/// A connection to either database, within a transaction or not.
pub(super) enum Connection<'c> {
    /// To a file.
    Sqlite(&'c mut SqliteConnection),
    /// To a server.
    Postgres(&'c mut PgConnection),
}

/// A query with its values bound, for whichever database the connection is to.
macro_rules! query {
    ($statement:expr) => {{
        let Statement { text, values } = $statement;
        let mut query = match text {
            Cow::Borrowed(text) => sqlx::query(text),
            Cow::Owned(text) => sqlx::query(sqlx::AssertSqlSafe(text)),
        };
        for value in values {
            query = match value {
                Value::Integer(value) => query.bind(value),
                Value::Real(value) => query.bind(value),
                Value::Text(value) => query.bind(value),
                Value::Bytes(value) => query.bind(value),
            };
        }
        query
    }};
}

impl Connection<'_> {
    /// Runs a statement; how many rows it changed.
    pub(super) async fn execute(&mut self, statement: Statement) -> Result<u64, StoreError> {
        Ok(match self {
            Connection::Sqlite(connection) => query!(statement).execute(&mut **connection).await?.rows_affected(),
            Connection::Postgres(connection) => query!(statement).execute(&mut **connection).await?.rows_affected(),
        })
    }

    /// Hands over each row that a statement gives, one after the other.
    pub(super) async fn each(
        &mut self,
        statement: Statement,
        mut take: impl FnMut(Row) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut rows = self.stream(statement);
        while let Some(row) = rows.try_next().await? {
            take(row)?;
        }
        Ok(())
    }

    /// The rows that a statement gives.
    pub(super) fn stream(&mut self, statement: Statement) -> BoxStream<'_, Result<Row, StoreError>> {
        match self {
            Connection::Sqlite(connection) => query!(statement).fetch(&mut **connection).map(|row| Ok(Row::Sqlite(row?))).boxed(),
            Connection::Postgres(connection) => query!(statement).fetch(&mut **connection).map(|row| Ok(Row::Postgres(row?))).boxed(),
        }
    }

    /// The first row that a statement gives, if any.
    pub(super) async fn first(&mut self, statement: Statement) -> Result<Option<Row>, StoreError> {
        Ok(match self {
            Connection::Sqlite(connection) => query!(statement).fetch_optional(&mut **connection).await?.map(Row::Sqlite),
            Connection::Postgres(connection) => query!(statement).fetch_optional(&mut **connection).await?.map(Row::Postgres),
        })
    }
}
