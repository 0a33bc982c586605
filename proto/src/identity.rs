//! Who a worker's certificate says that it is. Both sides read it with the same eyes.

use x509_parser::extensions::GeneralName;
use x509_parser::prelude::{FromDer, X509Certificate};

use crate::WorkerKind;

/// Where the names of our own certificates begin. They are URIs: `spiffe://gradfarm/worker/UUID`, with `pool/NAME/` before `worker`
/// where the worker belongs to a pool.
const OURS: &str = "spiffe://gradfarm/";
/// Longest name that is looked at [bytes].
const LONGEST: usize = 2048;
/// Longest name of a pool [bytes].
const POOL: usize = 64;
/// By this name every coordinator can be called whose certificate is of the farm's own authority, wherever it listens.
pub const COORDINATOR_NAME: &str = "coordinator.gradfarm.internal";

/// The worker that a certificate is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerIdentity {
    /// Its identifier.
    pub worker: [u8; 16],
    /// The pool that it belongs to, if it says so.
    pub pool: Option<String>,
    /// Whether the name is of our own form, which only the farm's own authority may give.
    pub ours: bool,
    /// From when until when the certificate is good [s since 1970].
    pub validity: (i64, i64),
}

/// A certificate that names no worker.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the certificate names no worker: found {found}, expected {expected}")]
pub struct IdentityError {
    found: String,
    expected: &'static str,
}

/// The URI that names an enrolled worker.
pub fn worker_uri(worker: [u8; 16], pool: Option<&str>) -> String {
    let worker = uuid::Uuid::from_bytes(worker);
    match pool {
        Some(pool) => format!("{OURS}pool/{pool}/worker/{worker}"),
        None => format!("{OURS}worker/{worker}"),
    }
}

/// Whether a text can name a pool: 1 to 64 letters, digits, dots, hyphens or underscores.
pub fn is_pool_name(text: &str) -> bool {
    (1..=POOL).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b".-_".contains(&byte))
}

impl WorkerIdentity {
    /// Reads a certificate (X.509, DER): its first URI, or where it has none its first DNS name. A name of another form than ours
    /// stands for the worker that its hash names.
    ///
    /// # Errors
    /// If it is no certificate, or names nobody.
    pub fn of(certificate: &[u8]) -> Result<Self, IdentityError> {
        let wrong = |found: String, expected| IdentityError { found, expected };
        let (_, certificate) = X509Certificate::from_der(certificate).map_err(|fault| wrong(fault.to_string(), "an X.509 certificate"))?;
        let validity = (certificate.validity().not_before.timestamp(), certificate.validity().not_after.timestamp());
        let names = certificate.subject_alternative_name().map_err(|fault| wrong(fault.to_string(), "one subject alternative name"))?;
        let names = names.map(|extension| extension.value.general_names.as_slice()).unwrap_or_default();
        let uri = names.iter().find_map(|name| if let GeneralName::URI(uri) = name { Some(*uri) } else { None });
        let dns = names.iter().find_map(|name| if let GeneralName::DNSName(name) = name { Some(*name) } else { None });
        let name = uri.or(dns).filter(|name| !name.is_empty() && name.len() <= LONGEST);
        let name = name.ok_or_else(|| wrong("no such name".to_owned(), "a URI or a DNS name as subject alternative name"))?;
        Self::read(name, validity).ok_or_else(|| wrong(format!("{name:?}"), "spiffe://gradfarm/[pool/NAME/]worker/UUID"))
    }

    fn read(name: &str, validity: (i64, i64)) -> Option<Self> {
        let Some(path) = name.strip_prefix(OURS) else {
            let mut bits = [0; 16];
            bits.copy_from_slice(&blake3::hash(name.as_bytes()).as_bytes()[..16]);
            return Some(Self { worker: WorkerKind::enrolled(bits), pool: None, ours: false, validity });
        };
        let (pool, worker) = match path.split('/').collect::<Vec<_>>()[..] {
            ["worker", worker] => (None, worker),
            ["pool", pool, "worker", worker] if is_pool_name(pool) => (Some(pool.to_owned()), worker),
            _ => return None,
        };
        let worker = uuid::Uuid::parse_str(worker).ok()?.into_bytes();
        (WorkerKind::of(worker) == WorkerKind::Enrolled).then_some(Self { worker, pool, ours: true, validity })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        let worker = WorkerKind::enrolled([9; 16]);
        for pool in [None, Some("north-1")] {
            let read = WorkerIdentity::read(&worker_uri(worker, pool), (1, 2)).unwrap();
            assert_eq!(read, WorkerIdentity { worker, pool: pool.map(str::to_owned), ours: true, validity: (1, 2) });
        }
    }

    #[test]
    fn names_of_others_stand_for_a_worker_each() {
        let [one, same, other] =
            ["spiffe://studio/a", "spiffe://studio/a", "spiffe://studio/b"].map(|name| WorkerIdentity::read(name, (0, 0)));
        assert_eq!(one, same);
        assert_ne!(one, other);
        let one = one.unwrap();
        assert!(!one.ours && WorkerKind::of(one.worker) == WorkerKind::Enrolled);
    }

    #[test]
    fn half_a_name_of_ours_is_none() {
        let drawn = "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11";
        for bad in
            ["", "worker", "worker/x", &format!("worker/{drawn}"), "pool/a b/worker/x", "worker/a/b", "pool//worker/x", "coordinator"]
        {
            assert_eq!(WorkerIdentity::read(&format!("{OURS}{bad}"), (0, 0)), None, "{bad}");
        }
        assert!(WorkerIdentity::of(b"no certificate").is_err());
        assert!(is_pool_name("a.b-c_1") && !is_pool_name("") && !is_pool_name("a/b") && !is_pool_name(&"x".repeat(65)));
    }
}
