//! A token as it is kept, and what it is worth at a given time.

use serde::{Deserialize, Serialize};

use super::role::Role;
use crate::clock::Timestamp;

/// What is kept of a token, under the hash of its secret.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Token {
    /// For people: whose it is, or what it is for.
    pub name: String,
    /// What its bearer may do.
    pub role: Role,
    /// The projects that it is for; all if there are none.
    #[serde(default)]
    pub projects: Vec<String>,
    /// When it was issued [ms since 1970].
    pub created_ms: i64,
    /// From when on it is worth nothing [ms since 1970]; never if absent.
    #[serde(default)]
    pub expires_ms: Option<i64>,
    /// When it was revoked [ms since 1970].
    #[serde(default)]
    pub revoked_ms: Option<i64>,
    /// Who issued it.
    pub issued_by: String,
}

/// Why somebody is not let in, or may not do something. The texts name what is missing and never what was sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// No credential at all.
    #[error("no token was sent, expected a header `Authorization: Bearer TOKEN`")]
    Missing,
    /// The header is of another kind or unreadable.
    #[error("the header `Authorization` is not `Bearer` and a token")]
    Malformed,
    /// Nobody has this token.
    #[error("the token is not known here")]
    Unknown,
    /// It was good once.
    #[error("the token {name:?} has expired")]
    Expired {
        /// The token's name.
        name: String,
    },
    /// It was taken back.
    #[error("the token {name:?} was revoked")]
    Revoked {
        /// The token's name.
        name: String,
    },
    /// An identity provider's token, and something is wrong with it.
    #[error("the identity provider's token is not taken: {reason}")]
    Provider {
        /// What.
        reason: String,
    },
    /// The identity provider knows them, and gives them no role here.
    #[error("{who:?} has no role in this farm: the claim {claim:?} of their token names none of viewer, submitter, operator and admin")]
    NoRole {
        /// Whose token it is.
        who: String,
        /// Where a role was looked for.
        claim: String,
    },
    /// Good, but not for this.
    #[error("this needs the role {needed}; {who:?} has the role {found}")]
    Role {
        /// What it would take.
        needed: Role,
        /// What it is.
        found: Role,
        /// Whose it is.
        who: String,
    },
    /// For other projects.
    #[error("{who:?} has no access to the project {project:?}")]
    Project {
        /// The project.
        project: String,
        /// Whose it is.
        who: String,
    },
}

impl Denied {
    /// Whether another credential is called for, rather than more rights for this one.
    pub fn is_about_identity(&self) -> bool {
        !matches!(self, Denied::Role { .. } | Denied::Project { .. } | Denied::NoRole { .. })
    }
}

/// Somebody who was let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// Which credential: a token's identifier, or the subject that an identity provider names.
    pub id: String,
    /// Its name, for people.
    pub name: String,
    /// What it may do.
    pub role: Role,
    /// The projects that it is for; all if there are none.
    pub projects: Vec<String>,
}

impl Caller {
    /// Whether this caller may do what needs a role.
    ///
    /// # Errors
    /// [`Denied::Role`].
    pub fn require(&self, needed: Role) -> Result<(), Denied> {
        if self.role.covers(needed) {
            return Ok(());
        }
        Err(Denied::Role { needed, found: self.role, who: self.name.clone() })
    }

    /// Whether this caller may see and change a project's jobs.
    ///
    /// # Errors
    /// [`Denied::Project`].
    pub fn require_project(&self, project: &str) -> Result<(), Denied> {
        if self.projects.is_empty() || self.projects.iter().any(|mine| mine == project) {
            return Ok(());
        }
        Err(Denied::Project { project: project.to_owned(), who: self.name.clone() })
    }
}

impl Token {
    /// Whether it is good at this time.
    ///
    /// # Errors
    /// [`Denied::Revoked`] or [`Denied::Expired`].
    pub fn check(&self, now: Timestamp) -> Result<(), Denied> {
        if self.revoked_ms.is_some() {
            return Err(Denied::Revoked { name: self.name.clone() });
        }
        if self.expires_ms.is_some_and(|end| end <= now.millis()) {
            return Err(Denied::Expired { name: self.name.clone() });
        }
        Ok(())
    }

    /// Its bearer, by the hash of its secret.
    pub(super) fn caller(&self, hash: &str) -> Caller {
        Caller { id: id_of(hash), name: self.name.clone(), role: self.role, projects: self.projects.clone() }
    }
}

/// What a token is called where it must not be shown: the first 48 bits of its hash.
pub(crate) fn id_of(hash: &str) -> String {
    hash.chars().take(12).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn token(expires_ms: Option<i64>, revoked_ms: Option<i64>) -> Token {
        let (name, issued_by) = ("anna".to_owned(), "test".to_owned());
        Token { name, role: Role::Submitter, projects: vec!["hall".into()], created_ms: 0, expires_ms, revoked_ms, issued_by }
    }

    #[test]
    fn a_token_is_good_until_its_end_and_not_at_it() {
        let at = Timestamp::from_millis;
        assert_eq!(token(Some(10), None).check(at(9)), Ok(()));
        assert_eq!(token(Some(10), None).check(at(10)), Err(Denied::Expired { name: "anna".into() }));
        assert_eq!(token(None, None).check(at(i64::MAX)), Ok(()));
        assert_eq!(token(None, Some(1)).check(at(0)), Err(Denied::Revoked { name: "anna".into() }));
    }

    #[test]
    fn a_caller_has_its_role_and_its_projects() {
        let caller = token(None, None).caller(&"0123456789abcdef".repeat(4));
        assert_eq!(caller.id, "0123456789ab");
        assert!(caller.require(Role::Viewer).is_ok() && caller.require(Role::Submitter).is_ok());
        let denied = caller.require(Role::Operator).unwrap_err();
        assert_eq!(denied.to_string(), "this needs the role operator; \"anna\" has the role submitter");
        assert!(!denied.is_about_identity() && Denied::Unknown.is_about_identity());
        assert!(caller.require_project("hall").is_ok() && caller.require_project("door").is_err());
        assert!(Caller { projects: Vec::new(), ..caller }.require_project("door").is_ok());
    }

    #[test]
    fn what_is_kept_reads_back() {
        let kept = token(Some(5), None);
        let text = serde_json::to_string(&kept).unwrap();
        assert_eq!(serde_json::from_str::<Token>(&text).unwrap(), kept);
        let old = r#"{"name": "n", "role": "viewer", "created_ms": 1, "issued_by": "x"}"#;
        assert_eq!(serde_json::from_str::<Token>(old).unwrap().expires_ms, None);
    }
}
