//! Which moments each window covers, and how much each window counts for a moment.

use std::ops::Range;

/// Windows over a row of moments: every `stride` moments one of `window` moments. The last one is shifted back so that it is full, and
/// where there are fewer moments than a window has there is one window over all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Windows {
    count: u32,
    window: u32,
    stride: u32,
}

impl Windows {
    /// Over `count` moments. Neither a window nor a stride is shorter than one moment, nor a stride longer than a window: every moment is covered.
    pub fn new(count: u32, window: u32, stride: u32) -> Self {
        let window = window.clamp(1, count.max(1));
        Self { count, window, stride: stride.clamp(1, window) }
    }

    /// How many windows there are.
    pub fn len(self) -> u32 {
        if self.count == 0 { 0 } else { 1 + (self.count - self.window).div_ceil(self.stride) }
    }

    /// Whether there is none, because there is no moment.
    pub fn is_empty(self) -> bool {
        self.count == 0
    }

    /// The moments of window k; empty beyond the last one.
    pub fn moments(self, k: u32) -> Range<u32> {
        if k >= self.len() {
            return 0..0;
        }
        let start = k.saturating_mul(self.stride).min(self.count - self.window);
        start..start + self.window
    }

    /// The windows over a moment, a run of them.
    pub fn over(self, moment: u32) -> Range<u32> {
        let mut covering = (0..self.len()).filter(|k| self.moments(*k).contains(&moment));
        match covering.next() {
            Some(first) => first..covering.next_back().unwrap_or(first) + 1,
            None => 0..0,
        }
    }

    /// What the image that window k has of a moment is multiplied by: Hann's window 0.5 (1 + cos(2π (x − c) / L)) about the middle c of the
    /// window of length L, over the sum of it over all windows that cover the moment. Added up from the first window to the last, the weights
    /// of a moment make exactly 1. 0 for a window that does not cover it.
    pub fn weight(self, k: u32, moment: u32) -> f32 {
        let windows = self.over(moment);
        if !windows.contains(&k) {
            return 0.0;
        }
        let total: f64 = windows.clone().map(|k| self.hann(k, moment)).sum();
        let share = |k: u32| (self.hann(k, moment) / total) as f32;
        if k + 1 < windows.end { share(k) } else { 1.0 - (windows.start..k).map(share).sum::<f32>() }
    }

    fn hann(self, k: u32, moment: u32) -> f64 {
        let length = f64::from(self.window);
        let middle = f64::from(self.moments(k).start) + 0.5 * (length - 1.0);
        0.5 * (1.0 + libm::cos(2.0 * std::f64::consts::PI * (f64::from(moment) - middle) / length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_every_moment_and_their_weights_make_exactly_one() {
        for count in 1..=60 {
            for (window, stride) in [(10, 5), (1, 1), (10, 1), (7, 7), (4, 3), (60, 10), (100, 3)] {
                let windows = Windows::new(count, window, stride);
                for k in 0..windows.len() {
                    assert_eq!(windows.moments(k).len() as u32, window.min(count), "{windows:?}, window {k}");
                    assert!(k == 0 || windows.moments(k).start > windows.moments(k - 1).start, "{windows:?}: window {k} adds nothing");
                }
                for moment in 0..count {
                    let over = windows.over(moment);
                    assert!((0..windows.len()).all(|k| over.contains(&k) == windows.moments(k).contains(&moment)), "{windows:?}");
                    let weights: Vec<f32> = over.clone().map(|k| windows.weight(k, moment)).collect();
                    assert!(weights.iter().all(|w| *w > 0.0 && *w <= 1.0), "{windows:?}, moment {moment}: {weights:?}");
                    assert_eq!(weights.iter().sum::<f32>(), 1.0, "{windows:?}, moment {moment}: {weights:?}");
                    assert_eq!(windows.weight(over.end, moment), 0.0);
                }
            }
        }
    }

    #[test]
    fn weights_fall_from_the_middle_of_a_window() {
        let windows = Windows::new(20, 10, 5);
        assert_eq!((0..windows.len()).map(|k| windows.moments(k)).collect::<Vec<_>>(), [0..10, 5..15, 10..20]);
        // Two of Hann's windows half a length apart add up to 1 by themselves.
        for moment in 5..10 {
            let away = f64::from(moment) - 4.5;
            let hann = 0.5 * (1.0 + (2.0 * std::f64::consts::PI * away / 10.0).cos());
            assert!((f64::from(windows.weight(0, moment)) - hann).abs() < 1e-6);
        }
        assert_eq!((windows.weight(0, 4), windows.weight(2, 15)), (1.0, 1.0));
        assert!(Windows::new(0, 10, 5).is_empty() && Windows::new(0, 10, 5).over(0).is_empty());
    }
}
