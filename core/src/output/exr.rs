//! OpenEXR: one part, the image in the default layer, everything else as channels with a layer's prefix: what every viewer opens.
//!
//! Equal images give equal bytes on any number of threads: no time stamps, channels and attributes in the order of their names,
//! blocks in the order of their rows, ZIP compression, which is lossless.

mod canonical;
mod read;
#[cfg(test)]
mod tests;

pub use read::{layers, read_layer, read_metadata, read_rgb};

use super::Error;
use crate::film::Image;
use crate::lattice::Extent;
use ::exr::block::lines::LineRefMut;
use ::exr::image::write::samples::{SamplesWriter, WritableSamples};
use ::exr::math::RoundingMode;
use ::exr::meta::attribute::{LevelMode, SampleType};
use ::exr::meta::header::Header;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, Image as ExrImage, Layer, LayerAttributes, Text, Vec2, WritableImage,
};
use std::io::{Cursor, Seek, Write};

/// What a file holds.
#[derive(Clone, Debug)]
pub struct Layers<'a> {
    /// The image. RGB.
    pub image: &'a Image,
    /// Further layers by name, of three channels (`R`, `G`, `B`; for `normal` `X`, `Y`, `Z`) or one (`Z` for `depth`, else `Y`).
    pub named: Vec<(&'static str, &'a Image)>,
}

/// What is said about the image. Each field is a text attribute `gradfarm:…` of the file, in UTF-8.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata {
    /// Job that made it.
    pub job: String,
    /// Its seed.
    pub seed: u64,
    /// Technique.
    pub technique: String,
    /// Reconstruction.
    pub reconstruction: String,
    /// Why it was chosen for this very frame, where it was.
    pub choice: Option<String>,
    /// Samples per pixel.
    pub samples: u32,
    /// Version of this program.
    pub version: String,
}

const JOB: &str = "gradfarm:job";
const SEED: &str = "gradfarm:seed";
const TECHNIQUE: &str = "gradfarm:technique";
const RECONSTRUCTION: &str = "gradfarm:reconstruction";
const CHOICE: &str = "gradfarm:choice";
const SAMPLES: &str = "gradfarm:samples";
const VERSION: &str = "gradfarm:version";

/// Pixels of one file at most: 16 384 × 16 384, 3 GiB of RGB.
const MOST_PIXELS: usize = 1 << 28;

/// Writes a file.
///
/// # Errors
/// If there are no pixels or too many, layers differ in size, share a name, or have other than 1 or 3 channels, or writing fails.
pub fn write(mut out: impl Write + Seek, layers: &Layers, metadata: &Metadata) -> Result<(), Error> {
    let extent = layers.image.extent();
    check_pixels(extent.width as usize, extent.height as usize)?;
    let mut channels = channels("", layers.image, extent)?;
    for (k, (name, image)) in layers.named.iter().enumerate() {
        if name.is_empty() || layers.named[..k].iter().any(|(before, _)| before == name) {
            return Err(Error::Twice { layer: (*name).into() });
        }
        channels.extend(self::channels(name, image, extent)?);
    }
    let mut attributes = LayerAttributes { software_name: Some(text("gradfarm")), ..LayerAttributes::default() };
    attributes.other.extend(metadata.attributes().map(|(name, value)| (text(name), AttributeValue::Text(text(&value)))));
    let size = (extent.width as usize, extent.height as usize);
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels.into()));
    let mut file = Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().to_buffered(&mut file)?;
    let mut file = file.into_inner();
    canonical::sort_attributes(&mut file)?;
    Ok(out.write_all(&file)?)
}

impl Metadata {
    fn attributes(&self) -> impl Iterator<Item = (&'static str, String)> {
        let always = [
            (JOB, self.job.clone()),
            (SEED, self.seed.to_string()),
            (TECHNIQUE, self.technique.clone()),
            (RECONSTRUCTION, self.reconstruction.clone()),
            (SAMPLES, self.samples.to_string()),
            (VERSION, self.version.clone()),
        ];
        always.into_iter().chain(self.choice.clone().map(|choice| (CHOICE, choice)))
    }
}

/// The bytes of a string as they are: the library's own conversions panic on characters beyond Latin-1.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn check_pixels(width: usize, height: usize) -> Result<(), Error> {
    match width.saturating_mul(height) {
        1..=MOST_PIXELS => Ok(()),
        _ => Err(Error::Pixels { width, height, most: MOST_PIXELS }),
    }
}

fn channels<'a>(layer: &str, image: &'a Image, extent: Extent) -> Result<Vec<AnyChannel<Plane<'a>>>, Error> {
    let found = image.extent();
    if found != extent {
        let (found_width, found_height) = (found.width, found.height);
        return Err(Error::Size { layer: layer.into(), found_width, found_height, width: extent.width, height: extent.height });
    }
    let names: &[&str] = match (image.channels(), layer) {
        (3, "normal") => &["X", "Y", "Z"],
        (3, _) => &["R", "G", "B"],
        (1, "depth") => &["Z"],
        (1, layer) if !layer.is_empty() => &["Y"],
        (found, _) => return Err(Error::Channels { layer: layer.into(), found }),
    };
    let channel = |(k, name): (usize, &&str)| AnyChannel {
        name: text(&qualified(layer, name)),
        sample_data: Plane { width: extent.width as usize, values: image.plane(k) },
        quantize_linearly: false,
        sampling: Vec2(1, 1),
    };
    Ok(names.iter().enumerate().map(channel).collect())
}

/// A channel's name in the file: `dx.R`, or `R` in the default layer.
fn qualified(layer: &str, channel: &str) -> String {
    if layer.is_empty() { channel.into() } else { format!("{layer}.{channel}") }
}

/// One plane of an image, lent to the library: a film's planes together are too large to copy.
struct Plane<'a> {
    width: usize,
    values: &'a [f32],
}

impl<'a> WritableSamples<'a> for Plane<'_> {
    type Writer = Plane<'a>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'a self, _: &Header) -> Plane<'a> {
        Plane { width: self.width, values: self.values }
    }
}

impl SamplesWriter for Plane<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let at = line.location;
        let start = at.position.y() * self.width + at.position.x();
        line.write_samples_from_slice(&self.values[start..start + at.sample_count]).expect("a line in memory is as long as its row");
    }
}
