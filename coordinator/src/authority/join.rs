//! A join token: lets a worker that nobody knows ask for its first certificate.

use serde::{Deserialize, Serialize};

use crate::clock::Timestamp;

/// What is kept of a join token, under the hash of its secret.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Join {
    /// The pool that its workers belong to.
    #[serde(default)]
    pub pool: Option<String>,
    /// How many workers may still join with it.
    pub left: u32,
    /// When it was issued [ms since 1970].
    pub created_ms: i64,
    /// From when on nobody joins with it [ms since 1970].
    pub expires_ms: i64,
    /// Who issued it.
    pub issued_by: String,
}

/// A join token to be issued.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewJoin {
    /// The pool that its workers belong to.
    pub pool: Option<String>,
    /// How many workers may join with it, 1 to 10,000.
    pub uses: u32,
    /// How long it is good.
    pub ttl: std::time::Duration,
}

/// A join token as it may be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JoinView {
    /// What it is called: part of its hash.
    pub id: String,
    /// What is kept of it.
    pub join: Join,
}

/// Why nobody joins with a token. Whoever asks has the token or guesses: neither is told more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spent {
    /// As many as it was for have joined.
    Used,
    /// Its time is over.
    Expired,
}

impl Join {
    /// What is left of it after one more worker has joined.
    pub(super) fn use_once(&self, now: Timestamp) -> Result<Self, Spent> {
        if self.expires_ms <= now.millis() {
            return Err(Spent::Expired);
        }
        let left = self.left.checked_sub(1).ok_or(Spent::Used)?;
        Ok(Self { left, ..self.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_used_up_and_runs_out() {
        let at = Timestamp::from_millis;
        let join = Join { pool: None, left: 2, created_ms: 0, expires_ms: 10, issued_by: "test".into() };
        let once = join.use_once(at(9)).unwrap();
        assert_eq!(once.left, 1);
        let twice = once.use_once(at(9)).unwrap();
        assert_eq!(twice.use_once(at(9)), Err(Spent::Used));
        assert_eq!(join.use_once(at(10)), Err(Spent::Expired));
    }
}
