//! gradfarm's core: gradient-domain light transport as pure computation.
//!
//! The modules read top to bottom as the way of the light; each may use only those above it (see `ARCHITECTURE.md`).

// storey 1: ground
pub mod accuracy;
pub mod lattice;
pub mod math;
pub mod sampling;
pub mod spectrum;
// storey 2: matter
pub mod geometry;
pub mod light;
pub mod material;
pub mod medium;
pub mod sensor;
pub mod texture;
// storey 3: scene, and what it calls for
pub mod scene;
// (effects → scene)
pub mod effects;
// storey 4: paths, the contract
pub mod path;
// storey 5: methods
pub mod film;
pub mod integrator;
pub mod metrics;
pub mod reconstruction;
pub mod shift;
// storey 6: composition
pub mod gradient;
pub mod output;
pub mod plan;
pub mod render;

#[cfg(test)]
mod testing;
