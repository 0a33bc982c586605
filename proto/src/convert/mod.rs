//! Between messages and core types: `From` where nothing can be wrong, `TryFrom` where a peer may have sent nonsense.

mod film;
mod guide;
mod plan;
mod unit;

pub use guide::tile_guide;
pub use unit::{LeaseName, lease_ref, uuid};

/// A message that does not say what it should.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConvertError {
    /// A field that must be there is not.
    #[error("{field} is missing")]
    Missing {
        /// Path of the field.
        field: &'static str,
    },
    /// A value outside its range.
    #[error("{field} is {found}, expected {expected}")]
    Range {
        /// Path of the field.
        field: &'static str,
        /// What was sent.
        found: String,
        /// What is allowed.
        expected: String,
    },
}

impl ConvertError {
    pub(crate) fn range(field: &'static str, found: impl ToString, expected: impl Into<String>) -> Self {
        Self::Range { field, found: found.to_string(), expected: expected.into() }
    }
}

impl From<ConvertError> for tonic::Status {
    fn from(error: ConvertError) -> Self {
        tonic::Status::invalid_argument(error.to_string())
    }
}
