//! Processor time: what work costs, whatever else the machine does meanwhile.

use std::time::Instant;

/// Ticks of `/proc/self/stat` in a second: a constant of Linux's interface to programs.
const TICKS: f64 = 100.0;

/// Measures from its making on.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    wall: Instant,
    processor: Option<f64>,
}

impl Effort {
    /// From now on.
    pub fn start() -> Self {
        Self { wall: Instant::now(), processor: processor() }
    }

    /// Processor seconds of all threads since then, to a hundredth; seconds on the clock where the system does not tell.
    pub fn seconds(&self) -> f64 {
        match (self.processor, processor()) {
            (Some(before), Some(now)) => (now - before).max(1.0 / TICKS),
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

/// User and system time of this process [s].
fn processor() -> Option<f64> {
    of_stat(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// Fields 14 and 15; the name of the program, field 2, stands in parentheses and may hold spaces.
fn of_stat(text: &str) -> Option<f64> {
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some((next()? + next()?) / TICKS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_times_are_found_behind_any_name() {
        assert_eq!(of_stat("7 (a) b) R 1 2 3 4 5 6 7 8 9 10 150 25 0 0"), Some(1.75));
        assert_eq!(of_stat("nonsense"), None);
    }
}
