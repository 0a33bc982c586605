//! The gate: knows every token through the store, and tells who somebody is.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::audit::Audit;
use super::oidc::{self, Oidc, OidcError, OidcOptions};
use super::rate::{Buckets, Rate};
use super::role::Role;
use super::secret::{self, Secret};
use super::token::{Caller, Denied, Token, id_of};
use crate::clock::{Clock, Timestamp};
use crate::error::Error;
use crate::store::{Records, StoreError};

/// Records of tokens, by the hash of their secret.
const TOKENS: &str = "token";
/// Records of when a token was last used, by the same.
const USES: &str = "token-use";
/// How long what the store said of a token is believed: so long a token lives on at other coordinators after it was revoked at one.
const BELIEVED: Duration = Duration::from_secs(2);
/// How exactly the last use is known.
const USE_EVERY: Duration = Duration::from_secs(60);
/// Most tokens whose standing is remembered.
const REMEMBERED: usize = 10_000;
/// Most tokens that are listed.
const LISTED: u32 = 10_000;
/// Longest name of a token, and of a project [bytes].
const NAME: usize = 200;
/// Most projects of a token.
const PROJECTS: usize = 100;

/// Knows who is let in.
pub struct Gate {
    records: Arc<dyn Records>,
    clock: Clock,
    known: Mutex<HashMap<String, Known>>,
    audit: Audit,
    oidc: Option<Oidc>,
    buckets: Mutex<Buckets>,
    /// The worker of this very process, by the hash of a secret that never leaves it.
    in_process: String,
    in_process_secret: Secret,
}

/// What the store said of a token a moment ago.
struct Known {
    token: Token,
    read: Instant,
    used: Option<Instant>,
}

/// A token to be issued.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewToken {
    /// For people, 1 to 200 bytes.
    pub name: String,
    /// What its bearer may do.
    pub role: Role,
    /// The projects that it is for; all if there are none.
    pub projects: Vec<String>,
    /// How long it is good; for ever if absent.
    pub ttl: Option<Duration>,
}

/// A token just issued: the only time that its secret is shown.
#[derive(Clone, Debug)]
pub struct Issued {
    /// What it is called from now on.
    pub view: TokenView,
    /// The token itself.
    pub secret: Secret,
}

/// A token as it may be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TokenView {
    /// What it is called: part of its hash.
    pub id: String,
    /// What is kept of it.
    pub token: Token,
    /// When it was last used, to a minute.
    pub used: Option<Timestamp>,
}

