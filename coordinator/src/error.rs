//! What can go wrong in the coordinator, as its callers need to tell it apart.

use std::net::SocketAddr;

use gradfarm_proto::Digest;

use crate::job::{FileKind, JobId};

/// An error of the [`Handle`](crate::service::Handle) or of the running service.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// No such job.
    #[error("there is no job {0}")]
    NoJob(JobId),
    /// The job has no such frame.
    #[error("job {job} has no frame {frame}; its frames are {first} to {last}")]
    NoFrame {
        /// The job.
        job: JobId,
        /// What was asked for.
        frame: u32,
        /// Its first frame.
        first: u32,
        /// Its last frame.
        last: u32,
    },
    /// The frame's file is not written yet.
    #[error("frame {frame} of job {job} has no {} file yet", kind.name())]
    NotReady {
        /// The job.
        job: JobId,
        /// The frame.
        frame: u32,
        /// Which file.
        kind: FileKind,
    },
    /// The coordinator that owned the job is gone, and no other one has taken it over yet.
    #[error("job {job} is without a coordinator at the moment; try again")]
    Unowned {
        /// The job.
        job: JobId,
    },
    /// There is no such picture of the frame, or not yet.
    #[error("frame {frame} of job {job} cannot be shown as {view}: that is {needs}")]
    NotShown {
        /// The job.
        job: JobId,
        /// The frame.
        frame: u32,
        /// What was to be seen.
        view: &'static str,
        /// When it can be seen.
        needs: &'static str,
    },
    /// The job is over: what was asked can no longer be done.
    #[error("job {job} is {state} already")]
    Over {
        /// The job.
        job: JobId,
        /// Its state.
        state: &'static str,
    },
    /// There is nothing to try again.
    #[error("nothing of job {0} failed, so there is nothing to try again")]
    NothingFailed(JobId),
    /// Something in a submission is outside its range.
    #[error("{what} is {found}, expected {expected}")]
    Invalid {
        /// Field.
        what: &'static str,
        /// What was submitted.
        found: String,
        /// What is allowed.
        expected: String,
    },
    /// The description is wrong, or refers to something that is not there.
    #[error("scene: {0}")]
    Scene(#[from] gradfarm_core::scene::Error),
    /// The request cannot be planned for this scene.
    #[error("plan: {0}")]
    Plan(#[from] gradfarm_core::plan::PlanError),
    /// The job falls into too many units.
    #[error(transparent)]
    Units(#[from] crate::schedule::TooManyUnits),
    /// Another process uses the state folder.
    #[error("the state folder {0} is in use by another coordinator")]
    InUse(String),
    /// The description refers to files that the submission does not list.
    #[error("the description refers to files that the submission lists no digest for: {}", names.join(", "))]
    Unlisted {
        /// Their names.
        names: Vec<String>,
    },
    /// Assets must be uploaded first.
    #[error("{} of the submission's assets must be uploaded first, the first one is {}", digests.len(), digests[0])]
    MissingAssets {
        /// What is missing; never empty.
        digests: Vec<Digest>,
    },
    /// The client token was used for another submission.
    #[error("the client token {token:?} was used before, for another submission (job {job})")]
    TokenReused {
        /// The token.
        token: String,
        /// The job it stands for.
        job: JobId,
    },
    /// No such token.
    #[error("there is no token {0:?}")]
    NoToken(String),
    /// No certificate of ours or of another authority can name this worker.
    #[error("there is no worker {0} with a certificate; `gradfarm worker list` has those that joined")]
    NoWorker(crate::job::WorkerId),
    /// The identity provider cannot be used.
    #[error(transparent)]
    Oidc(#[from] crate::access::OidcError),
    /// Encryption cannot be set up.
    #[error(transparent)]
    Tls(#[from] crate::tls::TlsError),
    /// A file that only its owner may read could not be written.
    #[error(transparent)]
    Private(#[from] crate::access::PrivateFileError),
    /// Not on loopback, and not encrypted.
    #[error("refusing to listen on {0}: without TLS nothing listens beyond loopback; use --tls, or 127.0.0.1 or [::1]")]
    NotLoopback(SocketAddr),
    /// Listening failed.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// Where.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// The state folder or the operating system failed.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: std::io::Error,
    },
    /// The server for workers failed.
    #[error("worker service: {0}")]
    Transport(#[from] tonic::transport::Error),
    /// The store failed, or does not fit what the service believes.
    #[error(transparent)]
    Store(#[from] crate::store::StoreError),
    /// The blobs failed.
    #[error(transparent)]
    Blob(#[from] crate::store::BlobError),
    /// The service has stopped.
    #[error("the coordinator has stopped")]
    Stopped,
}
