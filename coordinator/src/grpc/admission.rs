//! Who calls: a worker on this machine with a token, bound to nothing but its role.

use gradfarm_proto::WorkerKind;
use tonic::metadata::MetadataMap;
use tonic::{Request, Status};

use crate::access::{Denied, Refusal, Role};
use crate::job::WorkerId;
use crate::service::Handle;

/// A caller that was let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Peer {
    /// By a token: any worker that is not enrolled.
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
            Peer::Token { .. } if WorkerKind::of(worker.to_bytes()) == WorkerKind::Passing => Ok(()),
            Peer::Token { name } => {
                Err(Status::permission_denied(format!("worker {worker} is enrolled; {name:?} is a token and cannot speak for it")))
            }
        }
    }
}

/// Finds out who calls.
///
/// # Errors
/// `Unauthenticated` or `PermissionDenied`, saying what is missing; `Unavailable` if the store does not answer.
pub(super) async fn admit<T>(handle: &Handle, request: &Request<T>) -> Result<Peer, Status> {
    let token = bearer(request.metadata()).map_err(|denied| status(denied.into()))?;
    let caller = handle.gate().identify(token).await.map_err(status)?;
    caller.require(Role::Worker).map_err(|denied| status(denied.into()))?;
    Ok(Peer::Token { name: caller.name })
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
        Refusal::Denied(denied) if denied.is_about_identity() => {
            Status::unauthenticated(format!("{denied}; a worker on the coordinator's machine finds its token in DIR/worker-token"))
        }
        Refusal::Denied(denied) => Status::permission_denied(denied.to_string()),
        Refusal::Store(fault) => {
            tracing::error!(%fault, "tokens cannot be read");
            Status::unavailable("the store of tokens does not answer")
        }
    }
}
