//! Hazards of films: odd sizes, few samples and many, black and constant frames, numbers at the end of f32.

use gradfarm_core::film::{Film, FrameFold, Image, PlaneKind, TileFold};
use gradfarm_core::lattice::{Extent, Moment, SampleRange};
use gradfarm_core::plan::{Plan, ReconstructionKind, Request, Technique, WorkUnit};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::render::render_unit;
use gradfarm_core::scene::Scene;
use gradfarm_tests::frame::render;
use gradfarm_tests::scenes::plan;

use super::harness::{EFFORT, Effort, films, looks, parse, same, scene, seen, shows, sound};
use super::surfaces::corner;

/// A plane that fills the view, half as bright as the sky of radiance 1.
fn half_bright() -> String {
    scene(
        &looks([0.0, 3.0, 0.0], [0.0, 0.0, 0.1], 30.0),
        r#""plane": { "diffuse": { "reflectance": 0.5 } }"#,
        r#"{ "geometry": "rectangle", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [50, 1, 50] }], "material": "plane" }"#,
        r#", "environment": { "radiance": 1 }"#,
    )
}

fn asked(text: &str, request: &Request) -> (Scene, Plan) {
    let (description, scene) = parse("film", text);
    (scene, plan(&description, request))
}

/// A film of one pixel, one row, one column: each is the right image, and reconstructions that need neighbours do without.
#[test]
fn one_pixel_one_row_one_column() {
    for (width, height) in [(1, 1), (17, 1), (1, 17), (2, 1)] {
        let effort = Effort { extent: Extent { width, height }, ..EFFORT };
        shows(&format!("{width} by {height} pixels"), &half_bright(), 0.5, 1e-4, effort);
        for film in films("odd film", &corner("", ""), Technique::Gpt, Effort { seeds: 2, ..effort }, 0) {
            for kind in [ReconstructionKind::L2, ReconstructionKind::L1] {
                let image = reconstruct(&film, kind, 0.2).unwrap().image;
                assert!(image.data().iter().all(|v| v.is_finite()), "{width} by {height}, {}", kind.name());
            }
        }
    }
}

/// Units of one pixel give the bits of units of the whole film.
#[test]
fn tiles_of_one_pixel() {
    for technique in Technique::ALL {
        let extent = Extent { width: 7, height: 5 };
        let request = Request { technique: Some(technique), samples: Some(20), extent: Some(extent), ..Request::default() };
        let (scene, plan) = asked(&corner("", ""), &request);
        let film = |edge: u32| -> Film {
            let mut frame = FrameFold::new(extent, &plan.layout());
            for tile in extent.tiles(edge) {
                let mut fold = TileFold::new(tile, &plan.layout());
                for samples in plan.sample_ranges() {
                    fold.add(&render_unit(&scene, &plan, &WorkUnit { moment: Moment::of(0), tile, samples })).unwrap();
                }
                frame.place(&fold).unwrap();
            }
            frame.finish().unwrap()
        };
        let (small, large) = (film(1), film(64));
        assert_eq!(small.halves, large.halves, "{}", technique.name());
    }
}

