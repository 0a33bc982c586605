//! What a worker shows the coordinator: a token, read again before every connection, since it may not be there yet or be replaced.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};

use tonic::metadata::{Ascii, MetadataValue};
use tonic::service::Interceptor;
use tonic::{Request, Status};

/// Largest token file that is read [bytes].
const LARGEST: u64 = 64 << 10;

/// What a worker shows, and where that comes from.
#[derive(Clone, Default, PartialEq, Eq)]
pub enum Credential {
    /// There is none.
    #[default]
    None,
    /// It is given.
    Token(String),
    /// The worker runs in the coordinator's own process.
    InProcess {
        /// The token.
        token: String,
        /// The authority of the coordinator's certificate (PEM), if connections are encrypted.
        authority: Option<String>,
    },
    /// The worker joins the farm, and has a certificate from then on.
    Enrolment {
        /// The file to join with; not needed by a worker that has joined.
        join: Option<PathBuf>,
        /// Folder for key and certificate, for this worker alone.
        state: PathBuf,
    },
    /// The worker has a certificate of another authority.
    Certificate {
        /// The certificate (PEM); read again when it changes.
        certificate: PathBuf,
        /// Its key (PEM).
        key: PathBuf,
    },
    /// It stands in a file, which may not be there yet.
    File(PathBuf),
}

impl fmt::Debug for Credential {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("None"),
            Self::Token(_) => f.write_str("Token(…)"),
            Self::InProcess { .. } => f.write_str("InProcess(…)"),
            Self::Enrolment { join, state } => f.debug_struct("Enrolment").field("join", join).field("state", state).finish(),
            Self::Certificate { certificate, .. } => f.debug_tuple("Certificate").field(certificate).finish(),
            Self::File(path) => f.debug_tuple("File").field(path).finish(),
        }
    }
}

impl Credential {
    /// The header's value, or why there is none.
    fn read(&self) -> Result<Option<MetadataValue<Ascii>>, String> {
        let text = match self {
            Self::None | Self::Enrolment { .. } | Self::Certificate { .. } => return Ok(None),
            Self::Token(token) | Self::InProcess { token, .. } => token.clone(),
            Self::File(path) => {
                let name = path.display();
                let about = std::fs::metadata(path).map_err(|fault| format!("{name}: {fault}"))?;
                if about.len() > LARGEST {
                    return Err(format!("{name} has {} bytes, expected a token", about.len()));
                }
                std::fs::read_to_string(path).map_err(|fault| format!("{name}: {fault}"))?
            }
        };
        let mut value: MetadataValue<Ascii> =
            format!("Bearer {}", text.trim()).parse().map_err(|_| "the token has characters that no token has".to_owned())?;
        value.set_sensitive(true);
        Ok(Some(value))
    }
}

/// Adds the token to every call.
#[derive(Clone, Debug)]
pub(crate) struct Bearer {
    credential: Credential,
    value: Arc<RwLock<Option<MetadataValue<Ascii>>>>,
}

impl Bearer {
    pub(crate) fn new(credential: Credential) -> Self {
        let bearer = Self { credential, value: Arc::default() };
        bearer.refresh();
        bearer
    }

    /// Reads the token again, for this and all clones. Without one calls are made all the same: the coordinator says what is missing.
    pub(crate) fn refresh(&self) {
        match self.credential.read() {
            Ok(value) => *self.value.write().unwrap_or_else(PoisonError::into_inner) = value,
            Err(problem) => tracing::debug!(%problem, "no token"),
        }
    }
}

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        if let Some(value) = &*self.value.read().unwrap_or_else(PoisonError::into_inner) {
            request.metadata_mut().insert("authorization", value.clone());
        }
        Ok(request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_may_come_later_and_change() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("worker-token");
        let mut bearer = Bearer::new(Credential::File(path.clone()));
        let sent = |bearer: &mut Bearer| {
            let request = bearer.call(Request::new(())).unwrap();
            request.metadata().get("authorization").map(|value| (value.to_str().unwrap().to_owned(), value.is_sensitive()))
        };
        assert_eq!(sent(&mut bearer), None);
        for token in ["one", "two"] {
            std::fs::write(&path, format!("{token}\n")).unwrap();
            bearer.refresh();
            assert_eq!(sent(&mut bearer), Some((format!("Bearer {token}"), true)));
        }
    }

    #[test]
    fn tokens_do_not_show() {
        assert_eq!(format!("{:?}", Credential::Token("secret".into())), "Token(…)");
        assert!(Credential::Token("a\nb".into()).read().is_err());
    }
}
