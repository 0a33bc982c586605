//! The coordinator of the farm: takes jobs, cuts them into units, leases these to workers and assembles the results.
//!
//! `service` is the way in: it opens the state, runs the loop and hands out handles. `job` is the pure state machine of one job,
//! `schedule` decides who gets what, `store` keeps what was acknowledged, `assemble` makes frames of results, `grpc` speaks to
//! workers. `cli` and `api` are for people: the command line and HTTP, `plot` draws for both, `movie` is what is made of frames; `embedded` starts workers in this process, `metrics` names what is counted, `webhook` tells others.

pub mod access;
pub mod api;
mod assemble;
pub mod authority;
pub mod cli;
pub mod clock;
pub mod config;
pub mod crypto;
pub mod embedded;
pub mod error;
mod grpc;
pub mod job;
pub mod metrics;
pub mod movie;
pub mod oidn;
pub mod plot;
#[cfg(test)]
#[allow(unreachable_pub, dead_code)]
#[path = "../../tests/src/postgres.rs"]
mod postgres;
pub mod preview;
pub mod request;
#[cfg(test)]
#[allow(unreachable_pub, dead_code)]
#[path = "../../tests/src/s3.rs"]
mod s3;
pub mod schedule;
pub mod service;
pub mod store;
pub mod study;
pub mod telemetry;
pub mod tls;
pub mod webhook;
