//! Who gets which unit, and for how long. Pure functions: no clock, no store, no channel. The wanted properties are in `README.md`.

pub mod aside;
pub mod assign;
pub mod share;
pub mod split;
pub mod waiting;

pub use aside::Aside;
pub use assign::{Queue, choose};
pub use share::Shares;
pub use split::{Place, Split, TooManyUnits};
pub use waiting::{Facts, Reached, Waiting};
