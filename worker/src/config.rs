//! What a worker needs to know before it starts.

use std::path::PathBuf;

/// Configuration of a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Config {
    /// Where the coordinator listens for workers, such as `http://127.0.0.1:7781`.
    pub coordinator: String,
    /// For people; at most 200 bytes.
    pub name: String,
    /// Rendering threads, ≥ 1; each renders one unit at a time.
    pub threads: usize,
    /// Folder for assets by content, or `None` to keep them in memory only.
    pub cache: Option<PathBuf>,
    /// Most bytes of assets kept in the folder.
    pub cache_bytes: u64,
    /// Most compiled scenes kept in memory, ≥ 1.
    pub scenes: usize,
}

impl Config {
    /// A worker with the given number of threads, no folder, and two scenes in memory.
    pub fn new(coordinator: impl Into<String>, name: impl Into<String>, threads: usize) -> Self {
        Self { coordinator: coordinator.into(), name: name.into(), threads, cache: None, cache_bytes: 32 << 30, scenes: 2 }
    }
}
