//! A planar image: the one buffer type that film, reconstruction, metrics and output share.

use crate::lattice::Extent;

/// `channels` planes of `width × height` values each, planes one after the other, rows top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    extent: Extent,
    channels: usize,
    data: Vec<f32>,
}

impl Image {
    /// An image of zeros.
    pub fn new(extent: Extent, channels: usize) -> Self {
        Self { extent, channels, data: vec![0.0; extent.pixels() * channels] }
    }

    /// Wraps planar data. `None` if its length is not `width × height × channels`.
    pub fn from_planes(extent: Extent, channels: usize, data: Vec<f32>) -> Option<Self> {
        (data.len() == extent.pixels() * channels).then_some(Self { extent, channels, data })
    }

    /// Size [pixels].
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Number of planes.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// One plane, row-major.
    pub fn plane(&self, channel: usize) -> &[f32] {
        let n = self.extent.pixels();
        &self.data[channel * n..(channel + 1) * n]
    }

    /// One plane, row-major, to be written.
    pub fn plane_mut(&mut self, channel: usize) -> &mut [f32] {
        let n = self.extent.pixels();
        &mut self.data[channel * n..(channel + 1) * n]
    }

    /// Value of one channel of one pixel.
    pub fn at(&self, x: u32, y: u32, channel: usize) -> f32 {
        self.plane(channel)[self.extent.index(x, y)]
    }

    /// Sets one channel of one pixel.
    pub fn set(&mut self, x: u32, y: u32, channel: usize, value: f32) {
        let index = self.extent.index(x, y);
        self.plane_mut(channel)[index] = value;
    }

    /// All planes, one after the other.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All planes, to be written.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }
}
