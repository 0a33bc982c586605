//! Paths and the contracts that every method signs: what a base path is, what a shift of it is, who draws and who shifts.
//!
//! A path is a *camera subpath* (vertices and the steps between them) and the *joints* by which it becomes full paths that end
//! on a light. The subpath is cached whole before anything is shifted. Drawing knows nothing of shifting and the reverse.

mod connection;
mod integrator;
mod leg;
mod offset;
mod shift;
mod subpath;
mod vertex;

pub use connection::{connect, turn};
pub use integrator::Integrator;
pub use leg::{Arrival, Collision, Landing, Leg, Passage, Stop, follow, passage_between, passage_to_light, seen, walk};
pub use offset::{OffsetEnd, OffsetStep, OffsetSubpath, ShiftFailure};
pub use shift::ShiftMap;
pub use subpath::{FirstSurface, Joint, Step, Strategy, Subpath};
pub use vertex::{Matter, Vertex};
