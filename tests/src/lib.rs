//! What the tests of the whole system share: statistics, scenes with closed forms, frames and moments rendered without a farm, laws of shifts, images by another renderer, the programs, a
//! PostgreSQL and an S3 server, a browser, a network of machines, and a farm of separate processes.

pub mod animation;
pub mod browser;
pub mod effort;
pub mod farm;
pub mod frame;
pub mod laws;
pub mod machines;
pub mod postgres;
pub mod programs;
pub mod s3;
pub mod scenes;
pub mod statistics;
pub mod stopping;
pub mod truth;
