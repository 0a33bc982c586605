//! Names of jobs and workers.

use std::fmt;
use std::str::FromStr;

use uuid::Uuid;

/// A text that is no identifier.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is no identifier: expected a UUID such as 01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11")]
pub struct ParseIdError {
    found: String,
}

macro_rules! identifier {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(Uuid);

        impl $name {
            /// A new one; later ones sort after earlier ones.
            pub fn fresh() -> Self {
                Self(Uuid::now_v7())
            }

            /// From the 16 bytes of a message or a row.
            pub fn from_bytes(bytes: [u8; 16]) -> Self {
                Self(Uuid::from_bytes(bytes))
            }

            /// The 16 bytes.
            pub fn to_bytes(self) -> [u8; 16] {
                self.0.into_bytes()
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(&self.0, f)
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(&self.0, f)
            }
        }

        impl FromStr for $name {
            type Err = ParseIdError;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                Uuid::parse_str(text).map(Self).map_err(|_| ParseIdError { found: text.chars().take(80).collect() })
            }
        }
    };
}

identifier! {
    /// Names a job. Jobs submitted later sort after those submitted earlier.
    JobId
}

identifier! {
    /// Names one run of a worker process; it stays the same over reconnections.
    WorkerId
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_back() {
        let (first, second) = (JobId::fresh(), JobId::fresh());
        assert!(first < second);
        assert_eq!(first.to_string().parse(), Ok(first));
        assert_eq!(JobId::from_bytes(first.to_bytes()), first);
        assert!("not-a-job".parse::<JobId>().is_err());
    }
}
