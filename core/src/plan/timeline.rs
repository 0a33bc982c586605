//! Time: when frames are, how long their shutter is open, and how they are reconstructed together.

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
