//! What a scene calls for, told from its description alone: the plan picks from it, and people read it.

mod analyse;
mod lights;
mod set;
mod surfaces;

pub use analyse::analyse;
pub use set::{Effect, Effects};
