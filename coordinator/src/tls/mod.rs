//! Encryption: what both ports speak once anybody beyond this machine may knock.
//!
//! People's port shows a certificate and asks for a token. The workers' port shows one, too, and takes the worker's own: it is asked
//! for, and without one nothing but enrolment is answered.

mod listener;
mod serving;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use rustls::server::WebPkiClientVerifier;
use rustls::{RootCertStore, ServerConfig};

pub use listener::TlsListener;

use crate::authority::{Authority, AuthorityError, DAY, Registry};
use crate::clock::Clock;
use crate::store::Records;
use serving::{Given, Own, Serving};

/// How encryption is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Folder of the farm's own authority; made if it is not there.
    pub authority: PathBuf,
    /// Names and addresses by which the coordinator's own certificate can be checked, besides those of this machine.
    pub names: Vec<String>,
    /// Files of another certificate and its key (PEM), shown instead of our own to whoever does not ask for that by name.
    pub given: Option<(PathBuf, PathBuf)>,
    /// File with another authority (PEM) whose certificates workers may have, too.
    pub client_authority: Option<PathBuf>,
    /// How long workers' certificates are good.
    pub worker_ttl: Duration,
}

impl Options {
    /// With an authority in this folder and nothing else; workers' certificates are good for a day.
    pub fn new(authority: impl Into<PathBuf>) -> Self {
        Self { authority: authority.into(), names: Vec::new(), given: None, client_authority: None, worker_ttl: DAY }
    }
}

/// Encryption cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// The authority.
    #[error(transparent)]
    Authority(#[from] AuthorityError),
    /// A file that was named.
    #[error("{}: {reason}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// TLS itself.
    #[error("TLS: {0}")]
    Tls(#[from] rustls::Error),
    /// Speaking to other coordinators.
    #[error("TLS: {0}")]
    Client(#[source] reqwest::Error),
    /// The authorities that workers' certificates may be of.
    #[error("TLS: {0}")]
    Verifier(#[from] rustls::server::VerifierBuilderError),
}

/// Encryption, set up.
#[derive(Debug)]
pub struct Secured {
    /// Who may be a worker.
    pub registry: Registry,
    /// For people's port.
    pub http: Arc<ServerConfig>,
    /// For the workers' port.
    pub grpc: Arc<ServerConfig>,
    /// Speaks to other coordinators of the farm.
    pub peers: reqwest::Client,
}

impl Secured {
    /// Reads or makes what the options name.
    ///
    /// # Errors
    /// What is wrong with which file.
    pub fn open(options: &Options, records: Arc<dyn Records>) -> Result<Self, TlsError> {
        let authority = Arc::new(Authority::open(&options.authority, Clock::new().now())?);
        let given = options.given.as_ref().map(|(certificate, key)| Given::open(certificate, key)).transpose()?;
        let serving = Arc::new(Serving::new(Own::issue(authority.clone(), &options.names)?, given));
        let mut trusted = RootCertStore::empty();
        trusted.add(authority.certificate().clone())?;
        if let Some(path) = &options.client_authority {
            for certificate in certificates(path)? {
                trusted.add(certificate)?;
            }
        }
        let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(trusted), provider()).allow_unauthenticated().build()?;
        let builder = || ServerConfig::builder_with_provider(provider()).with_safe_default_protocol_versions();
        let mut http = builder()?.with_no_client_auth().with_cert_resolver(serving.clone());
        http.alpn_protocols = vec![b"http/1.1".to_vec()];
        let mut grpc = builder()?.with_client_cert_verifier(verifier).with_cert_resolver(serving);
        grpc.alpn_protocols = vec![b"h2".to_vec()];
        crate::crypto::provide();
        let own = reqwest::Certificate::from_der(authority.certificate()).map_err(TlsError::Client)?;
        // Others show the same sort of certificate as this one does: the farm's own, or one that the system can check.
        let peers = reqwest::Client::builder();
        let peers = if options.given.is_some() { peers.tls_certs_merge([own]) } else { peers.tls_certs_only([own]) };
        let peers = peers.build().map_err(TlsError::Client)?;
        let registry = Registry::new(authority, records, options.worker_ttl);
        Ok(Self { registry, http: Arc::new(http), grpc: Arc::new(grpc), peers })
    }
}

/// The implementation of cryptography: the same everywhere.
fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// The certificates of a PEM file; never none.
fn certificates(path: &PathBuf) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let fault = |reason: String| TlsError::File { path: path.clone(), reason };
    let read = CertificateDer::pem_file_iter(path).map_err(|problem| fault(problem.to_string()))?;
    let read: Vec<_> = read.collect::<Result<_, _>>().map_err(|problem| fault(problem.to_string()))?;
    if read.is_empty() { Err(fault("holds no certificate".to_owned())) } else { Ok(read) }
}
