//! Hazards: scenes and calls that break renderers, each with an invariant stronger than the absence of NaN.
//!
//! Every film of the suite besides: no value was ever not finite, and least squares keep the sum of the primal (`harness::sound`).
//! Every scene is rendered by every technique. `surfaces`: what light meets. `shapes`: where it meets it. `lights`: where it comes from.
//! `media`: what lies between. `paths`: the way as a whole. `films`: what is measured. The name of a test is the name of the hazard; its
//! first lines say what must hold.

#![allow(clippy::unwrap_used, clippy::panic)]

mod films;
mod harness;
mod lights;
mod media;
mod paths;
mod shapes;
mod surfaces;
