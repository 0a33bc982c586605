//! Several coordinators on one database: signs of life, and jobs that change hands.
//!
//! Time is the database's. Who was away itself judges nobody: after an absence of the database everybody looks dead to whoever comes
//! back first, so a run that did not give its own signs of life steadily declares no other one dead.

use std::time::{Duration, Instant};

use async_trait::async_trait;
use sqlx::{Connection as _, PgConnection};
use uuid::Uuid;

use super::Postgres;
use super::transient::patiently;
use crate::job::{JobId, JobRecord, StoredJob};
use crate::store::sql::read::{self, Scope};
use crate::store::sql::{Connection, Row, Statement};
use crate::store::{Cluster, Owner, Presence, StoreError};

/// Silence after which a run is dead [ms].
pub(super) const DEAD: i64 = 3_000;
/// Longest pause between two of our own signs of life that are steady.
const STEADY: Duration = Duration::from_millis(1_500);
/// How long one sign of life, with what is taken over, may take.
const TRY: Duration = Duration::from_secs(20);
/// More jobs than this are read all together.
const MANY: usize = 32;

/// The connection that gives signs of life.
#[derive(Debug, Default)]
pub(super) struct Pulse {
    connection: Option<PgConnection>,
    /// Since when they have been steady, and when the last one was.
    steady: Option<(Instant, Instant)>,
    /// Whether jobs may have been taken over without our knowing which.
    unsure: bool,
}

impl Pulse {
    /// Notes a sign of life; whether they have been steady for as long as it takes others to give theirs.
    fn beat(&mut self) -> bool {
        let now = Instant::now();
        let since = self.steady.filter(|(_, last)| now - *last <= STEADY).map_or(now, |(since, _)| since);
        self.steady = Some((since, now));
        now - since >= Duration::from_millis(DEAD.unsigned_abs())
    }
}

impl Postgres {
    async fn beat(&self, pulse: &mut Pulse) -> Result<Vec<StoredJob>, StoreError> {
        let mut connection = match pulse.connection.take() {
            Some(connection) => connection,
            None => PgConnection::connect_with(&self.options).await?,
        };
        let alive = Statement::new("UPDATE coordinators SET heard = clock_timestamp() WHERE session = $1 AND ended IS NULL");
        if Connection::Postgres(&mut connection).execute(alive.bytes(self.session.name())).await? == 0 {
            return Err(StoreError::Fenced);
        }
        if pulse.beat() {
            let dead = "UPDATE coordinators SET ended = clock_timestamp()
                        WHERE ended IS NULL AND session <> $1 AND heard < clock_timestamp() - $2 * INTERVAL '1 millisecond'";
            let dead = Statement::new(dead).bytes(self.session.name()).integer(DEAD);
            let count = Connection::Postgres(&mut connection).execute(dead).await?;
            if count > 0 {
                tracing::warn!(count, "coordinators gave no sign of life: their jobs are taken over");
            }
        }
        let taken = self.take(&mut connection, pulse).await?;
        pulse.connection = Some(connection);
        Ok(taken)
    }

    /// Takes over jobs that have no living owner.
    async fn take(&self, connection: &mut PgConnection, pulse: &mut Pulse) -> Result<Vec<StoredJob>, StoreError> {
        let orphans =
            "SELECT 1 FROM jobs WHERE owner IS NULL OR owner IN (SELECT session FROM coordinators WHERE ended IS NOT NULL) LIMIT 1";
        let unsure = std::mem::replace(&mut pulse.unsure, true);
        let mut transaction = connection.begin().await?;
        let mut on = Connection::Postgres(&mut transaction);
        if !unsure && on.first(Statement::new(orphans)).await?.is_none() {
            pulse.unsure = false;
            return Ok(Vec::new());
        }
        let living = Statement::new("SELECT 1 FROM coordinators WHERE session = $1 AND ended IS NULL FOR SHARE");
        if on.first(living.bytes(self.session.name())).await?.is_none() {
            return Err(StoreError::Fenced);
        }
        let take = "UPDATE jobs SET owner = $1 WHERE id IN (
                        SELECT id FROM jobs
                        WHERE owner IS NULL OR owner IN (SELECT session FROM coordinators WHERE ended IS NOT NULL)
                        FOR UPDATE SKIP LOCKED)
                    RETURNING id";
        let mut taken: Vec<JobId> = Vec::new();
        let note = |row: Row| {
            taken.push(row.job("id")?);
            Ok(())
        };
        on.each(Statement::new(take).bytes(self.session.name()), note).await?;
        if unsure {
            let mine = Statement::new("SELECT id FROM jobs WHERE owner = $1").bytes(self.session.name());
            taken.clear();
            let note = |row: Row| {
                taken.push(row.job("id")?);
                Ok(())
            };
            on.each(mine, note).await?;
        }
        let mut jobs = Vec::new();
        if taken.len() > MANY {
            jobs = read::jobs(&mut on, Scope::All).await?;
            taken.sort_unstable();
            jobs.retain(|job| taken.binary_search(&job.record.id).is_ok());
        } else {
            for job in taken {
                jobs.extend(read::jobs(&mut on, Scope::Job(job)).await?);
            }
        }
        transaction.commit().await?;
        pulse.unsure = false;
        Ok(jobs)
    }
}

