//! What the tests of the whole system share: statistics, scenes with closed forms, frames rendered without a farm, and the programs.

pub mod frame;
pub mod programs;
pub mod scenes;
pub mod statistics;
