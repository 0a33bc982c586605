//! The farm's protocol: messages, the gRPC service, and their lossless conversion to and from core types.
//!
//! Only this crate knows the wire. `convert` turns messages into core types and refuses what does not fit, `block` is the
//! encoding of a result, `digest` names content, `limits` holds the bounds that both sides keep.

pub mod block;
pub mod convert;
mod digest;
mod identity;
pub mod image;
pub mod limits;
mod manifest;
pub mod version;
mod worker_kind;

pub use convert::ConvertError;
pub use digest::{Digest, ParseDigestError};
pub use identity::{COORDINATOR_NAME, IdentityError, WorkerIdentity, is_pool_name, worker_uri};
pub use manifest::{Manifest, ManifestError};
pub use worker_kind::WorkerKind;

/// Generated messages and service of the package `farm.v1`.
#[allow(missing_docs, unreachable_pub, clippy::all)]
pub mod v1 {
    tonic::include_proto!("farm.v1");
}
