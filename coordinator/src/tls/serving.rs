//! The certificate that the coordinator shows: its own, signed again in time, or one from files, read again when they change.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use gradfarm_proto::COORDINATOR_NAME;
use rustls::pki_types::PrivateKeyDer;
use rustls::pki_types::pem::PemObject;
use rustls::server::{ClientHello, ResolvesServerCert};
use rustls::sign::CertifiedKey;

use super::{TlsError, certificates, provider};
use crate::authority::{Authority, DAY};
use crate::clock::Clock;

/// How long our own certificate is good, and after how long there is a new one.
const OWN: (Duration, Duration) = (DAY.saturating_mul(30), DAY.saturating_mul(10));
/// How often it is looked whether files have changed.
const LOOK: Duration = Duration::from_secs(30);

/// Chooses the certificate for a connection.
#[derive(Debug)]
pub(super) struct Serving {
    own: Own,
    given: Option<Given>,
}

impl Serving {
    pub(super) fn new(own: Own, given: Option<Given>) -> Self {
        Self { own, given }
    }
}

impl ResolvesServerCert for Serving {
    fn resolve(&self, hello: ClientHello<'_>) -> Option<Arc<CertifiedKey>> {
        match &self.given {
            // Workers that trust our authority ask for its certificate by a name that nobody else's has.
            Some(given) if hello.server_name() != Some(COORDINATOR_NAME) => Some(given.current()),
            _ => Some(self.own.current()),
        }
    }
}

/// Our own certificate.
pub(super) struct Own {
    authority: Arc<Authority>,
    names: Vec<String>,
    current: Mutex<(Arc<CertifiedKey>, Instant)>,
}

impl Own {
    pub(super) fn issue(authority: Arc<Authority>, names: &[String]) -> Result<Self, TlsError> {
        let mut names = names.to_vec();
        names.extend(["localhost", "127.0.0.1", "::1"].map(str::to_owned));
        names.extend(host_name());
        names.sort_unstable();
        names.dedup();
        let first = sign(&authority, &names)?;
        Ok(Self { authority, names, current: Mutex::new((first, Instant::now())) })
    }

    fn current(&self) -> Arc<CertifiedKey> {
        let mut current = self.current.lock().unwrap_or_else(PoisonError::into_inner);
        if current.1.elapsed() > OWN.1 {
            match sign(&self.authority, &self.names) {
                Ok(next) => *current = (next, Instant::now()),
                Err(problem) => tracing::error!(%problem, "the coordinator's certificate could not be renewed"),
            }
        }
        current.0.clone()
    }
}

fn sign(authority: &Authority, names: &[String]) -> Result<Arc<CertifiedKey>, TlsError> {
    let (chain, key) = authority.server(names, Clock::new().now(), OWN.0)?;
    Ok(Arc::new(CertifiedKey::from_der(chain, key, &provider())?))
}

/// What this machine calls itself, if that can be a name in a certificate.
fn host_name() -> Option<String> {
    let told = std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("HOSTNAME").ok())?;
    let told = told.trim().to_ascii_lowercase();
    rustls::pki_types::DnsName::try_from(told.as_str()).is_ok().then_some(told)
}

impl fmt::Debug for Own {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Own").field("names", &self.names).finish_non_exhaustive()
    }
}

/// A certificate from files.
pub(super) struct Given {
    certificate: PathBuf,
    key: PathBuf,
    current: Mutex<Read>,
}

struct Read {
    certified: Arc<CertifiedKey>,
    changed: Option<SystemTime>,
    looked: Instant,
}

impl Given {
    pub(super) fn open(certificate: &Path, key: &Path) -> Result<Self, TlsError> {
        let (certificate, key) = (certificate.to_path_buf(), key.to_path_buf());
        let changed = changed(&certificate);
        let read = Read { certified: read(&certificate, &key)?, changed, looked: Instant::now() };
        Ok(Self { certificate, key, current: Mutex::new(read) })
    }

    fn current(&self) -> Arc<CertifiedKey> {
        let mut current = self.current.lock().unwrap_or_else(PoisonError::into_inner);
        if current.looked.elapsed() > LOOK {
            current.looked = Instant::now();
            let now = changed(&self.certificate);
            if now != current.changed {
                match read(&self.certificate, &self.key) {
                    Ok(next) => (current.certified, current.changed) = (next, now),
                    // Certificate and key may be half way through being replaced.
                    Err(problem) => tracing::warn!(%problem, "the new certificate cannot be used yet"),
                }
            }
        }
        current.certified.clone()
    }
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|about| about.modified()).ok()
}

fn read(certificate: &PathBuf, key: &PathBuf) -> Result<Arc<CertifiedKey>, TlsError> {
    let chain = certificates(certificate)?;
    let fault = |reason: String| TlsError::File { path: key.clone(), reason };
    let key = PrivateKeyDer::from_pem_file(key).map_err(|problem| fault(problem.to_string()))?;
    let certified = CertifiedKey::from_der(chain, key, &provider()).map_err(|problem| fault(problem.to_string()))?;
    Ok(Arc::new(certified))
}

impl fmt::Debug for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Given").field("certificate", &self.certificate).finish_non_exhaustive()
    }
}
