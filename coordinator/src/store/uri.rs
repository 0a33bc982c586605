//! Which store: `sqlite:PATH` or `postgres://…`.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use sqlx::postgres::PgConnectOptions;

use super::{Postgres, Presence, Sqlite, Store, StoreError};

/// Where jobs are kept. Shows itself without passwords.
#[derive(Clone)]
pub enum StoreUri {
    /// In a file.
    Sqlite(PathBuf),
    /// On a PostgreSQL server.
    Postgres(Box<PgConnectOptions>),
}

/// Why a text names no store.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}; expected sqlite:PATH or postgres://USER:PASSWORD@HOST:PORT/DATABASE")]
pub struct ParseStoreError {
    reason: String,
}

impl StoreUri {
    /// The usual file in a data folder.
    pub fn in_folder(folder: &Path) -> Self {
        StoreUri::Sqlite(folder.join("farm.db"))
    }

    /// Opens the store and brings its tables up to date. `durable` waits for the disk, where that is ours to say.
    ///
    /// # Errors
    /// If it cannot be reached, is damaged, or is of a newer version.
    pub async fn open(&self, durable: bool, presence: &Presence) -> Result<Arc<dyn Store>, StoreError> {
        Ok(match self {
            StoreUri::Sqlite(file) => Arc::new(Sqlite::open(file, durable).await?),
            StoreUri::Postgres(options) => Arc::new(Postgres::open(options, presence).await?),
        })
    }
}

impl FromStr for StoreUri {
    type Err = ParseStoreError;

    fn from_str(text: &str) -> Result<Self, ParseStoreError> {
        let refused = |reason: String| ParseStoreError { reason };
        match text.split_once(':') {
            Some(("sqlite", path)) => {
                let path = path.strip_prefix("//").unwrap_or(path);
                if path.is_empty() { Err(refused("the path is empty".into())) } else { Ok(StoreUri::Sqlite(path.into())) }
            }
            Some(("postgres" | "postgresql", _)) => {
                // What the parser complains of may hold the password: only its kind is told.
                let options = PgConnectOptions::from_str(text).map_err(|_| refused("this is no address of a database".into()))?;
                Ok(StoreUri::Postgres(Box::new(options.application_name("gradfarm"))))
            }
            Some((scheme, _)) if scheme.chars().all(|c| c.is_ascii_alphanumeric()) => {
                Err(refused(format!("there are no stores of kind {scheme:?}")))
            }
            _ => Err(refused("the kind of store is missing".into())),
        }
    }
}

impl fmt::Display for StoreUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StoreUri::Sqlite(file) => write!(f, "sqlite:{}", file.display()),
            StoreUri::Postgres(options) => {
                let database = options.get_database().unwrap_or(options.get_username());
                write!(f, "postgres://{}:{}/{database}", options.get_host(), options.get_port())
            }
        }
    }
}

impl fmt::Debug for StoreUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "StoreUri({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stores_have_names_that_hide_passwords() {
        let shown = |text: &str| text.parse::<StoreUri>().unwrap().to_string();
        assert_eq!(shown("sqlite:farm.db"), "sqlite:farm.db");
        assert_eq!(shown("sqlite:///var/farm.db"), "sqlite:/var/farm.db");
        let database = "postgres://farm:secret@db.example:5433/jobs?sslmode=require";
        assert_eq!(shown(database), "postgres://db.example:5433/jobs");
        assert!(!format!("{:?}", database.parse::<StoreUri>().unwrap()).contains("secret"));
        for bad in ["", "farm.db", "sqlite:", "mysql://farm:secret@host", "postgres://farm:secret@host:port/x"] {
            let refused = bad.parse::<StoreUri>().unwrap_err().to_string();
            assert!(refused.contains("expected sqlite:PATH") && !refused.contains("secret"), "{refused}");
        }
    }
}
