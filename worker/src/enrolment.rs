//! How a worker gets its certificate and keeps it good: once with a join token, from then on with the certificate before.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use gradfarm_proto::v1;
use gradfarm_proto::v1::enrolment_client::EnrolmentClient;
use rcgen::{CertificateParams, KeyPair};
use tonic::Code;

use crate::backoff::Backoff;
use crate::config::Config;
use crate::credential::Credential;
use crate::dial::{Dial, Trust};
use crate::error::Error;
use crate::papers::{Papers, State, read};

/// How often files of another authority are looked at.
const LOOK: Duration = Duration::from_secs(30);
/// Shortest time between two renewals.
const SHORTEST: Duration = Duration::from_secs(1);

/// Where a worker's certificate comes from, once it has one.
#[derive(Debug)]
pub(crate) enum Source {
    /// The farm's own authority; kept in the state folder.
    Farm(State),
    /// Another authority; somebody else keeps these files good.
    Files {
        /// The certificate.
        certificate: PathBuf,
        /// Its key.
        key: PathBuf,
    },
}

/// What a worker shows and trusts before its first connection. Waits for a coordinator that is away if it must enrol first.
///
/// # Errors
/// If it has no certificate and gets none, or its files are damaged.
pub(crate) async fn prepare(config: &Config) -> Result<(Option<Papers>, Option<Source>, Trust), Error> {
    let given = config.authority.as_deref().map(read).transpose()?.map(Trust::Host);
    match &config.credential {
        Credential::Enrolment { join, state } => {
            let state = State::open(state)?;
            let (papers, farm) = match state.read()? {
                Some((papers, farm)) if !papers.left().is_zero() => (papers, farm),
                kept => {
                    let Some(join) = join else {
                        let found = if kept.is_some() { "a certificate that has expired" } else { "no certificate" };
                        let expected = "--join and a join token (`gradfarm join-token create`)".into();
                        return Err(Error::Invalid { what: "enrolment", found: found.into(), expected });
                    };
                    enrol(config, join, given.clone(), &state).await?
                }
            };
            tracing::info!(worker = %uuid::Uuid::from_bytes(papers.identity.worker), pool = papers.identity.pool.as_deref(), "enrolled");
            Ok((Some(papers), Some(Source::Farm(state)), given.unwrap_or(Trust::Farm(farm))))
        }
        Credential::Certificate { certificate, key } => {
            let trust = given.ok_or_else(|| Error::Invalid {
                what: "ca",
                found: "missing".into(),
                expected: "--ca and the authority of the coordinator's certificate".into(),
            })?;
            let papers = read_papers(certificate, key)?;
            Ok((Some(papers), Some(Source::Files { certificate: certificate.clone(), key: key.clone() }), trust))
        }
        Credential::InProcess { authority: Some(authority), .. } => Ok((None, None, Trust::Farm(authority.clone()))),
        _ => Ok((None, None, given.unwrap_or(Trust::Nobody))),
    }
}

fn read_papers(certificate: &Path, key: &Path) -> Result<Papers, Error> {
    let wrong = |found| Error::Invalid { what: "certificate", found, expected: "a certificate that names a worker".into() };
    Papers::new(read(certificate)?, read(key)?).map_err(wrong)
}

