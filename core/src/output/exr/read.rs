//! Reading OpenEXR, written by this program or another.

use super::{CHOICE, JOB, Metadata, RECONSTRUCTION, SAMPLES, SEED, TECHNIQUE, VERSION, check_pixels, qualified, text};
use crate::film::Image;
use crate::lattice::Extent;
use crate::output::Error;
use ::exr::meta::MetaData;
use ::exr::meta::header::Header;
use ::exr::prelude::{AttributeValue, Compression, ReadChannels, ReadLayers, ReadSpecificChannel, Vec2, read};
use std::io::Cursor;

/// Reads the default RGB of an OpenEXR file.
///
/// # Errors
/// If it is no OpenEXR file, is too large, is subsampled, is compressed as DWA or B44, or has no channels R, G and B.
pub fn read_rgb(bytes: &[u8]) -> Result<Image, Error> {
    read_first(bytes, "", &[&["R", "G", "B"]])
}

/// Reads a layer: its channels R, G, B or X, Y, Z as three planes, else Y or Z as one. `""` is the default layer.
///
/// # Errors
/// As [`read_rgb`], and if it has no such layer.
pub fn read_layer(bytes: &[u8], layer: &str) -> Result<Image, Error> {
    read_first(bytes, layer, &[&["R", "G", "B"], &["X", "Y", "Z"], &["Y"], &["Z"]])
}

/// The names of the layers of a file, each once, in the order of the file; `""` is the default one.
///
/// # Errors
/// If it is no OpenEXR file.
pub fn layers(bytes: &[u8]) -> Result<Vec<String>, Error> {
    let mut layers: Vec<String> = Vec::new();
    for name in headers(bytes)?.iter().flat_map(channel_names) {
        let layer = name.rsplit_once('.').map_or("", |(layer, _)| layer);
        if !layers.iter().any(|known| known == layer) {
            layers.push(layer.to_owned());
        }
    }
    Ok(layers)
}

/// The metadata that this program wrote into a file; `None` if another one wrote it.
///
/// # Errors
/// If it is no OpenEXR file.
pub fn read_metadata(bytes: &[u8]) -> Result<Option<Metadata>, Error> {
    Ok(headers(bytes)?.iter().find_map(metadata))
}

fn metadata(header: &Header) -> Option<Metadata> {
    let find = |name| match header.own_attributes.other.get(&text(name)) {
        Some(AttributeValue::Text(value)) => Some(String::from_utf8_lossy(value.as_slice()).into_owned()),
        _ => None,
    };
    Some(Metadata {
        job: find(JOB)?,
        seed: find(SEED)?.parse().ok()?,
        technique: find(TECHNIQUE)?,
        reconstruction: find(RECONSTRUCTION)?,
        choice: find(CHOICE),
        samples: find(SAMPLES)?.parse().ok()?,
        version: find(VERSION)?,
    })
}

fn headers(bytes: &[u8]) -> Result<Vec<Header>, Error> {
    Ok(MetaData::read_from_buffered(Cursor::new(bytes), false)?.headers.into_vec())
}

/// Reads the first of several sets of channels that some part of the file has.
fn read_first(bytes: &[u8], layer: &str, sets: &[&[&str]]) -> Result<Image, Error> {
    let headers = headers(bytes)?;
    let sets: Vec<Vec<String>> = sets.iter().map(|set| set.iter().map(|name| qualified(layer, name)).collect()).collect();
    for set in &sets {
        let has = |header: &&Header| !header.deep && set.iter().all(|name| channel_names(header).any(|found| found == *name));
        if let Some(header) = headers.iter().find(has) {
            check(header)?;
            return read_set(bytes, set);
        }
    }
    let found: Vec<String> = headers.iter().flat_map(channel_names).collect();
    Err(Error::MissingChannels { wanted: sets[0].join(", "), found: found.join(", ") })
}

fn channel_names(header: &Header) -> impl Iterator<Item = String> + '_ {
    header.channels.list.iter().map(|channel| String::from_utf8_lossy(channel.name.as_slice()).into_owned())
}

/// Sizes stand in the header: they are looked at before anything of that size is allocated.
fn check(header: &Header) -> Result<(), Error> {
    check_pixels(header.layer_size.x(), header.layer_size.y())?;
    match header.compression {
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ | Compression::PXR24 => {}
        // The library's decoders of these panic on broken files, or allocate what such a file says.
        other => return Err(Error::Compression { found: other.to_string() }),
    }
    match header.channels.list.iter().find(|channel| channel.sampling != Vec2(1, 1)) {
        Some(channel) => Err(Error::Subsampled {
            channel: String::from_utf8_lossy(channel.name.as_slice()).into_owned(),
            across: channel.sampling.x(),
            down: channel.sampling.y(),
        }),
        None => Ok(()),
    }
}

/// Reads only these channels, three or one, whatever else the file holds.
///
/// On one thread: a panic of the library on one of its own threads would end the process.
fn read_set(bytes: &[u8], set: &[String]) -> Result<Image, Error> {
    let bytes = Cursor::new(bytes);
    let extent = |size: Vec2<usize>| Extent { width: size.x() as u32, height: size.y() as u32 };
    let channels = read().no_deep_data().largest_resolution_level().specific_channels();
    Ok(match set {
        [a, b, c] => {
            let set_three = |image: &mut Image, at: Vec2<usize>, (a, b, c): (f32, f32, f32)| {
                [a, b, c].into_iter().enumerate().for_each(|(k, value)| image.set(at.x() as u32, at.y() as u32, k, value));
            };
            let channels = channels.required(text(a)).required(text(b)).required(text(c));
            let pixels = channels.collect_pixels(|size, _| Image::new(extent(size), 3), set_three);
            pixels.first_valid_layer().all_attributes().non_parallel().from_buffered(bytes)?.layer_data.channel_data.pixels
        }
        _ => {
            let set_one = |image: &mut Image, at: Vec2<usize>, (a,): (f32,)| image.set(at.x() as u32, at.y() as u32, 0, a);
            let pixels = channels.required(text(&set[0])).collect_pixels(|size, _| Image::new(extent(size), 1), set_one);
            pixels.first_valid_layer().all_attributes().non_parallel().from_buffered(bytes)?.layer_data.channel_data.pixels
        }
    })
}