/// Why somebody does not pass.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// As the credential stands.
    #[error(transparent)]
    Denied(#[from] Denied),
    /// Nobody knows, for the store does not answer.
    #[error(transparent)]
    Store(#[from] StoreError),
}

#[derive(Serialize, Deserialize)]
struct Use {
    used_ms: i64,
}

impl Gate {
    /// A gate over what the store keeps.
    ///
    /// # Panics
    /// If the system has no random numbers: then nothing can be kept secret from anybody.
    #[allow(clippy::expect_used)]
    pub fn new(records: Arc<dyn Records>) -> Self {
        let in_process_secret = Secret::draw("gfp_").expect("random numbers");
        let in_process = in_process_secret.hash();
        let audit = Audit::new(records.clone());
        let (known, buckets) = (Mutex::default(), Mutex::default());
        Self { records, clock: Clock::new(), known, audit, oidc: None, buckets, in_process, in_process_secret }
    }

    /// Believes an identity provider, too.
    ///
    /// # Errors
    /// If its address cannot be trusted.
    pub fn with_oidc(mut self, options: OidcOptions) -> Result<Self, OidcError> {
        self.oidc = Some(Oidc::new(options)?);
        Ok(self)
    }

    /// The token of workers that run in this process. It is kept nowhere and dies with the process.
    pub fn in_process_worker(&self) -> Secret {
        self.in_process_secret.clone()
    }

    /// Remembers who changed what.
    pub fn audit(&self) -> &Audit {
        &self.audit
    }

    /// Whether somebody may ask once more; otherwise in how many seconds.
    ///
    /// # Errors
    /// If they ask too often.
    pub(crate) fn bear(&self, who: &str, rate: Rate) -> Result<(), f64> {
        self.buckets.lock().unwrap_or_else(PoisonError::into_inner).take(who, rate, self.now())
    }

    /// The time by which credentials are judged.
    pub(crate) fn now(&self) -> Timestamp {
        self.clock.now()
    }

    /// Who somebody with this token is.
    ///
    /// # Errors
    /// Why they are not let in, or that the store does not answer.
    pub async fn identify(&self, token: Option<&str>) -> Result<Caller, Refusal> {
        let token = token.ok_or(Denied::Missing)?;
        if token.len() > secret::LONGEST {
            return Err(Denied::Malformed.into());
        }
        if let Some(oidc) = self.oidc.as_ref().filter(|_| oidc::is_jwt(token)) {
            return Ok(oidc.identify(token).await?);
        }
        let hash = secret::hash(token);
        // Both are hashes of secrets: how far they agree tells nothing about either.
        if hash == self.in_process {
            let name = "workers of this process".to_owned();
            return Ok(Caller { id: "in-process".to_owned(), name, role: Role::Worker, projects: Vec::new() });
        }
        let token = match self.remembered(&hash) {
            Some(token) => token,
            None => self.read(&hash).await?.ok_or(Denied::Unknown)?,
        };
        token.check(self.now())?;
        self.note_use(&hash).await;
        Ok(token.caller(&hash))
    }

    /// Issues a token. The secret in the answer is kept nowhere.
    ///
    /// # Errors
    /// If something about it is out of range, or the store fails.
    pub async fn issue(&self, asked: NewToken, by: &str) -> Result<Issued, Error> {
        check_name("name", &asked.name)?;
        if asked.projects.len() > PROJECTS {
            let (found, expected) = (format!("{} long", asked.projects.len()), format!("at most {PROJECTS} projects"));
            return Err(Error::Invalid { what: "projects", found, expected });
        }
        asked.projects.iter().try_for_each(|project| check_name("projects", project))?;
        let secret = Secret::draw("gft_").map_err(|fault| Error::Io { what: "token".into(), source: std::io::Error::other(fault) })?;
        let now = self.now();
        let token = Token {
            name: asked.name,
            role: asked.role,
            projects: asked.projects,
            created_ms: now.millis(),
            expires_ms: asked.ttl.map(|ttl| (now + ttl).millis()),
            revoked_ms: None,
            issued_by: by.to_owned(),
        };
        let hash = secret.hash();
        let row = encode(&token)?;
        if !self.records.replace_record(TOKENS, &hash, None, Some(&row)).await? {
            return Err(StoreError::Conflict { change: "a new token".into() }.into());
        }
        Ok(Issued { view: TokenView { id: id_of(&hash), token, used: None }, secret })
    }

    /// All tokens, revoked ones included, newest first.
    ///
    /// # Errors
    /// If the store fails.
    pub async fn tokens(&self) -> Result<Vec<TokenView>, Error> {
        let uses: HashMap<String, Vec<u8>> = self.records.records(USES, None, LISTED).await?.into_iter().collect();
        let mut views = Vec::new();
        for (hash, row) in self.records.records(TOKENS, None, LISTED).await? {
            let used = uses.get(&hash).map(|row| decode::<Use>(USES, &hash, row)).transpose()?;
            let used = used.map(|used| Timestamp::from_millis(used.used_ms));
            views.push(TokenView { id: id_of(&hash), token: decode(TOKENS, &hash, &row)?, used });
        }
        views.sort_by(|a, b| b.token.created_ms.cmp(&a.token.created_ms).then_with(|| a.id.cmp(&b.id)));
        Ok(views)
    }

    /// Takes a token back; from now on it is worth nothing here, and within two seconds nowhere. Taking it back again changes nothing.
    ///
    /// # Errors
    /// [`Error::NoToken`], or if the store fails.
    pub async fn revoke(&self, id: &str) -> Result<TokenView, Error> {
        let no_such = || Error::NoToken(id.chars().take(80).collect());
        loop {
            let rows = self.records.records(TOKENS, None, LISTED).await?;
            let (hash, row) = rows.into_iter().find(|(hash, _)| id_of(hash) == id).ok_or_else(no_such)?;
            let token: Token = decode(TOKENS, &hash, &row)?;
            let revoked = Token { revoked_ms: token.revoked_ms.or(Some(self.now().millis())), ..token };
            let stored = self.records.replace_record(TOKENS, &hash, Some(&row), Some(&encode(&revoked)?)).await?;
            self.known().remove(&hash);
            // Somebody else may have changed it in between: look again.
            if stored {
                return Ok(TokenView { id: id.to_owned(), token: revoked, used: None });
            }
        }
    }

    fn known(&self) -> MutexGuard<'_, HashMap<String, Known>> {
        // Entries are inserted and removed whole.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn remembered(&self, hash: &str) -> Option<Token> {
        self.known().get(hash).filter(|known| known.read.elapsed() < BELIEVED).map(|known| known.token.clone())
    }

    async fn read(&self, hash: &str) -> Result<Option<Token>, StoreError> {
        let Some(row) = self.records.record(TOKENS, hash).await? else { return Ok(None) };
        let token: Token = decode(TOKENS, hash, &row)?;
        let mut known = self.known();
        if known.len() >= REMEMBERED {
            known.clear();
        }
        let used = known.get(hash).and_then(|known| known.used);
        known.insert(hash.to_owned(), Known { token: token.clone(), read: Instant::now(), used });
        Ok(Some(token))
    }

    /// Keeps the time of use, once a minute. That it fails is no reason to turn anybody away.
    async fn note_use(&self, hash: &str) {
        {
            let mut known = self.known();
            let Some(known) = known.get_mut(hash).filter(|known| known.used.is_none_or(|at| at.elapsed() >= USE_EVERY)) else { return };
            known.used = Some(Instant::now());
        }
        if let Err(problem) = self.write_use(hash).await {
            tracing::debug!(%problem, "last use of a token not kept");
        }
    }

    async fn write_use(&self, hash: &str) -> Result<(), StoreError> {
        let before = self.records.record(USES, hash).await?;
        let row = encode(&Use { used_ms: self.now().millis() })?;
        // If somebody else just wrote it, theirs is as good.
        let _written = self.records.replace_record(USES, hash, before.as_deref(), Some(&row)).await?;
        Ok(())
    }
}

