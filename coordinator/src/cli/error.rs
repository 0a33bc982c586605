//! How a command can end: the exit codes, and the errors behind them.

use std::path::PathBuf;
use std::process::ExitCode;

use gradfarm_core::plan::PlanError;
use gradfarm_core::scene;

/// What the codes mean, for `--help`.
pub(super) const EXIT_CODES: &str = "\
Exit codes:
  0    done
  1    failed: a file could not be written, the coordinator broke, a limit of this machine was met
  2    bad input: arguments, scene, image, or a job that does not exist
  3    the job failed or was cancelled
  4    the coordinator cannot be reached
  5    done, but tiles were given up: images are made without them
  130  interrupted by Ctrl-C";

/// Why a command ended badly. Each has its exit code.
#[derive(Debug, thiserror::Error)]
pub(super) enum Error {
    /// Something in the arguments that only looking at the world could tell.
    #[error("{0}")]
    Usage(String),
    /// The scene is wrong.
    #[error("{0}")]
    Scene(#[from] scene::Error),
    /// The scene is right, but what was asked for cannot be done with it.
    #[error("{0}")]
    Plan(#[from] PlanError),
    /// A file or stream could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something of this machine or of the coordinator broke.
    #[error("{0}")]
    Failed(String),
    /// The job ended, but not well.
    #[error("{0}")]
    Job(String),
    /// The job is done, but not all of it was rendered.
    #[error("{0}")]
    Flawed(String),
    /// Nobody answers.
    #[error(
        "cannot reach the coordinator at {server}: {reason}\nIs `gradfarm serve` running there? `--server` or GRADFARM_SERVER names another one."
    )]
    Unreachable {
        /// Its address.
        server: String,
        /// What the system said.
        reason: String,
    },
    /// Ctrl-C.
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// The exit code, as [`EXIT_CODES`] tells.
    pub(super) fn exit_code(&self) -> ExitCode {
        match self {
            Error::Write { source, .. } if source.kind() == std::io::ErrorKind::BrokenPipe => 0.into(),
            Error::Failed(_) | Error::Write { .. } => 1.into(),
            Error::Usage(_) | Error::Scene(_) | Error::Plan(_) => 2.into(),
            Error::Job(_) => 3.into(),
            Error::Unreachable { .. } => 4.into(),
            Error::Flawed(_) => 5.into(),
            Error::Interrupted => 130.into(),
        }
    }

    /// Whether the reader of our output went away, as `gradfarm … | head` does: no reason to complain.
    pub(super) fn is_closed_pipe(&self) -> bool {
        matches!(self, Error::Write { source, .. } if source.kind() == std::io::ErrorKind::BrokenPipe)
    }
}

impl Error {
    /// What to say of a job that is done with so many units given up.
    pub(super) fn flawed(job: &str, units: u64) -> Self {
        let what = if units == 1 { "1 unit was" } else { &format!("{units} units were") };
        Error::Flawed(format!(
            "job {job} is done, but {what} given up; `gradfarm status {job}` says why, `gradfarm retry {job}` tries again"
        ))
    }
}

impl From<crate::error::Error> for Error {
    fn from(error: crate::error::Error) -> Self {
        use crate::error::Error as Service;
        match error {
            Service::Invalid { .. } | Service::Scene(_) | Service::Plan(_) | Service::Unlisted { .. } => Error::Usage(error.to_string()),
            error => Error::Failed(error.to_string()),
        }
    }
}