/// Without light all is black: no error, no noise, exactly zero.
#[test]
fn black_frame() {
    let dark = corner("", "").replace(r#""radiance": 4"#, r#""radiance": 0"#);
    for technique in Technique::ALL {
        for film in films("black frame", &dark, technique, Effort { seeds: 2, ..EFFORT }, 0) {
            assert!(seen(&film).iter().all(|v| *v == 0.0), "{}", technique.name());
            if film.halves[0].gradients.is_some() {
                for kind in [ReconstructionKind::L2, ReconstructionKind::L1] {
                    let done = reconstruct(&film, kind, 0.2).unwrap();
                    assert!(done.image.data().iter().all(|v| *v == 0.0));
                    assert_eq!(done.error.as_ref().map(|error| error.relmse), Some(0.0));
                }
            }
        }
    }
}

/// Where every pixel is alike no difference is ever measured, not one.
#[test]
fn constant_frame_has_no_gradients() {
    let text = half_bright().replace(r#""perspective""#, r#""orthographic""#).replace(r#", "fov": 30, "fov_axis": "smaller""#, "");
    for film in films("constant frame", &text, Technique::Gpt, Effort { depth: 2, seeds: 3, ..EFFORT }, 0) {
        let gradients = film.combined().gradients.unwrap();
        let worst = gradients.dx.data().iter().chain(gradients.dy.data()).fold(0.0f32, |worst, v| worst.max(v.abs()));
        assert!(worst <= 1e-7, "a difference of {worst:e}");
    }
}

/// One, two, three and four samples a pixel estimate what many do; halves without samples are left out, not divided by.
#[test]
fn one_to_four_samples() {
    for samples in 1..=4 {
        let effort = Effort { samples, seeds: 400, ..EFFORT };
        same(&format!("{samples} samples"), &corner("", ""), &corner("", ""), 1.0, effort);
        let film = &films("few samples", &corner("", ""), Technique::Gpt, Effort { seeds: 2, ..effort }, 0)[0];
        let done = reconstruct(film, ReconstructionKind::L2, 0.2).unwrap();
        assert_eq!(done.error.is_some(), samples > 1, "an error needs two halves");
        assert!(done.error.as_ref().is_none_or(|error| error.relmse.is_finite()));
    }
}

/// Samples with indices near a million, far beyond the stratified ones, estimate the same; sums of a million do not lose digits.
#[test]
fn million_samples() {
    let request = Request {
        technique: Some(Technique::Gpt),
        samples: Some(1_000_000),
        extent: Some(Extent { width: 2, height: 1 }),
        max_depth: Some(3),
        ..Request::default()
    };
    let (scene, plan) = asked(&half_bright(), &request);
    let tile = plan.extent.tiles(2)[0];
    let last = SampleRange { first: 996_000, count: 4_000 };
    let block = render_unit(&scene, &plan, &WorkUnit { moment: Moment::of(0), tile, samples: last });
    let primals = block.planes.iter().filter(|(kind, _)| matches!(kind, PlaneKind::Primal(_)));
    let mean = primals.map(|(_, values)| f64::from(values[0])).sum::<f64>() / f64::from(last.count);
    // The estimates of 4000 samples spread by at most their mean.
    assert!((mean - 0.5).abs() < 5.0 * 0.5 / 4000f64.sqrt(), "found {mean}");
    // The film adds such blocks up to a million samples.
    let mut fold = TileFold::new(tile, &plan.layout());
    for samples in SampleRange::batches(1_000_000, 4_000) {
        fold.add(&gradfarm_core::film::FilmBlock { samples, ..block.clone() }).unwrap();
    }
    let mut frame = FrameFold::new(plan.extent, &plan.layout());
    frame.place(&fold).unwrap();
    let film = frame.finish().unwrap();
    let found = f64::from(film.combined().primal.at(0, 0, 0));
    assert!((found / mean - 1.0).abs() < 1e-6, "{found} of {mean}");
}

/// A radiance whose square is beyond f32 is no cause to refuse a frame: the image is right, its variance the largest there is.
#[test]
fn squares_beyond_the_largest_number() {
    let text = half_bright().replace(r#""radiance": 1"#, r#""radiance": 1e25"#);
    for technique in Technique::ALL {
        for film in films("fierce sky", &text, technique, Effort { seeds: 2, ..EFFORT }, 0) {
            for value in seen(&film) {
                assert!((value / 0.5e25 - 1.0).abs() < 0.1, "{}: {value:e}", technique.name());
            }
        }
    }
}

/// One half black, the other not: the image is their mean, and their difference its error.
#[test]
fn half_black_pair() {
    let request = Request { technique: Some(Technique::Gpt), samples: Some(32), extent: Some(EFFORT.extent), ..Request::default() };
    let (scene, plan) = asked(&corner("", ""), &request);
    let mut film = render(&scene, &plan).unwrap();
    let black = Image::new(film.extent, 3);
    film.halves[1].primal = black.clone();
    film.halves[1].direct = black.clone();
    let gradients = film.halves[1].gradients.as_mut().unwrap();
    (gradients.dx, gradients.dy) = (black.clone(), black);
    sound("half black", &film);
    for kind in [ReconstructionKind::L2, ReconstructionKind::L1] {
        let done = reconstruct(&film, kind, 0.2).unwrap();
        let [a, b] = done.halves.as_ref().unwrap();
        assert!(b.data().iter().all(|v| *v == 0.0), "{}", kind.name());
        let (error, image) = (done.error.as_ref().unwrap(), &done.image);
        for ((error, image), a) in error.squared.data().iter().zip(image.data()).zip(a.data()) {
            assert!((error - 0.25 * a * a).abs() <= 1e-6 * a * a, "{}", kind.name());
            assert!(kind != ReconstructionKind::L2 || (image - 0.5 * a).abs() <= 1e-5 * a.abs().max(1e-3));
        }
    }
}

/// A single spike a million times its surroundings: L2 keeps its energy to rounding, L1 takes it for an outlier and says so by its error.
#[test]
fn single_spike() {
    let extent = Extent { width: 33, height: 21 };
    let (mut primal, none) = (Image::new(extent, 3), Image::new(extent, 3));
    primal.data_mut().iter_mut().for_each(|v| *v = 1.0);
    (0..3).for_each(|c| primal.set(16, 10, c, 1e6));
    let request = Request { technique: Some(Technique::Gpt), samples: Some(2), extent: Some(extent), ..Request::default() };
    let (scene, plan) = asked(&half_bright(), &request);
    let mut film = render(&scene, &plan).unwrap();
    for half in &mut film.halves {
        half.primal = primal.clone();
        half.direct = none.clone();
        let gradients = half.gradients.as_mut().unwrap();
        (gradients.dx, gradients.dy) = (none.clone(), none.clone());
    }
    let sum = |image: &Image| image.data().iter().map(|v| f64::from(*v)).sum::<f64>();
    let l2 = reconstruct(&film, ReconstructionKind::L2, 0.2).unwrap().image;
    assert!((sum(&l2) / sum(&primal) - 1.0).abs() < 1e-5);
    assert!(l2.data().iter().all(|v| *v >= 0.9), "a positive image stays positive");
    let l1 = reconstruct(&film, ReconstructionKind::L1, 0.2).unwrap().image;
    assert!(l1.data().iter().all(|v| v.is_finite() && *v < 1e6), "the spike is spread or left out, never raised");
}
