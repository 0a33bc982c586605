//! Damaged and hostile scenes: each gives an error or a scene, quickly and in little memory.

use std::time::{Duration, Instant};

use super::*;

const RICH: &str = r#"<scene version="3.0.0">
<default name="w" value="16"/><path value="meshes"/><alias id="Wood" as="Oak"/>
<integrator type="volpath"><integer name="max_depth" value="9"/></integrator>
<sensor type="perspective"><string name="focal_length" value="50mm"/><float name="principal_point_offset_x" value="0.1"/>
<transform name="to_world"><lookat origin="0,1,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="$w"/><integer name="height" value="$w"/><integer name="crop_width" value="8"/>
<rfilter type="mitchell"/></film></sensor>
<texture type="bitmap" id="Image"><string name="filename" value="a.png"/><transform name="to_uv"><scale x="2" y="3"/></transform></texture>
<texture type="checkerboard" id="Board"><rgb name="color0" value=".1 .2 .3"/><spectrum name="color1" value="400:.1, 700:.5"/></texture>
<bsdf type="twosided" id="Wood"><bsdf type="diffuse"><ref name="reflectance" id="Image"/></bsdf></bsdf>
<bsdf type="blendbsdf" id="Mixed"><ref id="Oak"/><bsdf type="roughplastic"><ref name="alpha" id="Board"/></bsdf></bsdf>
<bsdf type="bumpmap" id="Rough"><ref id="Image"/><bsdf type="conductor"><string name="material" value="Cu"/></bsdf></bsdf>
<medium type="homogeneous" id="Fog"><float name="sigma_t" value="2"/><phase type="hg"><float name="g" value="0.3"/></phase></medium>
<shape type="shapegroup" id="Group"><shape type="disk"><ref id="Mixed"/></shape></shape>
<shape type="instance"><ref id="Group"/><transform name="to_world"><translate x="1"/></transform></shape>
<shape type="cube"><ref name="interior" id="Fog"/><bsdf type="mask"><float name="opacity" value="0.5"/><ref id="Rough"/></bsdf></shape>
<shape type="serialized"><string name="filename" value="m.serialized"/><integer name="shape_index" value="1"/></shape>
<emitter type="spot"><rgb name="intensity" value="1 2 3"/></emitter>
<emitter type="sunsky"><float name="turbidity" value="4"/></emitter>
</scene>
"#;

const OLD: &str = include_str!("old.xml");

