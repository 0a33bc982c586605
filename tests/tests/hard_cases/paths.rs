//! Hazards of whole paths: long ones, dark ones, ones that overflow, and the same ones under every shift.

use gradfarm_core::film::Counter;
use gradfarm_core::plan::{Request, ShiftKind, Technique};
use gradfarm_core::scene::{Assets, Error, NoAssets, Scene, SceneDescription};
use gradfarm_tests::frame::render;
use gradfarm_tests::scenes::plan;
use gradfarm_tests::statistics::Estimate;

use super::harness::{EFFORT, Effort, films, gradients_hold, looks, parse, same, scene, seen, shows, sound};
use super::surfaces::corner;

const FLOOR: &str = r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [9, 1, 9] }], "material": "floor" }"#;

/// A floor with these shapes over it.
fn floor(materials: &str, shapes: &str, rest: &str) -> String {
    let [more, then] = [materials, shapes].map(|part| if part.is_empty() { String::new() } else { format!(", {part}") });
    scene(
        &looks([0.0, 2.0, 5.0], [0.0, 0.0, 0.0], 25.0),
        &format!(r#""floor": {{ "diffuse": {{ "reflectance": 0.5 }} }}, "black": {{ "diffuse": {{ "reflectance": 0 }} }}{more}"#),
        &format!("{FLOOR}{then}"),
        rest,
    )
}

/// A rectangle that looks down from y = 2, of this half size.
fn panel(half: [f64; 2], at: [f64; 2], rest: &str) -> String {
    format!(
        r#"{{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": 90 }} }}, {{ "scale": [{}, 1, {}] }}, {{ "translate": [{}, 2.2, {}] }}], "material": "black"{rest} }}"#,
        half[0], half[1], at[0], at[1]
    )
}

/// A lamp flush with the ceiling sends no light along it: a black ceiling around it changes nothing on the floor.
#[test]
fn lamp_flush_with_the_ceiling() {
    let lamp = panel([0.5, 0.5], [0.0, 0.0], r#", "emission": { "radiance": 5 }"#);
    let frame: Vec<String> = [([1.0, 0.5], [-1.5, 0.0]), ([1.0, 0.5], [1.5, 0.0]), ([2.5, 1.0], [0.0, -1.5]), ([2.5, 1.0], [0.0, 1.5])]
        .map(|(half, at)| panel(half, at, ""))
        .to_vec();
    same("flush lamp", &floor("", &format!("{lamp}, {}", frame.join(", ")), ""), &floor("", &lamp, ""), 1.0, EFFORT);
}

/// Of a glowing ball sunk halfway into the floor only the upper half is there. Its irradiance, with s = R/d, is L (asin s − s √(1 − s²)).
#[test]
fn lamp_sunk_into_the_floor() {
    let lamp =
        r#"{ "geometry": { "sphere": { "center": [0.2, 0, -3.5], "radius": 0.8 } }, "material": "black", "emission": { "radiance": 5 } }"#;
    let (description, compiled) = parse("sunk lamp", &floor("", lamp, ""));
    let view = compiled.sensor.view(EFFORT.extent);
    let request = |seed| Request {
        technique: Some(Technique::Gpt),
        samples: Some(256),
        extent: Some(EFFORT.extent),
        max_depth: Some(2),
        seed,
        ..Request::default()
    };
    let runs: Vec<_> = (0..EFFORT.seeds)
        .map(|seed| {
            let film = render(&compiled, &plan(&description, &request(seed))).unwrap();
            sound("sunk lamp", &film);
            seen(&film)
        })
        .collect();
    for (x, y) in [(0, 3), (2, 3), (4, 3)] {
        let mut expected = 0.0;
        for cell in 0..256 {
            let within = |k: u32| (k as f32 + 0.5) / 16.0;
            let ray = view.ray([x as f32 + within(cell % 16), y as f32 + within(cell / 16)], [0.5; 2]);
            let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let at = origin - direction * (origin.y / direction.y);
            let s = 0.8 / (at - glam::DVec3::new(0.2, 0.0, -3.5)).length();
            expected += 0.5 / std::f64::consts::PI * 5.0 * (libm::asin(s) - s * (1.0 - s * s).sqrt()) / 256.0;
        }
        let place = EFFORT.extent.index(x, y);
        let found = Estimate::of(&runs.iter().map(|run| run[place]).collect::<Vec<_>>());
        let t = found.t(&Estimate::known(expected, 1e-3 * expected)).unwrap().0;
        assert!(t.abs() < 6.0, "{x}, {y}: {} of {expected}, t {t}", found.mean);
    }
}

/// A lamp so large that the scene is a dot in it is a sky.
#[test]
fn lamp_as_large_as_the_sky() {
    for radius in [1e4, 1e8] {
        let shell = format!(
            r#"{{ "geometry": {{ "sphere": {{ "radius": {radius:e} }} }}, "material": "black", "flip_normals": true, "emission": {{ "radiance": 1 }} }}"#
        );
        shows(&format!("shell of radius {radius:e}"), &floor("", &shell, ""), 0.5, 2e-3, Effort { depth: 2, ..EFFORT });
    }
}

/// A sky as faint as the smallest numbers there are is still half seen in a floor of reflectance one half.
#[test]
fn denormal_radiance() {
    shows("denormal radiance", &floor("", "", r#", "environment": { "radiance": 1e-40 }"#), 0.5e-40, 1e-3, Effort { depth: 2, ..EFFORT });
}

/// Red light on a green floor is black, exactly: nothing divides by a path that carries nothing.
#[test]
fn complementary_colours() {
    let text = floor("", "", r#", "environment": { "radiance": [1, 0, 1] }, "integrator": { "roulette_depth": 1 }"#)
        .replace(r#""reflectance": 0.5"#, r#""reflectance": [0, 0.9, 0]"#);
    for technique in Technique::ALL {
        for film in films("complementary colours", &text, technique, Effort { seeds: 3, ..EFFORT }, 0) {
            assert!(seen(&film).iter().all(|v| *v == 0.0), "{}", technique.name());
        }
    }
}

/// A group made tiny by one transform and large again by the next is where it was.
#[test]
fn instances_scaled_down_and_up_again() {
    let ball = |scale: f64| {
        format!(
            r#"{{ "geometry": {{ "sphere": {{ "center": [0, {}, 0], "radius": {} }} }}, "material": "white" }}"#,
            0.6 * scale,
            0.6 * scale
        )
    };
    let instance = r#"{ "geometry": { "instance": { "of": "small" } }, "to_world": [{ "scale": [1e6, 1e6, 1e6] }] }"#;
    let shown = corner("", instance);
    let text = format!(r#"{}, "groups": {{ "small": [{}] }} }}"#, shown.trim_end().strip_suffix('}').unwrap(), ball(1e-6));
    same("instances scaled down and up", &text, &corner("", &ball(1.0)), 1.0, EFFORT);
}

/// An index-matched sheet at 89.999° reflects nothing: what is seen is the black floor under it. Sheets less than a millionth of their size
/// apart could not be told from one another.
#[test]
fn matched_index_at_the_horizon() {
    let rectangle = |y: f64, material: &str| {
        format!(
            r#"{{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": -90 }} }}, {{ "scale": [1e3, 1, 1e3] }}, {{ "translate": [0, {y}, 0] }}], "material": "{material}" }}"#
        )
    };
    let text = scene(
        &looks([0.0, 10.0 * (0.001f64).to_radians(), 10.0], [0.0, 0.0, 0.0], 0.0005),
        r#""sheet": { "dielectric": { "interior_ior": 1.5, "exterior_ior": 1.5 } }, "black": { "diffuse": { "reflectance": 0 } }"#,
        &[rectangle(0.0, "sheet"), rectangle(-0.01, "black")].join(", "),
        r#", "environment": { "radiance": 1 }"#,
    );
    for technique in Technique::ALL {
        for film in films("matched index at the horizon", &text, technique, Effort { seeds: 2, ..EFFORT }, 0) {
            let brightest = seen(&film).into_iter().fold(0.0, f64::max);
            assert_eq!(brightest, 0.0, "{}", technique.name());
        }
    }
}

/// Between two rough white metals paths have a hundred vertices; each of them sees the sky in the end.
#[test]
fn hundred_rough_mirrors() {
    let side = |turn: f64, x: f64| {
        format!(
            r#"{{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [0, 1, 0], "degrees": {turn} }} }}, {{ "scale": [1, 20, 20] }}, {{ "translate": [{x}, 0, 0] }}], "material": "metal" }}"#
        )
    };
    let text = scene(
        &looks([0.0, 0.0, 0.0], [2.0, 0.0, 1.3], 2.0),
        r#""metal": { "conductor": { "eta": 0, "k": 1, "roughness": 0.05, "energy_conserving": true } }"#,
        &[side(90.0, -0.5), side(-90.0, 0.5)].join(", "),
        r#", "environment": { "radiance": 1 }, "integrator": { "roulette_depth": 600 }"#,
    );
    shows("a hundred rough mirrors", &text, 1.0, 2e-2, Effort { depth: 500, samples: 8, seeds: 8, ..EFFORT });
}

/// A room that glows until f32 overflows: what is not finite is left out and counted where it arose, and the rest stays.
#[test]
fn overflow_is_counted_by_cause() {
    let text = scene(
        &looks([0.3, 0.2, -0.5], [0.0, -0.1, 1.0], 50.0),
        r#""wall": { "diffuse": { "reflectance": 1 } }"#,
        r#"{ "geometry": "cube", "flip_normals": true, "material": "wall", "emission": { "radiance": 3e38 } }"#,
        r#", "integrator": { "roulette_depth": 50 }"#,
    );
    let (description, compiled) = parse("overflow", &text);
    for technique in Technique::ALL {
        let request = Request {
            technique: Some(technique),
            samples: Some(4),
            extent: Some(EFFORT.extent),
            max_depth: Some(6),
            reuse_edge: Some(3),
            ..Request::default()
        };
        let film = render(&compiled, &plan(&description, &request)).unwrap();
        let count = |counter| film.statistics.get(counter);
        assert!(count(Counter::NotFinitePrimal) > 0, "{}: {:?}", technique.name(), film.statistics.by_name());
        let all = film.combined();
        assert!(all.primal.data().iter().chain(all.direct.data()).all(|v| v.is_finite()), "{}", technique.name());
        if let Some(gradients) = all.gradients {
            assert!(gradients.dx.data().iter().chain(gradients.dy.data()).all(|v| v.is_finite()), "{}", technique.name());
        }
    }
}

/// An environment that is black but for one texel.
struct OneTexel;

const WIDTH: usize = 256;
const ROW: usize = 32;

impl Assets for OneTexel {
    fn open(&self, name: &str) -> Result<Vec<u8>, Error> {
        if name != "one.hdr" {
            return NoAssets.open(name);
        }
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {WIDTH}\n", WIDTH / 2).into_bytes();
        let mut texels = vec![[0u8; 4]; WIDTH * WIDTH / 2];
        // 2²⁰.
        texels[ROW * WIDTH + 90] = [128, 128, 128, 149];
        bytes.extend(texels.concat());
        Ok(bytes)
    }
}

/// All light from one texel of a million: a floor has the irradiance of that texel's solid angle.
#[test]
fn sky_of_one_hot_texel() {
    let text = floor("", "", r#", "environment": { "image": { "file": "one.hdr" } }"#);
    let description = SceneDescription::from_json(&text, "hot texel").unwrap();
    let compiled = Scene::compile(&description, &OneTexel).unwrap();
    let step = 2.0 * std::f64::consts::PI / WIDTH as f64;
    let polar = (ROW as f64 + 0.5) * step;
    let irradiance = f64::from(1 << 20) * step * step * libm::sin(polar) * libm::cos(polar);
    let expected = 0.5 / std::f64::consts::PI * irradiance;
    for technique in Technique::ALL {
        let means: Vec<f64> = (0..16)
            .map(|seed| {
                let request = Request {
                    technique: Some(technique),
                    samples: Some(128),
                    extent: Some(EFFORT.extent),
                    reuse_edge: Some(3),
                    seed,
                    ..Request::default()
                };
                let film = render(&compiled, &plan(&description, &request)).unwrap();
                sound("hot texel", &film);
                let values = seen(&film);
                values.iter().sum::<f64>() / values.len() as f64
            })
            .collect();
        // Mantissas of the format have eight bits; readers differ by half of the last.
        let found = Estimate::of(&means);
        let t = found.t(&Estimate::known(expected, 4e-3 * expected)).unwrap().0;
        assert!(t.abs() < 6.0, "{}: {} of {expected}, t {t}", technique.name(), found.mean);
        assert!(found.variance.sqrt() < 0.05 * expected, "{}: too noisy to tell", technique.name());
    }
}

/// Half of a plate is a perfect mirror, half is rough: paths on either side of the seam shift to each other or fail both ways.
#[test]
fn smooth_beside_rough_under_every_shift() {
    let materials = r#""mirror": { "conductor": { "metal": "Al" } }, "brushed": { "conductor": { "metal": "Al", "roughness": 0.3 } }"#;
    let plate = |x: f64, material: &str| {
        format!(
            r#"{{ "geometry": "rectangle", "to_world": [{{ "rotate": {{ "axis": [1, 0, 0], "degrees": -60 }} }}, {{ "scale": [0.5, 1, 1] }}, {{ "translate": [{x}, 0.7, 0.3] }}], "material": "{material}" }}"#
        )
    };
    let text = corner(materials, &[plate(-0.47, "mirror"), plate(0.53, "brushed")].join(", "));
    for shift in ShiftKind::ALL {
        gradients_hold(
            &format!("mirror beside brushed metal, {}", shift.name()),
            &text,
            Effort { samples: 128, shift: Some(shift), ..EFFORT },
        );
    }
}

/// A glass ball in front of a corner bends neighbours apart, the more the nearer to its rim.
#[test]
fn glass_rim_under_every_shift() {
    let ball = r#"{ "geometry": { "sphere": { "center": [0.1, 0.8, 1.0], "radius": 0.5 } }, "material": "glass" }"#;
    for roughness in ["", r#", "roughness": 0.1"#] {
        let glass = format!(r#""glass": {{ "dielectric": {{ "interior_ior": 1.5{roughness} }} }}"#);
        for shift in ShiftKind::ALL {
            let effort = Effort { samples: 128, depth: 6, shift: Some(shift), ..EFFORT };
            gradients_hold(&format!("glass ball {roughness}, {}", shift.name()), &corner(&glass, ball), effort);
        }
    }
}
