//! What the tests of the whole system share: statistics, scenes with closed forms, and frames rendered without a farm.

pub mod frame;
pub mod scenes;
pub mod statistics;
