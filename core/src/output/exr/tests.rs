//! Files come back as they were, equal images give equal bytes, and bad files are named.

use super::*;
use ::exr::meta::MetaData;
use ::exr::prelude::{Blocks, Compression, FlatSamples, Layers as Parts, LineOrder, SmallVec, f16};

const EXTENT: Extent = Extent { width: 37, height: 53 };

/// Values of all sizes and signs, another sequence for each seed.
fn image(extent: Extent, channels: usize, seed: u32) -> Image {
    let value = |k: usize| ((k as u32).wrapping_mul(2_654_435_761).wrapping_add(seed) >> 8) as f32 / 1e6 - 5.0;
    Image::from_planes(extent, channels, (0..extent.pixels() * channels).map(value).collect()).unwrap()
}

fn three(seed: u32) -> Image {
    image(EXTENT, 3, seed)
}

fn one(seed: u32) -> Image {
    image(EXTENT, 1, seed)
}

fn facts() -> Metadata {
    Metadata {
        job: "0198-ab".into(),
        seed: u64::MAX,
        technique: "gpt".into(),
        reconstruction: "l1".into(),
        choice: Some("l1: least".into()),
        samples: 64,
        version: "0.1.0".into(),
    }
}

fn written(image: &Image, named: &[(&'static str, &Image)], metadata: &Metadata) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    write(&mut out, &Layers { image, named: named.to_vec() }, metadata).unwrap();
    out.into_inner()
}

/// A file with every kind of layer.
fn file() -> Vec<u8> {
    let (primal, depth, normal, mask) = (three(1), one(2), three(3), one(4));
    written(&three(0), &[("primal", &primal), ("depth", &depth), ("normal", &normal), ("mask", &mask)], &facts())
}

fn bits(image: &Image) -> Vec<u32> {
    image.data().iter().map(|v| v.to_bits()).collect()
}

/// Where a run of bytes ends in a file.
fn after(file: &[u8], run: &[u8]) -> usize {
    file.windows(run.len()).position(|w| w == run).unwrap() + run.len()
}

#[test]
fn layers_come_back_as_they_were() {
    let file = file();
    assert_eq!(read_rgb(&file).unwrap(), three(0));
    for (layer, wanted) in [("", three(0)), ("primal", three(1)), ("depth", one(2)), ("normal", three(3)), ("mask", one(4))] {
        assert_eq!(read_layer(&file, layer).unwrap(), wanted, "{layer}");
    }
}

#[test]
fn values_keep_their_bits() {
    let mut odd = three(0);
    let values = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -0.0, f32::MIN_POSITIVE / 8.0, f32::MAX, f32::MIN];
    odd.data_mut()[..values.len()].copy_from_slice(&values);
    assert_eq!(bits(&read_rgb(&written(&odd, &[], &facts())).unwrap()), bits(&odd));
}

#[test]
fn other_programs_see_plain_channels_in_one_part() {
    let meta = MetaData::read_from_buffered(Cursor::new(file()), true).unwrap();
    let [header] = meta.headers.as_slice() else { panic!("{} parts", meta.headers.len()) };
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let wanted =
        ["B", "G", "R", "depth.Z", "mask.Y", "normal.X", "normal.Y", "normal.Z", "primal.B", "primal.G", "primal.R"].map(String::from);
    assert_eq!(names, wanted);
    assert_eq!(header.compression, Compression::ZIP16);
    assert!(header.channels.list.iter().all(|c| c.sample_type == SampleType::F32));
    let mut custom: Vec<String> = header.own_attributes.other.keys().map(|name| name.to_string()).collect();
    custom.sort();
    assert_eq!(custom, [CHOICE, JOB, RECONSTRUCTION, SAMPLES, SEED, TECHNIQUE, VERSION]);
    assert_eq!(header.own_attributes.other[&text(SEED)], AttributeValue::Text(text("18446744073709551615")));
}

#[test]
fn metadata_comes_back_in_any_script() {
    let strange = Metadata { job: "Küche 台所 🍳".into(), technique: String::new(), ..facts() };
    for metadata in [facts(), strange, Metadata::default()] {
        assert_eq!(read_metadata(&written(&three(0), &[], &metadata)).unwrap(), Some(metadata));
    }
    assert_eq!(read_metadata(&foreign(Encoding::UNCOMPRESSED)).unwrap(), None);
}

#[test]
fn equal_images_give_equal_bytes_on_any_number_of_threads() {
    let first = file();
    for threads in [1, 2, 3, 8, 1, 2, 3, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(file) == first, "{threads} threads");
    }
    assert!(written(&three(9), &[], &facts()) != written(&three(8), &[], &facts()));
}

