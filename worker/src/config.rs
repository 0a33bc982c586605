//! What a worker needs to know before it starts.

use std::path::PathBuf;

use crate::credential::Credential;
use crate::error::Error;

/// Longest name [bytes].
const NAME: usize = 200;
/// Most rendering threads.
const THREADS: usize = 1024;

/// Configuration of a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Config {
    /// Where the coordinator listens for workers, such as `http://127.0.0.1:7781`.
    pub coordinator: String,
    /// Where other coordinators of the same farm listen.
    pub others: Vec<String>,
    /// What the worker shows the coordinators.
    pub credential: Credential,
    /// For people; at most 200 bytes.
    pub name: String,
    /// Rendering threads, 1 to 1024; each renders one unit at a time.
    pub threads: usize,
    /// Folder for assets by content, or `None` to keep them only while a scene is being compiled.
    pub cache: Option<PathBuf>,
    /// Most bytes of assets kept in the folder.
    pub cache_bytes: u64,
    /// Most compiled scenes kept in memory, ≥ 1.
    pub scenes: usize,
}

impl Config {
    /// A worker with the given number of threads, no token, no folder, and two scenes in memory.
    pub fn new(coordinator: impl Into<String>, name: impl Into<String>, threads: usize) -> Self {
        Self {
            coordinator: coordinator.into(),
            others: Vec::new(),
            credential: Credential::None,
            name: name.into(),
            threads,
            cache: None,
            cache_bytes: 32 << 30,
            scenes: 2,
        }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let invalid = |what, found: String, expected: String| Err(Error::Invalid { what, found, expected });
        if self.name.len() > NAME {
            return invalid("name", format!("{} bytes long", self.name.len()), format!("at most {NAME} bytes"));
        }
        if !(1..=THREADS).contains(&self.threads) {
            return invalid("threads", self.threads.to_string(), format!("1 to {THREADS}"));
        }
        if self.scenes == 0 {
            return invalid("scenes", "0".into(), "1 or more".into());
        }
        if let Some(wrong) = [&self.coordinator].into_iter().chain(&self.others).find(|url| !url.starts_with("http://")) {
            let expected = "an address such as http://127.0.0.1:7781; TLS is not spoken yet".into();
            return invalid("coordinator", format!("{wrong:?}"), expected);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_outside_their_range_are_named() {
        let usual = Config::new("http://127.0.0.1:1", "w", 2);
        assert!(usual.check().is_ok());
        let threads = Config { threads: 0, ..usual.clone() }.check().unwrap_err().to_string();
        assert_eq!(threads, "threads is 0, expected 1 to 1024");
        let scheme = Config { coordinator: "https://farm".into(), ..usual }.check().unwrap_err().to_string();
        assert!(scheme.contains("TLS is not spoken yet"), "{scheme}");
    }
}