#[async_trait]
impl Cluster for Postgres {
    async fn adopt(&self) -> Result<Vec<StoredJob>, StoreError> {
        let pulse = &mut *self.pulse.lock().await;
        let pulse = tokio::sync::Mutex::new(pulse);
        // A connection on which something failed is not used again: `beat` gives it back only when all went well.
        let beat = || async {
            let pulse = &mut *pulse.lock().await;
            match tokio::time::timeout(TRY, self.beat(pulse)).await {
                Ok(outcome) => outcome,
                Err(_) => Err(StoreError::Database(sqlx::Error::PoolTimedOut)),
            }
        };
        patiently("give a sign of life", beat).await
    }

    async fn owner(&self, job: JobId) -> Result<Option<Owner>, StoreError> {
        let owner = "SELECT owner, http FROM jobs LEFT JOIN coordinators ON session = owner AND ended IS NULL WHERE id = $1";
        patiently("read owner", || async {
            let mut connection = self.readers.acquire().await?;
            let row = Connection::Postgres(&mut connection).first(Statement::new(owner).bytes(&job.to_bytes())).await?;
            let Some(row) = row else { return Ok(None) };
            if row.bytes_if("owner")?.as_deref() == Some(self.session.name()) {
                return Ok(Some(Owner::Here));
            }
            Ok(Some(row.text_if("http")?.map_or(Owner::Nobody, Owner::At)))
        })
        .await
    }

    async fn peers(&self) -> Result<Vec<Presence>, StoreError> {
        let peers = "SELECT place, http, grpc FROM coordinators WHERE ended IS NULL AND session <> $1 AND http <> '' ORDER BY session";
        patiently("read coordinators", || async {
            let mut peers_found = Vec::new();
            let each = |row: Row| {
                let place = Uuid::from_bytes(row.array("place")?);
                peers_found.push(Presence { place, http: row.text("http")?, grpc: row.text("grpc")? });
                Ok(())
            };
            let mut connection = self.readers.acquire().await?;
            Connection::Postgres(&mut connection).each(Statement::new(peers).bytes(self.session.name()), each).await?;
            Ok(peers_found)
        })
        .await
    }

    async fn job_of_token(&self, token: &str) -> Result<Option<JobRecord>, StoreError> {
        patiently("read token", || async {
            let mut transaction = self.readers.begin_with("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY").await?;
            let mut on = Connection::Postgres(&mut transaction);
            let found = on.first(Statement::new("SELECT id FROM jobs WHERE client_token = $1").text(token)).await?;
            let Some(row) = found else { return Ok(None) };
            Ok(read::jobs(&mut on, Scope::Job(row.job("id")?)).await?.pop().map(|job| job.record))
        })
        .await
    }

    async fn leave(&self) -> Result<(), StoreError> {
        let mut connection = self.readers.acquire().await?;
        let leave = Statement::new("UPDATE coordinators SET ended = clock_timestamp() WHERE session = $1 AND ended IS NULL");
        Connection::Postgres(&mut connection).execute(leave.bytes(self.session.name())).await?;
        Ok(())
    }
}
