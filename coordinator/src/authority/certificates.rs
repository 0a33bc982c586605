//! Signs certificates: the coordinator's own, and those of workers.

use std::fmt;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use gradfarm_proto::{COORDINATOR_NAME, worker_uri};
use rcgen::{
    BasicConstraints, CertificateParams, CertificateSigningRequestParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose, SanType, date_time_ymd,
};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, CertificateSigningRequestDer, PrivateKeyDer};
use sha2::{Digest, Sha256};

use crate::access::{PrivateFileError, write_private};
use crate::clock::Timestamp;
use crate::job::WorkerId;

/// A day.
pub const DAY: Duration = Duration::from_secs(86_400);
/// How long the authority itself is good.
const AUTHORITY: Duration = DAY.saturating_mul(3650);
/// By how much workers' clocks may be behind.
const SKEW: Duration = Duration::from_secs(300);
/// Largest request for a certificate that is read [bytes].
const REQUEST: usize = 16 << 10;

/// The authority: a certificate that workers and the command line trust, and the key that signs for it.
pub struct Authority {
    certificate: CertificateDer<'static>,
    pem: String,
    /// Its name, encoded: certificates that it signed bear it as their issuer.
    subject: Vec<u8>,
    issuer: Issuer<'static, KeyPair>,
}

