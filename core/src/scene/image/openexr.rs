//! OpenEXR: the first layer with R, G and B, or with Y alone.

use super::{check, malformed};
use crate::scene::error::{Error, ErrorKind};
use crate::texture::{Pixels, Texels};
use exr::meta::MetaData;
use exr::prelude::{Compression, ReadChannels, ReadLayers, ReadSpecificChannel, Text, Vec2, read as reader};
use std::io::Cursor;

const EXPECTED: &str = "an OpenEXR image";

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Pixels, Error> {
    let fault = |fault: exr::error::Error| malformed(name, fault, EXPECTED);
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(fault)?.headers;
    let has = |header: &exr::meta::header::Header, wanted: &[&str]| {
        let text = |name: &str| Text::new_or_none(name);
        !header.deep && wanted.iter().all(|name| header.channels.list.iter().any(|channel| Some(&channel.name) == text(name).as_ref()))
    };
    let colours = ["R", "G", "B"];
    let found = headers.iter().find_map(|header| {
        let coloured = has(header, &colours);
        (coloured || has(header, &["Y"])).then_some((header, coloured))
    });
    let (header, coloured) = found.ok_or_else(|| malformed(name, "no layer with R, G and B, or with Y", EXPECTED))?;
    let (width, height) = check(header.layer_size.x() as u64, header.layer_size.y() as u64, name)?;
    match header.compression {
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ | Compression::PXR24 => {}
        // The library's decoders of these panic on broken files, or allocate what such a file says.
        other => {
            return Err(Error::new(ErrorKind::Unsupported, name, "", format!("compression {other}"), "none, RLE, ZIP, PIZ or PXR24"));
        }
    }
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Error::new(ErrorKind::Unsupported, name, "", "a subsampled channel", "channels of full size"));
    }
    let blank = |size: Vec2<usize>| (size.x(), vec![[0.0, 0.0, 0.0, 1.0]; size.x() * size.y()]);
    // On one thread: a panic of the library on one of its own threads would end the process.
    let (_, texels) = if coloured {
        let channels = reader().no_deep_data().largest_resolution_level().rgba_channels(
            |size, _| blank(size),
            |(width, texels): &mut (usize, Vec<[f32; 4]>), at, (r, g, b, a): (f32, f32, f32, f32)| {
                texels[at.y() * *width + at.x()] = [r, g, b, a];
            },
        );
        channels
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
            .map_err(fault)?
            .layer_data
            .channel_data
            .pixels
    } else {
        let channels = reader().no_deep_data().largest_resolution_level().specific_channels().required("Y").collect_pixels(
            |size, _| blank(size),
            |(width, texels): &mut (usize, Vec<[f32; 4]>), at, (y,): (f32,)| texels[at.y() * *width + at.x()] = [y, y, y, 1.0],
        );
        channels
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
            .map_err(fault)?
            .layer_data
            .channel_data
            .pixels
    };
    if texels.len() != width as usize * height as usize {
        return Err(malformed(name, format!("{} texels for {width} × {height}", texels.len()), EXPECTED));
    }
    if let Some(place) = texels.iter().position(|texel| !texel.iter().all(|x| x.is_finite())) {
        return Err(malformed(name, format!("a texel that is not finite, number {place}"), "finite numbers"));
    }
    Ok(Pixels { width, height, texels: Texels::Floats(texels) })
}
