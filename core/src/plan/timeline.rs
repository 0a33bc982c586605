//! Time: when frames are, how long their shutter is open, and how they are reconstructed together.

use crate::sampling::{Dimension, SampleKey, SampleStream};

/// When the frames of an animated scene are, and how each is exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeline {
    /// Frames per second, > 0. Frame f is the time f / fps.
    pub fps: f64,
    /// Share of a frame's time in which the shutter is open, in [0, 1]; 0 shows a single instant.
    pub shutter: f64,
    /// Instants at which an open shutter sees the scene, ≥ 1.
    pub instants: u32,
}

impl Timeline {
    /// Frames per second where nothing else was asked.
    pub const FPS: f64 = 24.0;
    /// Instants of an open shutter where nothing else was asked.
    pub const INSTANTS: u32 = 16;
    /// Most instants: each is a compiled scene, as far as it moves.
    pub const MOST_INSTANTS: u32 = 256;

    /// How many instants the shutter sees.
    pub fn instants(&self) -> u32 {
        if self.shutter > 0.0 { self.instants.max(1) } else { 1 }
    }
}

impl Timeline {
    /// The time of a frame [s].
    pub fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / self.fps
    }

    /// The instants [s] that the shutter of a frame sees: one in each of as many equal parts of the time that it is open. Where in its
    /// part an instant lies depends on the seed and its number alone, so that a frame sees what another one sees of a thing at rest.
    pub fn seconds(&self, frame: u32, seed: u64) -> Vec<f64> {
        let count = self.instants();
        if count == 1 {
            return vec![self.time(frame)];
        }
        let jitter = |k: u32| {
            let key = SampleKey { seed: seed ^ SHUTTER, frame: 0, x: 0, y: 0, index: k };
            f64::from(SampleStream::open(key).number(Dimension::leg(0, 1)))
        };
        (0..count).map(|k| (f64::from(frame) + self.shutter * (f64::from(k) + jitter(k)) / f64::from(count)) / self.fps).collect()
    }
}

/// Keeps the numbers of shutters apart from those of pixels.
const SHUTTER: u64 = 0x7368_7574_7465_7273;

impl Default for Timeline {
    fn default() -> Self {
        Self { fps: Self::FPS, shutter: 0.0, instants: Self::INSTANTS }
    }
}

/// How moments are reconstructed together, by differences in time: half B of a moment and half A of the next one share their seeds.
///
/// # Source
/// Manzi, Kettunen, Durand, Zwicker and Lehtinen, "Temporal Gradient-Domain Path Tracing", ACM TOG 35(6), 2016.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Temporal {
    /// Moments of a window that is solved as a whole, ≥ 1.
    pub window: u32,
    /// Moments from the start of one window to that of the next, 1 to `window`.
    pub stride: u32,
    /// Whether half A of a moment follows what moved since the moment before.
    pub motion: bool,
}

impl Temporal {
    /// Most moments of a window: all of them are in memory at once.
    pub const MOST: u32 = 64;
}

impl Default for Temporal {
    fn default() -> Self {
        Self { window: 10, stride: 5, motion: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_shutter_sees_the_frame_s_own_time() {
        for (shutter, instants) in [(0.0, 16), (0.5, 1)] {
            let timeline = Timeline { fps: 25.0, shutter, instants };
            assert_eq!(timeline.seconds(50, 7), [2.0]);
        }
    }

    #[test]
    fn an_open_shutter_sees_each_part_of_its_time_once_and_every_frame_alike() {
        let timeline = Timeline { fps: 2.0, shutter: 0.5, instants: 8 };
        let first = timeline.seconds(0, 7);
        for (k, seconds) in first.iter().enumerate() {
            let part = 0.25 / 8.0;
            assert!((part * k as f64..part * (k + 1) as f64).contains(seconds), "instant {k} at {seconds} s");
        }
        let later = timeline.seconds(9, 7);
        assert!(first.iter().zip(&later).all(|(a, b)| (b - a - 4.5).abs() < 1e-12));
        assert_ne!(first, timeline.seconds(0, 8));
        assert_eq!(first, timeline.seconds(0, 7));
    }
}
