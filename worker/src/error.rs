//! Why a worker gives up for good.

/// An error that trying again does not mend.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The coordinator's address or its answer.
    #[error("coordinator {url}: {reason}")]
    Coordinator {
        /// Its address.
        url: String,
        /// What is wrong.
        reason: String,
    },
    /// A setting outside its range.
    #[error("{what} is {found}, expected {expected}")]
    Invalid {
        /// Which setting.
        what: &'static str,
        /// Its value.
        found: String,
        /// What is allowed.
        expected: String,
    },
    /// The operating system refused something.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: std::io::Error,
    },
}