/// Names that people read must be short and printable.
///
/// # Errors
/// [`Error::Invalid`].
pub(crate) fn check_name(what: &'static str, name: &str) -> Result<(), Error> {
    if name.is_empty() || name.len() > NAME || name.chars().any(char::is_control) {
        let found = format!("{:?}", name.chars().take(80).collect::<String>());
        return Err(Error::Invalid { what, found, expected: format!("1 to {NAME} bytes without control characters") });
    }
    Ok(())
}

/// A record as it is kept.
///
/// # Errors
/// If it cannot be written down.
pub(crate) fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, StoreError> {
    serde_json::to_vec(value).map_err(|fault| StoreError::Corrupt { row: "a record to be written".into(), found: fault.to_string() })
}

/// A record read back.
///
/// # Errors
/// [`StoreError::Corrupt`].
pub(crate) fn decode<T: for<'a> Deserialize<'a>>(kind: &str, key: &str, row: &[u8]) -> Result<T, StoreError> {
    serde_json::from_slice(row).map_err(|fault| StoreError::Corrupt { row: format!("{kind} {}", id_of(key)), found: fault.to_string() })
}

impl fmt::Debug for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Gate").field("records", &self.records).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Memory;

    fn asked(role: Role, ttl: Option<Duration>) -> NewToken {
        NewToken { name: "anna".into(), role, projects: Vec::new(), ttl }
    }

    fn denied(outcome: Result<Caller, Refusal>) -> Denied {
        match outcome {
            Err(Refusal::Denied(denied)) => denied,
            other => panic!("{other:?}"),
        }
    }

    #[tokio::test]
    async fn only_what_was_issued_and_is_not_over_passes() {
        let store = Arc::new(Memory::new());
        let gate = Gate::new(store.clone());
        let issued = gate.issue(asked(Role::Operator, None), "test").await.unwrap();
        let caller = gate.identify(Some(issued.secret.expose())).await.unwrap();
        assert_eq!((caller.name.as_str(), caller.role, &caller.id), ("anna", Role::Operator, &issued.view.id));
        assert_eq!(denied(gate.identify(None).await), Denied::Missing);
        assert_eq!(denied(gate.identify(Some("gft_wrong")).await), Denied::Unknown);
        assert_eq!(denied(gate.identify(Some(&"x".repeat(1 << 20))).await), Denied::Malformed);
        let brief = gate.issue(asked(Role::Admin, Some(Duration::ZERO)), "test").await.unwrap();
        assert_eq!(denied(gate.identify(Some(brief.secret.expose())).await), Denied::Expired { name: "anna".into() });

        // Another coordinator on the same store knows it, too, and hears of the end of it.
        let other = Gate::new(store);
        gate.revoke(&issued.view.id).await.unwrap();
        for gate in [&gate, &other] {
            assert_eq!(denied(gate.identify(Some(issued.secret.expose())).await), Denied::Revoked { name: "anna".into() });
        }
        assert!(matches!(gate.revoke("nothing").await, Err(Error::NoToken(_))));
        assert_eq!(denied(other.identify(Some(gate.in_process_worker().expose())).await), Denied::Unknown);
    }

    #[tokio::test]
    async fn the_store_never_sees_a_secret_and_the_list_tells_the_last_use() {
        let store = Arc::new(Memory::new());
        let gate = Gate::new(store.clone());
        let issued = gate.issue(asked(Role::Viewer, None), "test").await.unwrap();
        assert_eq!(gate.tokens().await.unwrap()[0].used, None);
        gate.identify(Some(issued.secret.expose())).await.unwrap();
        let listed = gate.tokens().await.unwrap();
        assert_eq!((listed.len(), &listed[0].id), (1, &issued.view.id));
        assert!(listed[0].used.is_some());
        for kind in [TOKENS, USES] {
            for (key, row) in store.records(kind, None, 10).await.unwrap() {
                let all = format!("{key} {}", String::from_utf8(row).unwrap());
                assert!(!all.contains(issued.secret.expose()) && !all.contains(&issued.secret.expose()[4..]), "{all}");
            }
        }
    }

    #[tokio::test]
    async fn names_are_checked() {
        let gate = Gate::new(Arc::new(Memory::new()));
        for name in ["", "a\nb", &"x".repeat(201)] {
            let new = NewToken { name: name.to_owned(), ..asked(Role::Viewer, None) };
            assert!(matches!(gate.issue(new, "test").await, Err(Error::Invalid { what: "name", .. })), "{name:?}");
        }
    }
}