/// Joins: draws a key that never leaves this machine, and has it signed.
async fn enrol(config: &Config, join: &Path, given: Option<Trust>, state: &State) -> Result<(Papers, String), Error> {
    let text = read(join)?;
    let token = text.lines().map(str::trim).find(|line| line.starts_with("gfj_"));
    let (Some(token), true) = (token, text.contains("-----BEGIN CERTIFICATE-----")) else {
        let found = format!("{} holds no join token and certificate", join.display());
        return Err(Error::Invalid { what: "join", found, expected: "a file of `gradfarm join-token create`".into() });
    };
    let (key, request) = request(&config.coordinator)?;
    let first = Dial::new(&config.coordinator, Credential::None, None, given.unwrap_or_else(|| Trust::Farm(text.clone())))?;
    let mut coordinators = [&config.coordinator].into_iter().chain(&config.others).cycle();
    let mut backoff = Backoff::new();
    let mut told = false;
    loop {
        let asked = v1::EnrolRequest { request: request.clone().into(), token: token.to_owned(), name: config.name.clone() };
        let dial = first.to(coordinators.next().unwrap_or(&config.coordinator))?;
        let refused = match EnrolmentClient::new(dial.channel()?).enrol(asked).await {
            Ok(reply) => {
                let papers = papers(reply.into_inner().certificate, key.serialize_pem(), &config.coordinator)?;
                let authority = text[text.find("-----BEGIN").unwrap_or(0)..].to_owned();
                state.keep(&papers, Some(&authority))?;
                return Ok((papers, authority));
            }
            Err(status) => status,
        };
        if matches!(refused.code(), Code::PermissionDenied | Code::InvalidArgument | Code::FailedPrecondition | Code::Unimplemented) {
            return Err(Error::Coordinator { url: config.coordinator.clone(), reason: refused.message().to_owned() });
        }
        if !told {
            tracing::warn!(url = %config.coordinator, problem = %crate::link::cause(&refused), "cannot enrol yet, trying again");
            told = true;
        }
        tokio::time::sleep(backoff.wait()).await;
    }
}

/// A new key, and the request to have it signed (DER).
fn request(url: &str) -> Result<(KeyPair, Vec<u8>), Error> {
    let failed = |fault: rcgen::Error| Error::Coordinator { url: url.to_owned(), reason: format!("no key could be made: {fault}") };
    let key = KeyPair::generate().map_err(failed)?;
    let request = CertificateParams::default().serialize_request(&key).map_err(failed)?;
    Ok((key, request.der().to_vec()))
}

fn papers(certificate: String, key: String, url: &str) -> Result<Papers, Error> {
    let wrong = |reason| Error::Coordinator { url: url.to_owned(), reason: format!("it sent no certificate that fits: {reason}") };
    Papers::new(certificate, key).map_err(wrong)
}

/// Keeps the certificate good as long as the worker runs: asks for the next one when two thirds of its time are over, and hands it to
/// new connections.
pub(crate) async fn keep_good(mut dials: Vec<Dial>, source: Source, mut papers: Papers) {
    let mut backoff = Backoff::new();
    while let Some(dial) = dials.first() {
        let next = match &source {
            Source::Farm(state) => {
                tokio::time::sleep((papers.left() * 2 / 3).max(SHORTEST)).await;
                renew(dial, state).await
            }
            Source::Files { certificate, key } => {
                changed(certificate).await;
                read_papers(certificate, key).map_err(|fault| (fault.to_string(), false))
            }
        };
        match next {
            Ok(next) => {
                tracing::info!(hours = next.left().as_secs() / 3600, "certificate renewed");
                papers = next.clone();
                dial.show(next);
                backoff.reset();
            }
            Err((problem, true)) => {
                tracing::error!(problem, "the certificate is not renewed any more");
                return;
            }
            Err((problem, false)) => {
                tracing::warn!(problem, "certificate not renewed yet, trying again");
                // Any coordinator of the farm renews it.
                dials.rotate_left(1);
                tokio::time::sleep(backoff.wait()).await;
            }
        }
    }
}

/// The next certificate; otherwise why not, and whether that is for good.
async fn renew(dial: &Dial, state: &State) -> Result<Papers, (String, bool)> {
    let later = |fault: Error| (fault.to_string(), false);
    let (key, request) = request(dial.url()).map_err(later)?;
    let channel = dial.channel().map_err(later)?;
    let asked = v1::RenewRequest { request: request.into() };
    let reply = EnrolmentClient::new(channel).renew(asked).await.map_err(|status| {
        (crate::link::cause(&status), matches!(status.code(), Code::PermissionDenied | Code::InvalidArgument | Code::Unimplemented))
    })?;
    let next = papers(reply.into_inner().certificate, key.serialize_pem(), dial.url()).map_err(later)?;
    state.keep(&next, None).map_err(later)?;
    Ok(next)
}

/// Waits until a file changes.
async fn changed(path: &Path) {
    let at = |path: &Path| -> Option<SystemTime> { std::fs::metadata(path).and_then(|about| about.modified()).ok() };
    let before = at(path);
    while at(path) == before {
        tokio::time::sleep(LOOK).await;
    }
}
