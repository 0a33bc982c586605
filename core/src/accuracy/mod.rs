//! What accuracy costs: the error of a frame against its samples and seconds, where it goes from here, and when to stop.
//!
//! Pure numbers. `point` is one measurement, `fit` the law through several, `curve` what it says about prices, `verdict` what follows
//! for a frame that is still being rendered. Who measures, and with which clock, is the caller's affair.

mod curve;
mod fit;
mod point;
mod verdict;

pub use curve::{Curve, Price};
pub use fit::{Cost, Fit};
pub use point::{Estimate, Point, Stop};
pub use verdict::{Reason, Verdict, expected_samples, first_check, verdict};
