//! The first tokens, handed to the user of this machine as files that nobody else can read.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::gate::{Gate, NewToken};
use super::role::Role;
use super::secret::Secret;
use crate::error::Error;

/// The file with the administrator's token, in the coordinator's folder.
pub const ADMIN_TOKEN: &str = "token";
/// The same as a header line, for `curl --header @FILE`.
const ADMIN_HEADER: &str = "token.header";
/// The file with the token of workers on this machine.
pub const WORKER_TOKEN: &str = "worker-token";

/// A private file could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct PrivateFileError {
    /// Which.
    pub path: PathBuf,
    /// What the system said.
    pub source: std::io::Error,
}

/// Writes a file that only its owner can read (mode 0600), whole or not at all, and durable.
///
/// # Errors
/// If the folder does not take it.
pub fn write_private(path: &Path, bytes: &[u8]) -> Result<(), PrivateFileError> {
    let failed = |source| PrivateFileError { path: path.to_path_buf(), source };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Temporary files are made with mode 0600, so it is private from its first byte on.
    let mut file = tempfile::Builder::new().prefix(".gradfarm-").tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map(drop).map_err(|fault| failed(fault.error))
}

/// Makes sure that the coordinator's folder holds a good administrator's token and a good worker's token. Whoever can write to the
/// folder rules the farm anyway: this lets them in without any set-up.
///
/// # Errors
/// If the store or the folder fails.
pub async fn hand_out(gate: &Gate, folder: &Path) -> Result<(), Error> {
    let admin = hand_out_one(gate, &folder.join(ADMIN_TOKEN), Role::Admin).await?;
    let header = format!("Authorization: Bearer {}\n", admin.expose());
    write_private(&folder.join(ADMIN_HEADER), header.as_bytes())?;
    hand_out_one(gate, &folder.join(WORKER_TOKEN), Role::Worker).await?;
    Ok(())
}

async fn hand_out_one(gate: &Gate, path: &Path, role: Role) -> Result<Secret, Error> {
    if let Ok(text) = std::fs::read_to_string(path)
        && let Ok(secret) = Secret::parse(&text)
        && gate.identify(Some(secret.expose())).await.is_ok_and(|caller| caller.role == role)
    {
        // Written again, so that it is private even if somebody changed that.
        write_private(path, format!("{}\n", secret.expose()).as_bytes())?;
        return Ok(secret);
    }
    let name = format!("{role} of {}", path.parent().unwrap_or(path).display());
    let issued = gate.issue(NewToken { name, role, projects: Vec::new(), ttl: None }, "the coordinator").await?;
    write_private(path, format!("{}\n", issued.secret.expose()).as_bytes())?;
    Ok(issued.secret)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::store::Memory;

    #[tokio::test]
    async fn the_folder_holds_good_tokens_and_keeps_them() {
        let folder = tempfile::tempdir().unwrap();
        let gate = Gate::new(Arc::new(Memory::new()));
        hand_out(&gate, folder.path()).await.unwrap();
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        let (admin, worker) = (read(ADMIN_TOKEN), read(WORKER_TOKEN));
        assert_eq!(gate.identify(Some(admin.trim())).await.unwrap().role, Role::Admin);
        assert_eq!(gate.identify(Some(worker.trim())).await.unwrap().role, Role::Worker);
        assert_eq!(read(ADMIN_HEADER), format!("Authorization: Bearer {admin}"));
        hand_out(&gate, folder.path()).await.unwrap();
        assert_eq!((read(ADMIN_TOKEN), read(WORKER_TOKEN)), (admin.clone(), worker));

        // One that is worth nothing any more is replaced.
        let id = gate.identify(Some(admin.trim())).await.unwrap().id;
        gate.revoke(&id).await.unwrap();
        hand_out(&gate, folder.path()).await.unwrap();
        assert_ne!(read(ADMIN_TOKEN), admin);
        assert!(gate.identify(Some(admin.trim())).await.is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_private_file_is_private() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        std::fs::write(&path, "old").unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o644)).unwrap();
        write_private(&path, b"new").unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
    }
}
