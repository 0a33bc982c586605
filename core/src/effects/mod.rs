//! What a scene calls for, told from its description alone: the plan picks from it, and people read it.

mod analyse;
mod set;

pub use analyse::analyse;
pub use set::{Effect, Effects};
