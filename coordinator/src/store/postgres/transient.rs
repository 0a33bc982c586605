//! Errors that say nothing of what is stored, and how long they are borne.

use std::future::Future;
use std::time::{Duration, Instant};

use crate::store::StoreError;

/// How long a database may be away.
const PATIENCE: Duration = Duration::from_secs(60);
/// Between tries: from the first pause, doubling, up to the longest.
const PAUSES: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

/// Tries until it works, fails for good, or the patience is over.
pub(super) async fn patiently<T, F: Future<Output = Result<T, StoreError>>>(
    what: &'static str,
    mut attempt: impl FnMut() -> F,
) -> Result<T, StoreError> {
    let start = Instant::now();
    let mut pause = PAUSES.0;
    loop {
        match attempt().await {
            Err(error) if is_transient(&error) => {
                let away = start.elapsed();
                if away >= PATIENCE {
                    return Err(StoreError::Unreachable { seconds: away.as_secs(), source: Box::new(error) });
                }
                tracing::warn!(what, %error, seconds = away.as_secs(), "the database is away, trying again");
            }
            outcome => return outcome,
        }
        tokio::time::sleep(pause).await;
        pause = (pause * 2).min(PAUSES.1);
    }
}

/// Whether another try may end otherwise.
fn is_transient(error: &StoreError) -> bool {
    match error {
        StoreError::Database(error) => is_transient_in_sqlx(error),
        StoreError::Migrate(sqlx::migrate::MigrateError::Execute(error)) => is_transient_in_sqlx(error),
        _ => false,
    }
}

fn is_transient_in_sqlx(error: &sqlx::Error) -> bool {
    match error {
        sqlx::Error::Io(_) | sqlx::Error::PoolTimedOut | sqlx::Error::WorkerCrashed => true,
        // A server that is going down says so, or breaks off in the middle of a message.
        sqlx::Error::Protocol(_) | sqlx::Error::Tls(_) => true,
        sqlx::Error::Database(error) => error.code().is_some_and(|code| is_transient_code(&code)),
        _ => false,
    }
}

/// Connection exceptions, lack of resources, a server that starts or stops, a standby that does not write yet, deadlocks and timeouts.
fn is_transient_code(code: &str) -> bool {
    let classes = ["08", "53", "57", "58"];
    let codes = ["25006", "25P03", "40001", "40P01", "55P03"];
    classes.iter().any(|class| code.starts_with(class)) || codes.contains(&code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_that_is_away_is_told_from_one_that_refuses() {
        for away in ["08006", "57P01", "57P03", "53300", "40P01", "25006"] {
            assert!(is_transient_code(away), "{away}");
        }
        for refusal in ["28P01", "3D000", "42P01", "23503", "22021"] {
            assert!(!is_transient_code(refusal), "{refusal}");
        }
        assert!(is_transient(&sqlx::Error::PoolTimedOut.into()));
        assert!(!is_transient(&StoreError::Fenced));
        assert!(!is_transient(&sqlx::Error::RowNotFound.into()));
    }
}
