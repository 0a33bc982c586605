//! The film as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The film: a lattice of square pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Film {
    /// Width in pixels.
    #[schemars(range(min = 1, max = 65536))]
    pub width: u32,
    /// Height in pixels.
    #[schemars(range(min = 1, max = 65536))]
    pub height: u32,
    /// The part that is rendered; without it all of the film.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
    /// How radiance around a pixel's centre makes its value.
    #[serde(default, skip_serializing_if = "Filter::is_box")]
    pub filter: Filter,
}

/// A part of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Crop {
    /// Its first column.
    pub x: u32,
    /// Its first row.
    pub y: u32,
    /// Its width in pixels, ≥ 1.
    pub width: u32,
    /// Its height in pixels, ≥ 1.
    pub height: u32,
}

/// A reconstruction filter, normalised to one. Sampled by its own density: each sample belongs to one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// The mean over the pixel's area.
    #[default]
    Box,
    /// A tent that falls to zero at `radius` pixels.
    Tent(Tent),
    /// A Gaussian, lowered so that it is zero at `radius` pixels.
    Gaussian(Gaussian),
    /// Mitchell and Netravali's cubic over ±2 pixels. Its negative lobes sharpen.
    Mitchell(Mitchell),
}

impl Filter {
    fn is_box(&self) -> bool {
        *self == Filter::Box
    }
}

/// A tent filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tent {
    /// Half its width [pixels], in (0, 8].
    #[serde(default = "one")]
    pub radius: f64,
}

/// A Gaussian filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gaussian {
    /// Standard deviation [pixels], > 0.
    #[serde(default = "half")]
    pub deviation: f64,
    /// Half its width [pixels], in (0, 8].
    #[serde(default = "two")]
    pub radius: f64,
}

/// Mitchell and Netravali's filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mitchell {
    /// Parameter B, in [0, 1].
    #[serde(default = "third")]
    pub b: f64,
    /// Parameter C, in [0, 1].
    #[serde(default = "third")]
    pub c: f64,
}

impl Default for Film {
    fn default() -> Film {
        Film { width: 256, height: 256, crop: None, filter: Filter::Box }
    }
}

impl Film {
    /// A film of this size, whole, with the box filter.
    pub fn new(width: u32, height: u32) -> Film {
        Film { width, height, ..Film::default() }
    }

    /// Width and height of what is rendered [pixels].
    pub fn rendered(&self) -> (u32, u32) {
        self.crop.map_or((self.width, self.height), |crop| (crop.width, crop.height))
    }
}

fn one() -> f64 {
    1.0
}

fn half() -> f64 {
    0.5
}

fn two() -> f64 {
    2.0
}

fn third() -> f64 {
    1.0 / 3.0
}
