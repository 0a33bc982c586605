//! OpenEXR: one part, the image in the default layer, everything else as channels with a layer's prefix: what every viewer opens.
//!
//! Equal images give equal bytes: no time stamps, channels in the order of their names, lossless compression.

use super::Error;
use crate::film::Image;
use crate::lattice::Extent;
use ::exr::meta::MetaData;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes, ReadChannels, ReadLayers,
    Text, WritableImage,
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

/// What is said about the image. Written as JSON in the attribute `gradfarm`.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Metadata {
    /// Job that made it.
    pub job: String,
    /// Its seed.
    pub seed: u64,
    /// Technique.
    pub technique: String,
    /// Reconstruction.
    pub reconstruction: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Version of this program.
    pub version: String,
}

const ATTRIBUTE: &str = "gradfarm";
/// Values read from one file at most, over all channels of a layer: 4 GiB.
const MOST_VALUES: usize = 1 << 30;

/// Writes a file.
///
/// # Errors
/// If layers differ in size or have other than 1 or 3 channels, or writing fails.
pub fn write(out: impl Write + Seek, layers: &Layers, metadata: &Metadata) -> Result<(), Error> {
    let extent = layers.image.extent();
    let mut channels = Vec::new();
    push(&mut channels, "", layers.image, extent)?;
    for (name, image) in &layers.named {
        push(&mut channels, name, image, extent)?;
    }
    let mut attributes = LayerAttributes { software_name: text("gradfarm"), ..LayerAttributes::default() };
    // A struct of strings and numbers always has a JSON form.
    let json = serde_json::to_string(metadata).unwrap_or_default();
    attributes.other.insert(Text::from(ATTRIBUTE), AttributeValue::Text(Text::from(json.as_str())));
    let layer = Layer::new(
        (extent.width as usize, extent.height as usize),
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into()),
    );
    ExrImage::from_layer(layer).write().to_buffered(out)?;
    Ok(())
}

fn text(value: &str) -> Option<Text> {
    Some(Text::from(value))
}

fn push(channels: &mut Vec<AnyChannel<FlatSamples>>, layer: &str, image: &Image, extent: Extent) -> Result<(), Error> {
    if image.extent() != extent {
        let (found, wanted) = (image.extent(), extent);
        return Err(Error::Size {
            layer: layer.into(),
            found_width: found.width,
            found_height: found.height,
            width: wanted.width,
            height: wanted.height,
        });
    }
    let names: &[&str] = match (image.channels(), layer) {
        (3, "normal") => &["X", "Y", "Z"],
        (3, _) => &["R", "G", "B"],
        (1, "depth") => &["Z"],
        (1, _) => &["Y"],
        (found, _) => return Err(Error::Channels { layer: layer.into(), found }),
    };
    for (k, name) in names.iter().enumerate() {
        let name = if layer.is_empty() { (*name).to_string() } else { format!("{layer}.{name}") };
        channels.push(AnyChannel::new(Text::from(name.as_str()), FlatSamples::F32(image.plane(k).to_vec())));
    }
    Ok(())
}

/// Reads the default RGB of an OpenEXR file, written by this program or another.
///
/// # Errors
/// If it is no OpenEXR file, is too large, or has no channels R, G and B.
pub fn read_rgb(bytes: &[u8]) -> Result<Image, Error> {
    read_layer(bytes, "")
}

/// Reads the RGB channels of a named layer; `""` is the default layer.
///
/// # Errors
/// As [`read_rgb`].
pub fn read_layer(bytes: &[u8], layer: &str) -> Result<Image, Error> {
    let prefix = if layer.is_empty() { String::new() } else { format!("{layer}.") };
    read_channels(bytes, &["R", "G", "B"].map(|c| format!("{prefix}{c}")))
}

/// The metadata that this program wrote into a file, if any.
///
/// # Errors
/// If it is no OpenEXR file.
pub fn read_metadata(bytes: &[u8]) -> Result<Option<Metadata>, Error> {
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false)?.headers;
    Ok(headers.iter().find_map(|header| match header.own_attributes.other.get(&Text::from(ATTRIBUTE)) {
        Some(AttributeValue::Text(json)) => serde_json::from_str(&json.to_string()).ok(),
        _ => None,
    }))
}

fn read_channels(bytes: &[u8], wanted: &[String]) -> Result<Image, Error> {
    // Sizes stand in the header: look at them before anything of that size is allocated.
    for header in &MetaData::read_from_buffered(Cursor::new(bytes), false)?.headers {
        let (size, channels) = (header.layer_size, header.channels.list.len());
        if size.0.saturating_mul(size.1).saturating_mul(channels) > MOST_VALUES {
            return Err(Error::TooLarge { width: size.0, height: size.1, channels, most: MOST_VALUES });
        }
    }
    let file = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    let size = file.layer_data.size;
    let extent = Extent { width: size.0 as u32, height: size.1 as u32 };
    let list = &file.layer_data.channel_data.list;
    let mut image = Image::new(extent, wanted.len());
    for (k, name) in wanted.iter().enumerate() {
        let channel = list.iter().find(|c| c.name.eq(name.as_str())).ok_or_else(|| Error::MissingChannel {
            wanted: name.clone(),
            found: list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>().join(", "),
        })?;
        for (value, read) in image.plane_mut(k).iter_mut().zip(channel.sample_data.values_as_f32()) {
            *value = read;
        }
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(channels: usize, start: f32) -> Image {
        let extent = Extent { width: 7, height: 5 };
        Image::from_planes(extent, channels, (0..35 * channels).map(|k| start + k as f32 * 0.37).collect()).unwrap()
    }

    fn file() -> (Image, Vec<u8>) {
        let (image, primal, depth, normal) = (ramp(3, -3.0), ramp(3, 10.0), ramp(1, 0.5), ramp(3, 0.0));
        let layers = Layers { image: &image, named: vec![("primal", &primal), ("depth", &depth), ("normal", &normal)] };
        let metadata = Metadata { job: "j1".into(), seed: u64::MAX, technique: "gpt".into(), samples: 64, ..Metadata::default() };
        let mut out = Cursor::new(Vec::new());
        write(&mut out, &layers, &metadata).unwrap();
        (image, out.into_inner())
    }

    #[test]
    fn files_come_back_as_they_were() {
        let (image, bytes) = file();
        assert_eq!(read_rgb(&bytes).unwrap(), image);
        assert_eq!(read_layer(&bytes, "primal").unwrap(), ramp(3, 10.0));
        assert_eq!(read_channels(&bytes, &["depth.Z".into()]).unwrap(), ramp(1, 0.5));
        let metadata = read_metadata(&bytes).unwrap().unwrap();
        assert_eq!((metadata.seed, metadata.samples, metadata.job.as_str()), (u64::MAX, 64, "j1"));
        assert_eq!(bytes, file().1, "equal images give equal bytes");
    }

    #[test]
    fn bad_files_are_named() {
        let (_, bytes) = file();
        let missing = read_layer(&bytes, "albedo").unwrap_err().to_string();
        assert!(missing.contains("albedo.R") && missing.contains("primal.G"), "{missing}");
        assert!(matches!(read_rgb(b"not an image"), Err(Error::Exr(_))));
        assert!(read_rgb(&bytes[..bytes.len() / 2]).is_err());
        let (a, b) = (ramp(3, 0.0), Image::new(Extent { width: 2, height: 2 }, 3));
        let wrong = write(Cursor::new(Vec::new()), &Layers { image: &a, named: vec![("dx", &b)] }, &Metadata::default());
        assert!(wrong.unwrap_err().to_string().contains("2×2"));
    }
}
