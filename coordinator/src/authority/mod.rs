//! The farm's own certificate authority: who may be a worker, from the join token to the last renewal.
//!
//! `certificates` signs, `join` is the token that lets somebody ask once, `registry` remembers who was enrolled and who was thrown out.

mod certificates;
mod join;
mod registry;

pub use certificates::{Authority, AuthorityError, DAY};
pub use join::{Join, JoinView, NewJoin};
pub use registry::{EnrolError, Enrolled, EnrolledView, Registry};
