//! A worker's certificate with its key, and where both are kept.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use gradfarm_proto::WorkerIdentity;
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;

use crate::error::Error;

/// Largest file that is read [bytes].
const LARGEST: u64 = 1 << 20;

/// Certificate and key of a worker.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Papers {
    /// PEM.
    pub(crate) certificate: String,
    /// PEM.
    pub(crate) key: String,
    /// Who the certificate says that this is.
    pub(crate) identity: WorkerIdentity,
}

impl fmt::Debug for Papers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Papers").field("identity", &self.identity).finish_non_exhaustive()
    }
}

impl Papers {
    /// From two texts.
    ///
    /// # Errors
    /// What is wrong with the certificate, in words.
    pub(crate) fn new(certificate: String, key: String) -> Result<Self, String> {
        let der = CertificateDer::from_pem_slice(certificate.as_bytes()).map_err(|fault| format!("certificate: {fault}"))?;
        let identity = WorkerIdentity::of(&der).map_err(|fault| fault.to_string())?;
        Ok(Self { certificate, key, identity })
    }

    /// How long they are still good by this machine's clock; nothing if they are over.
    pub(crate) fn left(&self) -> Duration {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let end = Duration::from_secs(u64::try_from(self.identity.validity.1).unwrap_or(0));
        end.saturating_sub(now)
    }
}

/// The folder of a worker that is enrolled, for this process alone.
#[derive(Debug)]
pub(crate) struct State {
    folder: PathBuf,
    /// Held as long as the process lives: two workers must not have one name.
    _lock: File,
}

/// Certificate and key, in one file, so that they are replaced together.
const PAPERS: &str = "worker.pem";
/// The authority that the worker trusts.
const AUTHORITY: &str = "authority.pem";

impl State {
    /// Takes the folder; makes it if it is not there.
    ///
    /// # Errors
    /// If it cannot be made, or another worker has it.
    pub(crate) fn open(folder: &Path) -> Result<Self, Error> {
        let failed = |source| Error::Io { what: format!("state folder {}", folder.display()), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let lock = File::create(folder.join("lock")).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { folder: folder.to_path_buf(), _lock: lock }),
            Err(std::fs::TryLockError::WouldBlock) => {
                let found = format!("in use by another worker: {}", folder.display());
                Err(Error::Invalid { what: "state", found, expected: "a folder for each worker (--state)".into() })
            }
            Err(std::fs::TryLockError::Error(source)) => Err(failed(source)),
        }
    }

    /// What is kept there: papers, and the authority.
    ///
    /// # Errors
    /// If it cannot be read, or is damaged.
    pub(crate) fn read(&self) -> Result<Option<(Papers, String)>, Error> {
        let path = self.folder.join(PAPERS);
        if !path.exists() {
            return Ok(None);
        }
        let text = read(&path)?;
        let papers = Papers::new(text.clone(), text).map_err(|found| damaged(&path, found))?;
        Ok(Some((papers, read(&self.folder.join(AUTHORITY))?)))
    }

    /// Keeps new papers; `authority` if that is new, too.
    ///
    /// # Errors
    /// If the folder does not take them.
    pub(crate) fn keep(&self, papers: &Papers, authority: Option<&str>) -> Result<(), Error> {
        if let Some(authority) = authority {
            write_private(&self.folder.join(AUTHORITY), authority)?;
        }
        write_private(&self.folder.join(PAPERS), &format!("{}\n{}", papers.certificate, papers.key))
    }
}

fn damaged(path: &Path, found: String) -> Error {
    Error::Invalid { what: "certificate", found: format!("{}: {found}", path.display()), expected: "a worker's certificate and key".into() }
}

/// Reads a text file of moderate size.
///
/// # Errors
/// If it cannot be read, or is too large.
pub(crate) fn read(path: &Path) -> Result<String, Error> {
    let failed = |source| Error::Io { what: format!("{}", path.display()), source };
    let size = std::fs::metadata(path).map_err(failed)?.len();
    if size > LARGEST {
        return Err(Error::Invalid {
            what: "file",
            found: format!("{}: {size} bytes", path.display()),
            expected: "less than 1 MiB".into(),
        });
    }
    std::fs::read_to_string(path).map_err(failed)
}

/// Writes a file that only its owner can read, whole or not at all.
fn write_private(path: &Path, text: &str) -> Result<(), Error> {
    let failed = |source| Error::Io { what: format!("{}", path.display()), source };
    let beside = path.with_extension("new");
    // One that was left behind may have other permissions.
    let _absent = std::fs::remove_file(&beside);
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(&beside).map_err(failed)?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(failed)?;
    std::fs::rename(&beside, path).map_err(failed)
}