fn outcome(text: &[u8]) -> bool {
    // What is not UTF-8 is refused before the importer sees it.
    let Ok(text) = std::str::from_utf8(text) else { return false };
    let files = Files(&[("m.serialized", include_bytes!("pair.serialized")), ("part.xml", b"<scene version=\"3.0.0\"/>")]);
    match super::super::import(text, "s.xml", &files) {
        Ok(imported) => {
            imported.description.validate("s.xml").unwrap();
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// A counter-based sequence, so that a failure can be had again.
fn number(seed: u64) -> usize {
    let mut x = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as usize
}

#[test]
fn thousands_of_damaged_scenes_give_an_error_or_a_scene() {
    assert!(outcome(RICH.as_bytes()) && outcome(OLD.as_bytes()) && outcome(SMALL.as_bytes()));
    let (mut tried, mut survived) = (0, 0);
    let mut attempt = |bytes: &[u8]| {
        tried += 1;
        survived += usize::from(outcome(bytes));
    };
    for (which, whole) in [RICH, OLD, SMALL].into_iter().enumerate() {
        let whole = whole.as_bytes();
        for cut in (0..whole.len()).step_by(7) {
            attempt(&whole[..cut]);
        }
        for k in 0..1_000u64 {
            let seed = 1_000_000 * which as u64 + 10 * k;
            let at = number(seed) % whole.len();
            let mut bytes = whole.to_vec();
            match k % 5 {
                0 => bytes[at] ^= 1 << (number(seed + 1) % 8),
                1 => bytes[at] = b"0123456789-.\"<>$/e& "[number(seed + 1) % 20],
                2 => drop(bytes.drain(at..(at + number(seed + 1) % 40).min(whole.len()))),
                3 => {
                    let from = number(seed + 1) % whole.len();
                    let part = whole[from..(from + 60).min(whole.len())].to_vec();
                    bytes.splice(at..at, part);
                }
                _ => drop(bytes.splice(at..at, *b"99999999999999999999")),
            }
            attempt(&bytes);
        }
    }
    assert!(tried >= 3_000, "{tried}");
    assert!(survived > 100 && survived < tried / 2, "{survived} of {tried}: damage must not go unnoticed, nor all of it be fatal");
}

#[test]
fn hostile_scenes_end_quickly() {
    let nest = |open: &str, close: &str, count: usize| around(&format!("{}{}", open.repeat(count), close.repeat(count)));
    let doubling: String = (1..60).map(|k| format!("<default name=\"a{k}\" value=\"$a{0}$a{0}\"/>", k - 1)).collect();
    let chain: String = (0..20_000).map(|k| format!("<bsdf type=\"mask\" id=\"m{k}\"><ref id=\"m{}\"/></bsdf>", k + 1)).collect();
    let fan: String =
        (0..40).map(|k| format!("<bsdf type=\"blendbsdf\" id=\"m{k}\"><ref id=\"m{0}\"/><ref id=\"m{0}\"/></bsdf>", k + 1)).collect();
    let ring = "<texture type=\"scale\" id=\"a\"><ref id=\"b\"/></texture><texture type=\"scale\" id=\"b\"><ref id=\"a\"/></texture>\
                <shape type=\"cube\"><bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"a\"/></bsdf></shape>";
    let use_m0 = "<shape type=\"cube\"><ref id=\"m0\"/></shape>";
    let entities: String = (1..30).map(|k| format!("<!ENTITY e{k} \"&e{0};&e{0};\">", k - 1)).collect();
    let cases = [
        ("elements", nest("<bsdf type=\"twosided\">", "</bsdf>", 100_000), "nested too deep"),
        ("defaults", around(&format!("<default name=\"a0\" value=\"xxxxxxxx\"/>{doubling}")), "names that stand for too much"),
        ("a chain of references", around(&format!("{chain}{use_m0}")), "nested too deep"),
        ("a fan of references", around(&format!("{fan}{use_m0}")), "nested too deep"),
        ("a ring of references", around(ring), "made of itself"),
        (
            "a surface of itself",
            around("<shape type=\"cube\"><bsdf type=\"mask\" id=\"m\"><ref id=\"m\"/></bsdf></shape>"),
            "made of itself",
        ),
        (
            "a group of itself",
            around(
                "<shape type=\"shapegroup\" id=\"g\"><shape type=\"instance\"><ref id=\"g\"/></shape></shape>\
                                      <shape type=\"instance\"><ref id=\"g\"/></shape>",
            ),
            "made of itself",
        ),
        ("entities", format!("<!DOCTYPE s [<!ENTITY e0 \"x\">{entities}]>{}", around("<bsdf type=\"&e29;\" id=\"b\"/>")), "e29"),
        (
            "a file outside",
            around("<shape type=\"obj\"><string name=\"filename\" value=\"../../etc/passwd\"/></shape>"),
            "../../etc/passwd",
        ),
        ("an include outside", around("<include filename=\"../s.xml\"/>"), "../s.xml"),
        ("an include of itself", around("<include filename=\"self.xml\"/>"), "one include too many"),
        (
            "an alias of itself",
            around("<alias id=\"a\" as=\"b\"/><alias id=\"b\" as=\"a\"/><shape type=\"cube\"><ref id=\"a\"/></shape>"),
            "\"a\"",
        ),
        ("a huge film", around("").replace("<rfilter", "<integer name=\"width\" value=\"99999999999\"/><rfilter"), "film.width"),
        (
            "a mixture without end",
            around_old(&format!(
                "<shape type=\"cube\"><bsdf type=\"mixturebsdf\"><string name=\"weights\" value=\"{}\"/>{}</bsdf></shape>",
                "0.1,".repeat(5_000),
                "<bsdf type=\"diffuse\"/>".repeat(5_000)
            )),
            "5000 surfaces",
        ),
    ];
    let files =
        Files(&[("self.xml", b"<scene version=\"3.0.0\"><include filename=\"self.xml\"/><include filename=\"self.xml\"/></scene>")]);
    for (what, text, expected) in cases {
        let started = Instant::now();
        let message = super::super::import(&text, "s.xml", &files).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains(expected), "{what}: {message}");
        assert!(message.len() < 10_000, "{what}: a message of {} bytes", message.len());
        assert!(started.elapsed() < Duration::from_secs(5), "{what} took {:?}", started.elapsed());
    }
}
