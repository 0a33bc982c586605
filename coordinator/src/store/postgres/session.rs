//! One run of a coordinator, as the database knows it.
//!
//! Every commit of a run updates its row. The row is thus a number that tells which commits were made, a sign of life, and a fence: once
//! somebody else has ended the session, no commit of it can be made any more.

use sqlx::PgConnection;
use uuid::Uuid;

use crate::store::sql::{Connection, Statement};
use crate::store::{Presence, StoreError};

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
    /// Begins a session and ends those before it at the same place.
    pub(super) async fn begin(connection: &mut PgConnection, presence: &Presence) -> Result<Self, StoreError> {
        let id = Uuid::now_v7();
        let mut connection = Connection::Postgres(connection);
        let begin = "WITH before AS (UPDATE coordinators SET ended = clock_timestamp() WHERE place = $2 AND ended IS NULL)
                     INSERT INTO coordinators (session, place, http, grpc) VALUES ($1, $2, $3, $4)";
        let begin = Statement::new(begin).bytes(id.as_bytes()).bytes(presence.place.as_bytes()).text(&presence.http).text(&presence.grpc);
        connection.execute(begin).await?;
        // Runs that nothing is left of.
        let old = "DELETE FROM coordinators WHERE ended < clock_timestamp() - INTERVAL '1 day'
                   AND NOT EXISTS (SELECT 1 FROM jobs WHERE owner = session)";
        connection.execute(Statement::new(old)).await?;
        Ok(Self { id })
    }

    /// Its name in the database.
    pub(super) fn name(&self) -> &[u8] {
        self.id.as_bytes()
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
