//! Work that one coordinator at a time does for all.

use std::any::Any;
use std::fmt;

/// The work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Singleton {
    /// Removing content that nobody names.
    Sweep,
}

impl Singleton {
    /// Its number among the database's locks, below a common number.
    pub(super) fn number(self) -> i32 {
        match self {
            Singleton::Sweep => 1,
        }
    }
}

/// As long as it is held, nobody else does the work.
pub struct Alone {
    _lock: Option<Box<dyn Any + Send>>,
}

impl Alone {
    /// There is nobody else.
    pub(super) fn always() -> Self {
        Self { _lock: None }
    }

    /// As long as `lock` lives.
    pub(super) fn with(lock: impl Any + Send) -> Self {
        Self { _lock: Some(Box::new(lock)) }
    }
}

impl fmt::Debug for Alone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Alone")
    }
}
