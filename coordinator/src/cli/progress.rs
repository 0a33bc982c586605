//! The progress bar of `render`, `watch` and `submit --wait`: on standard error, and only if that is a terminal.

use std::fmt::Write;
use std::time::Duration;

use gradfarm_core::accuracy::Estimate;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use super::accuracy::seconds;
use crate::plot::number;

/// Shows how many samples of a job are done, how fast they come, and how long it will take.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar that says what is being done.
    pub(super) fn new(message: &str) -> Self {
        let bar = ProgressBar::new(0).with_style(style()).with_message(message.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    /// So many of so many samples.
    pub(super) fn show(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
    }

    /// Says what is being done now.
    pub(super) fn say(&self, message: &str) {
        self.bar.set_message(message.to_owned());
    }

    /// Says how large the error is, and how long it takes to what was asked.
    pub(super) fn say_error(&self, error: &Estimate, target: Option<f64>, seconds_left: Option<f64>) {
        self.say(&error_told(error, target, seconds_left));
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// The error in few words.
pub(super) fn error_told(error: &Estimate, target: Option<f64>, seconds_left: Option<f64>) -> String {
    let left = seconds_left.map(|left| format!(", {} more", seconds(left))).unwrap_or_default();
    let target = target.map(|target| format!(" of {}", number(target))).unwrap_or_default();
    format!("relMSE {:.1e} ({:.1e} to {:.1e}){target}{left}", error.relmse, error.low, error.high)
}

fn style() -> ProgressStyle {
    let speed = |state: &ProgressState, out: &mut dyn Write| {
        let _ = out.write_str(&rate(state.per_sec()));
    };
    // The template is a constant, so the plain bar is never used; it only saves a panic.
    ProgressStyle::with_template("{msg:12} {wide_bar} {percent:>3} %  {speed:>16}  {eta:>4} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("speed", speed)
}

/// A number of samples per second, for people.
pub(super) fn rate(samples_per_second: f64) -> String {
    match samples_per_second {
        rate if rate >= 1e6 => format!("{:.2} M samples/s", rate / 1e6),
        rate if rate >= 1e3 => format!("{:.1} k samples/s", rate / 1e3),
        rate => format!("{rate:.0} samples/s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_is_sound() {
        assert!(ProgressStyle::with_template("{msg:12} {wide_bar} {percent:>3} %  {speed:>16}  {eta:>4} left").is_ok());
        assert_eq!(rate(1_234_567.0), "1.23 M samples/s");
        assert_eq!(rate(1500.0), "1.5 k samples/s");
        assert_eq!(rate(12.4), "12 samples/s");
        let error = Estimate { relmse: 0.012, low: 0.01, high: 0.014 };
        assert_eq!(error_told(&error, Some(0.01), Some(3.5)), "relMSE 1.2e-2 (1.0e-2 to 1.4e-2) of 0.01, 3.5 s more");
        assert_eq!(error_told(&error, None, None), "relMSE 1.2e-2 (1.0e-2 to 1.4e-2)");
    }
}
