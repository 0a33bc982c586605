//! What a coordinator's folder tells the commands on its machine: its address, and the token to show there.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::error::Error;
use crate::access::{ADMIN_TOKEN, Secret};

/// Largest token file that is read [bytes].
const LARGEST: u64 = 64 << 10;

/// The address that the coordinator of this folder wrote down, if there is one.
pub(super) fn address(data: &Path) -> Option<String> {
    Some(told(data)?["http"].as_str()?.to_owned())
}

/// The file with the authority of its certificate, if `server` is that coordinator and has one of its own.
pub(super) fn authority(data: &Path, server: &str) -> Option<PathBuf> {
    is_of(data, server).then(|| told(data)?["authority"].as_str().map(PathBuf::from)).flatten()
}

fn told(data: &Path) -> Option<Value> {
    let text = std::fs::read_to_string(data.join("address.json")).ok()?;
    serde_json::from_str(&text).ok()
}

/// Whether an address is that of this folder's coordinator.
fn is_of(data: &Path, server: &str) -> bool {
    let same = |url: &str| url.replacen("//localhost:", "//127.0.0.1:", 1);
    address(data).is_some_and(|its| same(&its) == same(server))
}

/// The token of this folder's coordinator, if `server` is that coordinator: no other one is shown it.
pub(super) fn token(data: &Path, server: &str) -> Option<PathBuf> {
    is_of(data, server).then(|| data.join(ADMIN_TOKEN)).filter(|path| path.is_file())
}

/// Reads a token from a file.
///
/// # Errors
/// [`Error::Usage`] naming the file.
pub(super) fn read_token(path: &Path) -> Result<Secret, Error> {
    let wrong = |fault: &dyn std::fmt::Display| Error::Usage(format!("token file {}: {fault}", path.display()));
    let size = std::fs::metadata(path).map_err(|fault| wrong(&fault))?.len();
    if size > LARGEST {
        return Err(wrong(&format!("found {size} bytes, expected a token")));
    }
    let text = std::fs::read_to_string(path).map_err(|fault| wrong(&fault))?;
    Secret::parse(&text).map_err(|fault| wrong(&fault))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_token_is_for_its_own_coordinator_alone() {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path();
        assert_eq!((address(data), token(data, "http://127.0.0.1:7700")), (None, None));
        std::fs::write(data.join("token"), "secret\n").unwrap();
        std::fs::write(data.join("address.json"), r#"{"http": "http://127.0.0.1:7700", "pid": 1}"#).unwrap();
        assert_eq!(address(data).as_deref(), Some("http://127.0.0.1:7700"));
        assert_eq!(token(data, "http://127.0.0.1:7700"), Some(data.join("token")));
        assert_eq!(token(data, "http://localhost:7700"), Some(data.join("token")));
        for other in ["http://127.0.0.1:7701", "http://10.0.0.1:7700", "https://127.0.0.1:7700"] {
            assert_eq!(token(data, other), None, "{other}");
        }
        assert_eq!(read_token(&data.join("token")).unwrap().expose(), "secret");
        std::fs::write(data.join("token"), "").unwrap();
        assert!(read_token(&data.join("token")).is_err() && read_token(data).is_err());
    }
}
