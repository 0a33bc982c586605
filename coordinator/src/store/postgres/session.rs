//! One run of a coordinator, as the database knows it.
//!
//! Every commit of a run updates its row. The row is thus a number that tells which commits were made, a sign of life, and a fence: once
//! somebody else has ended the session, no commit of it can be made any more.

use sqlx::PgConnection;
use uuid::Uuid;

use crate::store::StoreError;
use crate::store::sql::{Connection, Statement};

/// A run of a coordinator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    id: Uuid,
}

/// Whether a commit is new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Counted {
    /// It is counted now.
    Now,
    /// It was made before: its answer was lost.
    Before,
}

impl Session {
    /// Begins a session and ends all others.
    pub(super) async fn begin(connection: &mut PgConnection) -> Result<Self, StoreError> {
        let id = Uuid::now_v7();
        let mut connection = Connection::Postgres(connection);
        let others = "WITH others AS (UPDATE coordinators SET ended = clock_timestamp() WHERE ended IS NULL)
                      INSERT INTO coordinators (session) VALUES ($1)";
        connection.execute(Statement::new(others).bytes(id.as_bytes())).await?;
        Ok(Self { id })
    }

    /// Counts a commit, in its transaction.
    pub(super) async fn count(&self, connection: &mut PgConnection, number: i64) -> Result<Counted, StoreError> {
        let mut connection = Connection::Postgres(connection);
        let count = "UPDATE coordinators SET commits = $2, heard = clock_timestamp()
                     WHERE session = $1 AND commits = $2 - 1 AND ended IS NULL";
        if connection.execute(Statement::new(count).bytes(self.id.as_bytes()).integer(number)).await? == 1 {
            return Ok(Counted::Now);
        }
        let made = "SELECT commits FROM coordinators WHERE session = $1 AND commits >= $2";
        match connection.first(Statement::new(made).bytes(self.id.as_bytes()).integer(number)).await? {
            // Even if the session has ended since: what was committed is.
            Some(_) => Ok(Counted::Before),
            None => Err(StoreError::Fenced),
        }
    }
}
