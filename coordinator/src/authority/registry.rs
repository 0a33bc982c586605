//! Who was enrolled, who was thrown out, and the join tokens that let new ones in.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use gradfarm_proto::{WorkerIdentity, WorkerKind, is_pool_name};
use serde::{Deserialize, Serialize};

use super::certificates::{Authority, AuthorityError};
use super::join::{Join, JoinView, NewJoin, Spent};
use crate::access::{Secret, check_name, decode, encode, hash, id_of};
use crate::clock::{Clock, Timestamp};
use crate::error::Error;
use crate::job::WorkerId;
use crate::store::{Records, StoreError};

/// Records of join tokens, by the hash of their secret.
const JOINS: &str = "join";
/// Records of workers with a name of their own, by that name.
const WORKERS: &str = "worker";
/// How long what the store said of a worker is believed.
const BELIEVED: Duration = Duration::from_secs(1);
/// Most workers whose standing is remembered.
const REMEMBERED: usize = 100_000;
/// Most rows that are listed.
const LISTED: u32 = 100_000;
/// Most workers that may join with one token.
const USES: u32 = 10_000;

/// What is kept of a worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Enrolled {
    /// For people.
    pub name: String,
    /// The pool that it belongs to.
    #[serde(default)]
    pub pool: Option<String>,
    /// When it joined, or was first heard of [ms since 1970].
    pub enrolled_ms: i64,
    /// The join token that it came with.
    #[serde(default)]
    pub join: Option<String>,
    /// When its certificate was last renewed [ms since 1970].
    #[serde(default)]
    pub renewed_ms: Option<i64>,
    /// When it was thrown out [ms since 1970].
    #[serde(default)]
    pub revoked_ms: Option<i64>,
}

/// A worker as it may be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EnrolledView {
    /// Which.
    pub worker: WorkerId,
    /// What is kept of it.
    pub enrolled: Enrolled,
}

