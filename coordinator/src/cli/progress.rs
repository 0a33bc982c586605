//! The progress bar of `render`, `watch` and `submit --wait`: on standard error, and only if that is a terminal.

use std::fmt::Write;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

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
    }
}
