//! Small images of each format, and what is wrong with broken ones.

use super::*;
use crate::texture::Texels;

fn png_of(colour: ::png::ColorType, depth: ::png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

#[test]
fn png_of_every_kind_becomes_four_channels() {
    use ::png::{BitDepth, ColorType};
    let read = |colour, depth, data: &[u8]| read(&png_of(colour, depth, data), "a.png").unwrap().texels;
    assert_eq!(read(ColorType::Grayscale, BitDepth::Eight, &[7, 9]), Texels::Bytes(vec![[7, 7, 7, 255], [9, 9, 9, 255]]));
    assert_eq!(read(ColorType::Grayscale, BitDepth::One, &[0b0100_0000]), Texels::Bytes(vec![[0, 0, 0, 255], [255; 4]]));
    assert_eq!(read(ColorType::GrayscaleAlpha, BitDepth::Eight, &[7, 1, 9, 2]), Texels::Bytes(vec![[7, 7, 7, 1], [9, 9, 9, 2]]));
    assert_eq!(read(ColorType::Rgb, BitDepth::Eight, &[1, 2, 3, 4, 5, 6]), Texels::Bytes(vec![[1, 2, 3, 255], [4, 5, 6, 255]]));
    assert_eq!(read(ColorType::Rgba, BitDepth::Eight, &[1, 2, 3, 4, 5, 6, 7, 8]), Texels::Bytes(vec![[1, 2, 3, 4], [5, 6, 7, 8]]));
    let words = Texels::Words(vec![[258, 772, 1286, 65535], [1, 2, 3, 65535]]);
    assert_eq!(read(ColorType::Rgb, BitDepth::Sixteen, &[1, 2, 3, 4, 5, 6, 0, 1, 0, 2, 0, 3]), words);
}

#[test]
fn radiance_and_openexr_keep_their_numbers() {
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x20\x81\x80\x80\x80\x80";
    let Texels::Floats(texels) = read(hdr, "a.hdr").unwrap().texels else { panic!() };
    assert_eq!(texels.len(), 2);
    assert!((texels[0][0] / texels[0][1] - 2.0).abs() < 0.02 && (texels[0][0] - 1.0).abs() < 0.02, "{texels:?}");
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = exr::prelude::Image::from_channels(
        (2, 1),
        exr::prelude::SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| (at.x() as f32 + 0.5, 2.0f32, 1e4f32)),
    );
    exr::prelude::WritableImage::write(&image).to_buffered(&mut bytes).unwrap();
    let found = read(bytes.get_ref(), "a.exr").unwrap();
    assert_eq!(found.texels, Texels::Floats(vec![[0.5, 2.0, 1e4, 1.0], [1.5, 2.0, 1e4, 1.0]]));
}

#[test]
fn broken_images_are_errors_that_name_the_file() {
    let whole = png_of(::png::ColorType::Rgb, ::png::BitDepth::Eight, &[1, 2, 3, 4, 5, 6]);
    for bytes in [&whole[..whole.len() / 2], b"", b"GIF89a", b"\xff\xd8\xff\xe0", b"#?RADIANCE\n\n-Y 1 +X", b"\x76\x2f\x31\x01\x02"] {
        let error = read(bytes, "lost.png").unwrap_err();
        assert_eq!(error.place.file, "lost.png", "{error}");
    }
    let mut huge = whole;
    // 2³¹ − 1 columns, in the header.
    huge[16..20].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff]);
    assert!(read(&huge, "huge.png").is_err());
}
