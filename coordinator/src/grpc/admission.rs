//! Who calls: a worker with a certificate, which speaks for itself alone, or one of this machine with a token.

use std::net::SocketAddr;

use gradfarm_proto::{WorkerIdentity, WorkerKind};
use tonic::metadata::MetadataMap;
use tonic::{Request, Status};

use super::enrolment::refusal;
use crate::access::{Denied, Refusal, Role};
use crate::job::WorkerId;
use crate::service::Handle;

/// A caller that was let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Peer {
    /// By a certificate: this worker and no other.
    Certificate(WorkerIdentity),
    /// By a token, on this machine: any worker that is not enrolled.
    Token {
        /// The token's name.
        name: String,
    },
}

impl Peer {
    /// Whether this caller may speak for a worker.
    ///
    /// # Errors
    /// A refusal that names the worker.
    pub(super) fn require(&self, worker: WorkerId) -> Result<(), Status> {
        match self {
            Peer::Certificate(identity) if identity.worker == worker.to_bytes() => Ok(()),
            Peer::Certificate(identity) => {
                let own = WorkerId::from_bytes(identity.worker);
                Err(Status::permission_denied(format!("the certificate is that of worker {own}; it cannot speak for worker {worker}")))
            }
            Peer::Token { .. } if WorkerKind::of(worker.to_bytes()) == WorkerKind::Passing => Ok(()),
            Peer::Token { name } => {
                Err(Status::permission_denied(format!("worker {worker} is enrolled; {name:?} is a token and cannot speak for it")))
            }
        }
    }

    /// Whether this caller is still let in, for sessions that last.
    ///
    /// # Errors
    /// Why not any more.
    pub(super) async fn still(&self, handle: &Handle) -> Result<(), Status> {
        match (self, handle.secured()) {
            (Peer::Certificate(identity), Some(secured)) => secured.registry.admit(identity).await.map_err(refusal),
            _ => Ok(()),
        }
    }
}

/// Finds out who calls.
///
/// # Errors
/// `Unauthenticated` or `PermissionDenied`, saying what is missing; `Unavailable` if the store does not answer.
pub(super) async fn admit<T>(handle: &Handle, request: &Request<T>) -> Result<Peer, Status> {
    if let Some(identity) = certificate(handle, request).await? {
        return Ok(Peer::Certificate(identity));
    }
    let token = bearer(request.metadata()).map_err(|denied| status(denied.into()))?;
    let caller = handle.gate().identify(token).await.map_err(status)?;
    caller.require(Role::Worker).map_err(|denied| status(denied.into()))?;
    if !request.remote_addr().is_some_and(|address: SocketAddr| address.ip().to_canonical().is_loopback()) {
        return Err(Status::permission_denied(
            "a worker's token is for the coordinator's own machine; from elsewhere workers join with --join (`gradfarm join-token create`)",
        ));
    }
    Ok(Peer::Token { name: caller.name })
}

/// Who the caller's certificate says that it is, if it showed one. TLS has checked that one of the authorities signed it and that the
/// caller has its key.
///
/// # Errors
/// If the certificate names nobody, or a worker that is not let in.
pub(super) async fn certificate<T>(handle: &Handle, request: &Request<T>) -> Result<Option<WorkerIdentity>, Status> {
    let Some(secured) = handle.secured() else { return Ok(None) };
    let chain = request.peer_certs();
    let Some(own) = chain.as_ref().and_then(|chain| chain.first()) else { return Ok(None) };
    let identity = WorkerIdentity::of(own).map_err(|fault| Status::permission_denied(fault.to_string()))?;
    if identity.ours != secured.registry.authority().signed(own) {
        return Err(Status::permission_denied(
            "only the farm's own authority gives names that begin with spiffe://gradfarm/, and no others",
        ));
    }
    secured.registry.admit(&identity).await.map_err(refusal)?;
    Ok(Some(identity))
}

fn bearer(metadata: &MetadataMap) -> Result<Option<&str>, Denied> {
    let Some(value) = metadata.get("authorization") else { return Ok(None) };
    let (scheme, token) = value.to_str().ok().and_then(|text| text.split_once(' ')).ok_or(Denied::Malformed)?;
    if !scheme.eq_ignore_ascii_case("bearer") {
        return Err(Denied::Malformed);
    }
    Ok(Some(token.trim()))
}

fn status(refusal: Refusal) -> Status {
    match refusal {
        Refusal::Denied(denied) if denied.is_about_identity() => Status::unauthenticated(format!(
            "{denied}; a worker on the coordinator's machine finds its token in DIR/worker-token, one elsewhere joins with --join"
        )),
        Refusal::Denied(denied) => Status::permission_denied(denied.to_string()),
        Refusal::Store(fault) => {
            tracing::error!(%fault, "tokens cannot be read");
            Status::unavailable("the store of tokens does not answer")
        }
    }
}