/// Why somebody gets no certificate, or is not let in with one.
#[derive(Debug, thiserror::Error)]
pub enum EnrolError {
    /// Nobody has this join token.
    #[error("the join token is not known here")]
    Unknown,
    /// It was used.
    #[error("the join token was used already; `gradfarm join-token create` issues another one")]
    Used,
    /// Its time is over.
    #[error("the join token has expired; `gradfarm join-token create` issues another one")]
    Expired,
    /// The worker was thrown out.
    #[error("worker {0} was revoked")]
    Revoked(WorkerId),
    /// Nobody has ever enrolled this worker.
    #[error("worker {0} was never enrolled here")]
    Stranger(WorkerId),
    /// The request is no request.
    #[error(transparent)]
    Request(#[from] AuthorityError),
    /// Something about it is out of range.
    #[error("{0}")]
    Invalid(String),
    /// The store does not answer.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// The register of workers.
pub struct Registry {
    authority: Arc<Authority>,
    records: Arc<dyn Records>,
    clock: Clock,
    ttl: Duration,
    known: Mutex<HashMap<WorkerId, (Instant, Option<Enrolled>)>>,
}

impl Registry {
    /// A register whose certificates are good for `ttl`.
    pub fn new(authority: Arc<Authority>, records: Arc<dyn Records>, ttl: Duration) -> Self {
        Self { authority, records, clock: Clock::new(), ttl, known: Mutex::default() }
    }

    /// The authority that signs.
    pub fn authority(&self) -> &Authority {
        &self.authority
    }

    /// Issues a join token: what is kept of it, and the token, which is kept nowhere.
    ///
    /// # Errors
    /// If something about it is out of range, or the store fails.
    pub async fn create_join(&self, new: NewJoin, by: &str) -> Result<(JoinView, Secret), Error> {
        if let Some(pool) = new.pool.as_ref().filter(|pool| !is_pool_name(pool)) {
            let found = format!("{:?}", pool.chars().take(80).collect::<String>());
            return Err(Error::Invalid { what: "pool", found, expected: "1 to 64 letters, digits, dots, hyphens or underscores".into() });
        }
        if !(1..=USES).contains(&new.uses) {
            return Err(Error::Invalid { what: "uses", found: new.uses.to_string(), expected: format!("1 to {USES}") });
        }
        let secret = Secret::draw("gfj_").map_err(|fault| Error::Io { what: "join token".into(), source: std::io::Error::other(fault) })?;
        let now = self.clock.now();
        let (created_ms, expires_ms) = (now.millis(), (now + new.ttl).millis());
        let join = Join { pool: new.pool, left: new.uses, created_ms, expires_ms, issued_by: by.to_owned() };
        let key = secret.hash();
        if !self.records.replace_record(JOINS, &key, None, Some(&encode(&join)?)).await? {
            return Err(StoreError::Conflict { change: "a new join token".into() }.into());
        }
        Ok((JoinView { id: id_of(&key), join }, secret))
    }

    /// All join tokens, newest first.
    ///
    /// # Errors
    /// If the store fails.
    pub async fn joins(&self) -> Result<Vec<JoinView>, Error> {
        let rows = self.records.records(JOINS, None, LISTED).await?;
        let view = |(key, row): (String, Vec<u8>)| Ok(JoinView { id: id_of(&key), join: decode(JOINS, &key, &row)? });
        let mut joins = rows.into_iter().map(view).collect::<Result<Vec<_>, StoreError>>()?;
        joins.sort_by_key(|view| std::cmp::Reverse(view.join.created_ms));
        Ok(joins)
    }

    /// Takes a join token back: nobody joins with it any more.
    ///
    /// # Errors
    /// [`Error::NoToken`], or if the store fails.
    pub async fn revoke_join(&self, id: &str) -> Result<JoinView, Error> {
        loop {
            let rows = self.records.records(JOINS, None, LISTED).await?;
            let found = rows.into_iter().find(|(key, _)| id_of(key) == id);
            let (key, row) = found.ok_or_else(|| Error::NoToken(id.chars().take(80).collect()))?;
            let join = Join { left: 0, ..decode(JOINS, &key, &row)? };
            if self.records.replace_record(JOINS, &key, Some(&row), Some(&encode(&join)?)).await? {
                return Ok(JoinView { id: id.to_owned(), join });
            }
        }
    }

    /// Enrols a worker: uses the token up, gives the worker a name, signs its key. The token is used up first, so that a crash in
    /// between costs a token and never lets two in.
    ///
    /// # Errors
    /// Why it is not enrolled.
    pub async fn enrol(&self, token: &str, request: &[u8], name: &str) -> Result<String, EnrolError> {
        check_name("name", name).map_err(|fault| EnrolError::Invalid(fault.to_string()))?;
        let key = hash(token);
        let worker = draw_worker()?;
        let (join, now, certificate) = loop {
            let row = self.records.record(JOINS, &key).await?.ok_or(EnrolError::Unknown)?;
            let (join, now): (Join, _) = (decode(JOINS, &key, &row)?, self.now());
            let rest = join.use_once(now).map_err(|spent| match spent {
                Spent::Used => EnrolError::Used,
                Spent::Expired => EnrolError::Expired,
            })?;
            // Signed before the token is touched: a request that is none must not cost one.
            let certificate = self.authority.worker(request, worker, join.pool.as_deref(), now, self.ttl)?;
            if self.records.replace_record(JOINS, &key, Some(&row), Some(&encode(&rest)?)).await? {
                break (join, now, certificate);
            }
        };
        let (name, join_id) = (name.to_owned(), Some(id_of(&key)));
        let enrolled = Enrolled { name, pool: join.pool, enrolled_ms: now.millis(), join: join_id, renewed_ms: None, revoked_ms: None };
        self.records.replace_record(WORKERS, &worker.to_string(), None, Some(&encode(&enrolled)?)).await?;
        tracing::info!(%worker, name = %enrolled.name, pool = enrolled.pool.as_deref(), "worker enrolled");
        Ok(certificate)
    }

    /// A new certificate for a worker that has a good one of ours.
    ///
    /// # Errors
    /// Why it gets none.
    pub async fn renew(&self, identity: &WorkerIdentity, request: &[u8]) -> Result<String, EnrolError> {
        let worker = WorkerId::from_bytes(identity.worker);
        if !identity.ours {
            return Err(EnrolError::Invalid("this certificate is of another authority, which renews it".into()));
        }
        loop {
            let key = worker.to_string();
            let row = self.records.record(WORKERS, &key).await?.ok_or(EnrolError::Stranger(worker))?;
            let enrolled: Enrolled = decode(WORKERS, &key, &row)?;
            if enrolled.revoked_ms.is_some() {
                return Err(EnrolError::Revoked(worker));
            }
            let now = self.clock.now();
            // The pool is the register's: the old certificate's may have been changed since.
            let certificate = self.authority.worker(request, worker, enrolled.pool.as_deref(), now, self.ttl)?;
            let renewed = Enrolled { renewed_ms: Some(now.millis()), ..enrolled };
            if self.records.replace_record(WORKERS, &key, Some(&row), Some(&encode(&renewed)?)).await? {
                return Ok(certificate);
            }
        }
    }

    /// Whether a worker with a good certificate may work: it was enrolled here, if the certificate is ours, was not thrown out, and its
    /// time is not over.
    ///
    /// # Errors
    /// Why not.
    pub async fn admit(&self, identity: &WorkerIdentity) -> Result<(), EnrolError> {
        let worker = WorkerId::from_bytes(identity.worker);
        if identity.validity.1 <= self.now().millis() / 1000 {
            return Err(EnrolError::Invalid("the certificate has expired".into()));
        }
        match self.standing(worker).await? {
            Some(enrolled) if enrolled.revoked_ms.is_some() => Err(EnrolError::Revoked(worker)),
            None if identity.ours => Err(EnrolError::Stranger(worker)),
            _ => Ok(()),
        }
    }

    async fn standing(&self, worker: WorkerId) -> Result<Option<Enrolled>, StoreError> {
        let lock = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((read, standing)) = lock().get(&worker)
            && read.elapsed() < BELIEVED
        {
            return Ok(standing.clone());
        }
        let key = worker.to_string();
        let row = self.records.record(WORKERS, &key).await?;
        let standing = row.map(|row| decode::<Enrolled>(WORKERS, &key, &row)).transpose()?;
        let mut known = lock();
        if known.len() >= REMEMBERED {
            known.clear();
        }
        known.insert(worker, (Instant::now(), standing.clone()));
        Ok(standing)
    }

    /// All workers that were ever enrolled or thrown out, newest first.
    ///
    /// # Errors
    /// If the store fails.
    pub async fn workers(&self) -> Result<Vec<EnrolledView>, Error> {
        let mut views = Vec::new();
        for (key, row) in self.records.records(WORKERS, None, LISTED).await? {
            let Ok(worker) = key.parse() else { continue };
            views.push(EnrolledView { worker, enrolled: decode(WORKERS, &key, &row)? });
        }
        views.sort_by_key(|view| std::cmp::Reverse(view.enrolled.enrolled_ms));
        Ok(views)
    }

    /// Throws a worker out: it is not let in any more, gets no new certificate, and its session ends within seconds. One with a
    /// certificate of another authority need not be known here before.
    ///
    /// # Errors
    /// [`Error::NoWorker`] for a name that no certificate can have, or if the store fails.
    pub async fn revoke(&self, worker: WorkerId) -> Result<EnrolledView, Error> {
        if WorkerKind::of(worker.to_bytes()) != WorkerKind::Enrolled {
            return Err(Error::NoWorker(worker));
        }
        loop {
            let (key, now) = (worker.to_string(), self.now().millis());
            let row = self.records.record(WORKERS, &key).await?;
            let known = row.as_ref().map(|row| decode::<Enrolled>(WORKERS, &key, row)).transpose()?;
            let name = "of another authority".to_owned();
            let enrolled = known.unwrap_or(Enrolled { name, pool: None, enrolled_ms: now, join: None, renewed_ms: None, revoked_ms: None });
            let enrolled = Enrolled { revoked_ms: enrolled.revoked_ms.or(Some(now)), ..enrolled };
            let stored = self.records.replace_record(WORKERS, &key, row.as_deref(), Some(&encode(&enrolled)?)).await?;
            self.known.lock().unwrap_or_else(PoisonError::into_inner).remove(&worker);
            if stored {
                tracing::warn!(%worker, name = %enrolled.name, "worker revoked");
                return Ok(EnrolledView { worker, enrolled });
            }
        }
    }

    fn now(&self) -> Timestamp {
        self.clock.now()
    }
}

/// A name for a worker, by chance.
fn draw_worker() -> Result<WorkerId, EnrolError> {
    let random = Secret::draw("").map_err(|fault| EnrolError::Invalid(fault.to_string()))?;
    let mut bits = [0; 16];
    bits.copy_from_slice(&blake3::hash(random.expose().as_bytes()).as_bytes()[..16]);
    Ok(WorkerId::from_bytes(WorkerKind::enrolled(bits)))
}

impl fmt::Debug for Registry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Registry").field("ttl", &self.ttl).finish_non_exhaustive()
    }
}