/// What another renderer may write: two parts, half floats and integers, alpha, a window off the origin.
fn foreign(encoding: Encoding) -> Vec<u8> {
    let size = (EXTENT.width as usize, EXTENT.height as usize);
    let halves = |seed: u32| one(seed).data().iter().map(|v| f16::from_f32(*v)).collect::<Vec<_>>();
    let part = |name: &str, channels: Vec<AnyChannel<FlatSamples>>| {
        let attributes = LayerAttributes { layer_position: Vec2(-5, 11), ..LayerAttributes::named(name) };
        Layer::new(size, attributes, encoding, AnyChannels::sort(SmallVec::from_vec(channels)))
    };
    let depth = part("depth", vec![AnyChannel::new("far.Z", FlatSamples::F32(one(7).data().to_vec()))]);
    let beauty = part(
        "beauty",
        vec![
            AnyChannel::new("R", FlatSamples::F16(halves(1))),
            AnyChannel::new("G", FlatSamples::F32(one(2).data().to_vec())),
            AnyChannel::new("B", FlatSamples::U32((0..EXTENT.pixels() as u32).collect())),
            AnyChannel::new("A", FlatSamples::F16(halves(4))),
        ],
    );
    let window = ::exr::math::Vec2(64, 80);
    let attributes = ::exr::meta::header::ImageAttributes::with_size(window);
    let mut out = Cursor::new(Vec::new());
    let layers: Parts<AnyChannels<FlatSamples>> = SmallVec::from_vec(vec![depth, beauty]);
    ExrImage::from_layers(attributes, layers).write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn files_of_other_programs_are_read() {
    let tiles = Encoding { compression: Compression::PIZ, blocks: Blocks::Tiles(Vec2(16, 16)), line_order: LineOrder::Unspecified };
    let lines = Encoding { compression: Compression::ZIP1, blocks: Blocks::ScanLines, line_order: LineOrder::Decreasing };
    for encoding in [tiles, lines, Encoding::UNCOMPRESSED, Encoding::FAST_LOSSLESS] {
        let file = foreign(encoding);
        let rgb = read_rgb(&file).unwrap();
        assert_eq!(rgb.extent(), EXTENT);
        assert!(rgb.plane(0).iter().zip(one(1).data()).all(|(a, b)| (a - b).abs() <= 1e-3 * b.abs().max(1e-2)));
        assert_eq!(rgb.plane(1), one(2).data());
        assert!(rgb.plane(2).iter().enumerate().all(|(k, v)| *v == k as f32));
        assert_eq!(read_layer(&file, "far").unwrap(), one(7));
    }
}

#[test]
fn missing_layers_are_named_with_what_there_is() {
    let missing = read_layer(&file(), "albedo").unwrap_err().to_string();
    assert!(missing.contains("albedo.R, albedo.G, albedo.B") && missing.contains("primal.G"), "{missing}");
    let mut file = file();
    let green = after(&file, b"chlist\0") + 4 + 18;
    assert_eq!(file[green..green + 2], *b"G\0");
    file[green] = b'H';
    let missing = read_rgb(&file).unwrap_err().to_string();
    assert!(missing.contains("no channels R, G, B; it has B, H, R"), "{missing}");
}

#[test]
fn headers_that_ask_too_much_are_refused_before_allocating() {
    let mut large = file();
    let corner = after(&large, b"dataWindow\0box2i\0") + 4 + 8;
    large[corner..corner + 8].copy_from_slice(&[0x3f, 0x42, 0x0f, 0, 0x3f, 0x42, 0x0f, 0]);
    let refused = read_rgb(&large).unwrap_err().to_string();
    assert!(refused.contains("1000000×1000000") && refused.contains("268435456"), "{refused}");
    let mut sparse = file();
    let sampling = after(&sparse, b"mask.Y\0") + 8;
    sparse[sampling] = 37;
    assert!(matches!(read_rgb(&sparse), Err(Error::Subsampled { across: 37, down: 1, .. })));
}

#[test]
fn compressions_with_unsafe_decoders_are_refused() {
    let lossy = Encoding { compression: Compression::B44, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    assert_eq!(
        read_rgb(&foreign(lossy)).unwrap_err().to_string(),
        "the file has b44 compression, only none, RLE, ZIP, PIZ and PXR24 are read"
    );
}

#[test]
fn layers_that_do_not_fit_are_not_written() {
    let (a, small, two) = (three(0), Image::new(Extent { width: 2, height: 2 }, 3), image(EXTENT, 2, 0));
    let refusal = |image: &Image, named: &[(&'static str, &Image)]| {
        write(Cursor::new(Vec::new()), &Layers { image, named: named.to_vec() }, &Metadata::default()).unwrap_err().to_string()
    };
    assert_eq!(refusal(&a, &[("dx", &small)]), "layer `dx` is 2×2, the image 37×53");
    assert_eq!(refusal(&a, &[("dx", &two)]), "layer `dx` has 2 channels, 1 or 3 can be written");
    assert_eq!(refusal(&one(0), &[]), "layer `` has 1 channels, 1 or 3 can be written");
    assert_eq!(refusal(&a, &[("dx", &a), ("dy", &a), ("dx", &a)]), "layer `dx` is given twice, names of layers must differ");
    assert!(refusal(&Image::new(Extent { width: 0, height: 4 }, 3), &[]).contains("0×4"));
}

#[test]
fn broken_files_are_errors() {
    let whole = written(&image(Extent { width: 5, height: 3 }, 3, 0), &[], &facts());
    assert!(matches!(read_rgb(b"not an image"), Err(Error::Exr(_))));
    for length in 0..whole.len() {
        assert!(read_rgb(&whole[..length]).is_err(), "cut at {length} of {}", whole.len());
    }
    // A changed byte may go unseen in a text; what counts is that nothing panics.
    for at in 0..whole.len() {
        for change in [0x01, 0x80, 0xff] {
            let mut broken = whole.clone();
            broken[at] ^= change;
            if let Ok(image) = read_rgb(&broken) {
                assert!(image.extent().pixels() <= MOST_PIXELS);
            }
        }
    }
}
