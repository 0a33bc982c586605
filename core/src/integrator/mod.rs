//! Integrators: who draws base paths, one file each.

mod path;

pub use path::PathIntegrator;