/// The authority cannot be used, or cannot sign.
#[derive(Debug, thiserror::Error)]
pub enum AuthorityError {
    /// A file of it.
    #[error("authority {}: {reason}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// It could not be written.
    #[error("authority: {0}")]
    Write(#[from] PrivateFileError),
    /// Something about a certificate.
    #[error("certificate: {0}")]
    Certificate(#[from] rcgen::Error),
}

impl Authority {
    /// Reads the authority from its folder (`ca.pem`, `ca.key`), or makes one there.
    ///
    /// # Errors
    /// If the files are damaged, one of them is missing, or the folder takes none.
    pub fn open(folder: &Path, now: Timestamp) -> Result<Self, AuthorityError> {
        let (certificate, key) = (folder.join("ca.pem"), folder.join("ca.key"));
        match (certificate.exists(), key.exists()) {
            (true, true) => Self::read(&certificate, &key),
            (false, false) => Self::make(folder, &certificate, &key, now),
            (there, _) => {
                let path = if there { key } else { certificate };
                Err(AuthorityError::File { path, reason: "is missing, while the other one of ca.pem and ca.key is there".to_owned() })
            }
        }
    }

    fn read(certificate: &Path, key: &Path) -> Result<Self, AuthorityError> {
        let fault = |path: &Path, reason: String| AuthorityError::File { path: path.to_path_buf(), reason };
        let read = |path: &Path| std::fs::read_to_string(path).map_err(|problem| fault(path, problem.to_string()));
        let (pem, key_pem) = (read(certificate)?, read(key)?);
        let key_pair = KeyPair::from_pem(&key_pem).map_err(|problem| fault(key, problem.to_string()))?;
        let der = CertificateDer::from_pem_slice(pem.as_bytes()).map_err(|problem| fault(certificate, problem.to_string()))?;
        let subject = subject_of(&der, &key_pair).map_err(|reason| fault(certificate, reason))?;
        let issuer = Issuer::from_ca_cert_der(&der, key_pair).map_err(|problem| fault(certificate, problem.to_string()))?;
        Ok(Self { certificate: der, pem, subject, issuer })
    }

    fn make(folder: &Path, certificate: &Path, key: &Path, now: Timestamp) -> Result<Self, AuthorityError> {
        let fault = |reason: String| AuthorityError::File { path: folder.to_path_buf(), reason };
        std::fs::create_dir_all(folder).map_err(|problem| fault(problem.to_string()))?;
        let key_pair = KeyPair::generate()?;
        let mut params = CertificateParams::default();
        // The key's hash in its name tells authorities apart.
        let name: String = Sha256::digest(key_pair.public_key_raw()).iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        params.distinguished_name.push(DnType::CommonName, format!("gradfarm authority {name}"));
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        set_validity(&mut params, now, AUTHORITY);
        let signed = params.self_signed(&key_pair)?;
        write_private(key, key_pair.serialize_pem().as_bytes())?;
        write_private(certificate, signed.pem().as_bytes())?;
        tracing::info!(folder = %folder.display(), "certificate authority made");
        Self::read(certificate, key)
    }

    /// Its certificate.
    pub fn certificate(&self) -> &CertificateDer<'static> {
        &self.certificate
    }

    /// Its certificate as text, for whoever shall trust it.
    pub fn pem(&self) -> &str {
        &self.pem
    }

    /// Whether a certificate, whose signature was checked, was signed by this authority and not by another one that is trusted, too.
    pub fn signed(&self, certificate: &[u8]) -> bool {
        x509_parser::parse_x509_certificate(certificate).is_ok_and(|(_, read)| read.issuer().as_raw() == self.subject)
    }

    /// A certificate for the coordinator under these names, with a new key: chain and key.
    ///
    /// # Errors
    /// If a name is none.
    pub fn server(
        &self,
        names: &[String],
        now: Timestamp,
        ttl: Duration,
    ) -> Result<(Vec<CertificateDer<'static>>, PrivateKeyDer<'static>), AuthorityError> {
        let key = KeyPair::generate()?;
        let mut params = CertificateParams::default();
        params.distinguished_name.push(DnType::CommonName, "gradfarm coordinator");
        params.subject_alt_names.push(SanType::DnsName(COORDINATOR_NAME.try_into()?));
        for name in names {
            params.subject_alt_names.push(match name.parse::<IpAddr>() {
                Ok(address) => SanType::IpAddress(address),
                Err(_) => SanType::DnsName(name.as_str().try_into()?),
            });
        }
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        set_validity(&mut params, now, ttl);
        let signed = params.signed_by(&key, &self.issuer)?;
        Ok((vec![signed.der().clone(), self.certificate.clone()], PrivateKeyDer::Pkcs8(key.serialize_der().into())))
    }

    /// A certificate (PEM) for a worker, for the key that a request (PKCS #10, DER) proves to be there. Nothing else of the request counts.
    ///
    /// # Errors
    /// If the request is none, or not signed with its own key.
    pub fn worker(
        &self,
        request: &[u8],
        worker: WorkerId,
        pool: Option<&str>,
        now: Timestamp,
        ttl: Duration,
    ) -> Result<String, AuthorityError> {
        if request.len() > REQUEST {
            return Err(rcgen::Error::CouldNotParseCertificationRequest.into());
        }
        let asked = CertificateSigningRequestParams::from_der(&CertificateSigningRequestDer::from(request))?;
        let mut params = CertificateParams::default();
        params.distinguished_name.push(DnType::CommonName, "gradfarm worker");
        params.subject_alt_names.push(SanType::URI(worker_uri(worker.to_bytes(), pool).try_into()?));
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        set_validity(&mut params, now, ttl);
        Ok(params.signed_by(&asked.public_key, &self.issuer)?.pem())
    }
}

/// Good from now, and a little before, for so long.
fn set_validity(params: &mut CertificateParams, now: Timestamp, ttl: Duration) {
    let now = date_time_ymd(1970, 1, 1) + Duration::from_millis(now.millis().max(0).unsigned_abs());
    (params.not_before, params.not_after) = (now - SKEW, now + ttl);
}

/// The name of an authority's certificate, if it is one and the key is its own.
fn subject_of(certificate: &[u8], key: &KeyPair) -> Result<Vec<u8>, String> {
    let (_, read) = x509_parser::parse_x509_certificate(certificate).map_err(|fault| fault.to_string())?;
    if !read.is_ca() {
        return Err("is no authority's certificate".to_owned());
    }
    if read.public_key().subject_public_key.data.as_ref() != key.public_key_raw() {
        return Err("does not belong to ca.key".to_owned());
    }
    Ok(read.subject().as_raw().to_vec())
}

impl fmt::Debug for Authority {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Authority").finish_non_exhaustive()
    }
}
