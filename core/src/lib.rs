//! gradfarm's core: gradient-domain light transport as pure computation.
//!
//! The modules read top to bottom as the way of the light; each may use only those above it (see `ARCHITECTURE.md`).

// storey 1: ground
pub mod lattice;
// storey 5: methods
pub mod film;
// storey 6: composition
pub mod plan;
