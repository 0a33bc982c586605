//! E[gradient] = difference of converged primals, gradients that are exactly zero, and primals that gradients do not touch.

use crate::film::{Counter, Film, FrameFold, PlaneKind, TileFold};
use crate::lattice::Moment;
use crate::material::{Bsdf, Material, Textured};
use crate::math::Vec3;
use crate::medium::MediumId;
use crate::plan::{Plan, ShiftKind, Technique, WorkUnit};
use crate::render::render_unit;
use crate::scene::{Boundary, Scene};
use crate::sensor::{PixelFilter, Projection};
use crate::spectrum::Spectrum;
use crate::testing::films::{self, Estimate, agree, render};
use crate::testing::{Stage, diffuse, plan, scenes};
use crate::texture::{ColourInput, ScalarInput};

const EDGE: u32 = 8;
const RUNS: u64 = 24;

#[test]
fn gradients_estimate_the_difference_of_primals() {
    for (name, scene) in scenes() {
        // Independent seeds for gradients and primals, so that the z-scores are honest.
        let primals: Vec<Film> = (0..RUNS).map(|s| render(&scene, &plan(Technique::Pt, EDGE, 768, 6, 1000 + s))).collect();
        for shift in ShiftKind::ALL {
            let by = |s| Plan { shift, shift_threshold: shift.threshold(), ..plan(Technique::Gpt, EDGE, 128, 6, 500 + s) };
            let gradients: Vec<Film> = (0..RUNS).map(|s| render(&scene, &by(s))).collect();
            for vertical in [false, true] {
                let a = Estimate::of(&gradients.iter().map(|f| films::gradients(f, vertical)).collect::<Vec<_>>());
                let finite = |f: &Film| films::finite_differences(&f.combined().primal, vertical);
                let b = Estimate::of(&primals.iter().map(finite).collect::<Vec<_>>());
                agree(&format!("{name}, {}, vertical {vertical}", shift.name()), &a, &b);
            }
        }
    }
}

/// What paths of exactly two, three, … edges give: the same seed with one edge less gives all shorter ones, path by path.
fn by_length(shorter: Option<Vec<f32>>, upto: &[f32]) -> Vec<f32> {
    shorter.map_or_else(|| upto.to_vec(), |shorter| upto.iter().zip(shorter).map(|(all, less)| all - less).collect())
}

#[test]
fn gradients_estimate_the_difference_of_primals_at_each_path_length() {
    const LENGTHS: [u32; 3] = [2, 3, 4];
    for (name, scene) in scenes() {
        let films = |technique, samples, first: u64| -> Vec<Vec<Film>> {
            let depth = |depth| (0..RUNS).map(|s| render(&scene, &plan(technique, EDGE, samples, depth, first + s))).collect();
            LENGTHS.into_iter().map(depth).collect()
        };
        let (measured, primals) = (films(Technique::Gpt, 192, 50), films(Technique::Pt, 320, 1000));
        for (k, vertical) in (0..LENGTHS.len()).flat_map(|k| [(k, false), (k, true)]) {
            let estimate = |films: &[Vec<Film>], of: &dyn Fn(&Film) -> Vec<f32>| {
                let run = |s: usize| by_length(k.checked_sub(1).map(|shorter| of(&films[shorter][s])), &of(&films[k][s]));
                Estimate::of(&(0..RUNS as usize).map(run).collect::<Vec<_>>())
            };
            let a = estimate(&measured, &|f| films::gradients(f, vertical));
            let b = estimate(&primals, &|f| films::finite_differences(&f.combined().primal, vertical));
            agree(&format!("{name}, {} edges, vertical {vertical}", LENGTHS[k]), &a, &b);
        }
    }
}

#[test]
fn roulette_on_shifts_changes_no_mean() {
    let (name, scene) = scenes().into_iter().next().unwrap();
    let skipping = |s| Plan { shift_survival: 0.1, ..plan(Technique::Gpt, EDGE, 256, 6, s) };
    let skipped: Vec<Film> = (0..RUNS).map(|s| render(&scene, &skipping(s))).collect();
    let always: Vec<Film> = (0..RUNS).map(|s| render(&scene, &plan(Technique::Gpt, EDGE, 256, 6, 1000 + s))).collect();
    let share = skipped[0].statistics.get(Counter::ShiftSkipped) as f64 / skipped[0].statistics.get(Counter::Samples) as f64;
    assert!(share > 0.2, "{name}: only {share} shifts a path were skipped");
    for vertical in [false, true] {
        let of = |films: &[Film]| Estimate::of(&films.iter().map(|f| films::gradients(f, vertical)).collect::<Vec<_>>());
        agree(&format!("{name}, vertical {vertical}"), &of(&skipped), &of(&always));
    }
}

#[test]
fn primal_does_not_depend_on_gradients() {
    for (_, scene) in scenes() {
        let with = render(&scene, &plan(Technique::Gpt, 6, 8, 6, 3));
        let without = render(&scene, &plan(Technique::Pt, 6, 8, 6, 3));
        for half in 0..2 {
            assert_eq!(with.halves[half].primal, without.halves[half].primal);
            assert_eq!(with.halves[half].direct, without.halves[half].direct);
        }
    }
}

#[test]
fn tiles_and_sample_ranges_do_not_change_a_pixel() {
    let (_, scene) = scenes().swap_remove(3);
    let plan = plan(Technique::Gpt, 9, 32, 6, 5);
    let layout = plan.layout();
    let render = |edge| {
        let mut frame = FrameFold::new(plan.extent, &layout);
        for tile in plan.extent.tiles(edge) {
            let mut fold = TileFold::new(tile, &layout);
            for samples in plan.sample_ranges() {
                fold.add(&render_unit(&scene, &plan, &WorkUnit { moment: Moment::of(0), tile, samples })).unwrap();
            }
            frame.place(&fold).unwrap();
        }
        frame.finish().unwrap()
    };
    assert_eq!(render(3), render(64));
    assert_eq!(render(4), render(64));
    assert!(layout.contains(&PlaneKind::Depth));
}

#[test]
fn open_furnace_has_its_closed_form() {
    // A convex body of albedo 0.6 under a constant sky of radiance 2: every point of it has radiance 1.2.
    let scene = Stage::default().sphere(Vec3::new(0.0, 0.0, 4.0), 1.0, diffuse(0.6, 0.6, 0.6), 0.0).environment(2.0).seen(0.1, 0.0);
    let film = render(&scene, &plan(Technique::Gpt, 4, 1024, 4, 1));
    let all = film.combined();
    for (v, s) in all.primal.data().iter().zip(all.primal_variance.data()) {
        let sigma = f64::from(*s).sqrt().max(1e-6);
        assert!(((f64::from(*v) - 1.2) / sigma).abs() < 5.0, "{v} ± {sigma}");
    }
    let g = all.gradients.unwrap();
    for (v, s) in g.dx.plane(0).iter().zip(g.dx_variance.plane(0)) {
        assert!(f64::from(*v).abs() < 5.0 * f64::from(*s).sqrt() + 1e-6);
    }
}

#[test]
fn a_medium_that_absorbs_nothing_is_invisible_in_a_constant_sky() {
    let white = |scene: Stage| scene.environment(1.5).seen(0.25, 0.0);
    let cloud = |g: f32| Stage::default().medium(Spectrum::rgb(1.3, 1.0, 0.8), 1.0, g).bounded(0.0, Some([MediumId::VACUUM, MediumId(0)]));
    for g in [0.0, 0.8] {
        let scene = white(cloud(g).sphere(Vec3::new(0.0, 0.0, 4.0), 1.2, diffuse(0.0, 0.0, 0.0), 0.0));
        let mut plan = plan(Technique::Gpt, 4, 2048, 400, 1);
        plan.roulette_depth = 400;
        let all = render(&scene, &plan).combined();
        // What is seen directly is exact; what is scattered has its noise.
        for (k, (v, s)) in all.primal.data().iter().zip(all.primal_variance.data()).enumerate() {
            let (sum, sigma) = (f64::from(*v + all.direct.data()[k]), f64::from(*s).sqrt().max(1e-6));
            assert!(((sum - 1.5) / sigma).abs() < 5.0, "g {g}, value {k}: {sum} ± {sigma}");
        }
    }
}

#[test]
fn a_medium_that_scatters_nothing_dims_by_beer_and_lamberts_law() {
    // A lamp seen through a metre of it on each side, both its own boundaries included.
    let sigma = [0.3f32, 0.7, 1.9];
    let scene = Stage::default()
        .medium(Spectrum::rgb(sigma[0], sigma[1], sigma[2]), 0.0, 0.0)
        .around()
        .quad(Vec3::new(-1.0, -1.0, 2.0), Vec3::Y * 2.0, Vec3::X * 2.0, diffuse(0.0, 0.0, 0.0), 5.0)
        .seen(0.01, 0.0);
    let direct = render(&scene, &plan(Technique::Pt, 2, 16, 4, 1)).combined().direct;
    for (c, sigma) in sigma.iter().enumerate() {
        let expected = 5.0 * (-f64::from(*sigma) * 2.0).exp();
        for v in direct.plane(c) {
            assert!((f64::from(*v) / expected - 1.0).abs() < 1e-3, "channel {c}: {v}, expected {expected}");
        }
    }
}

#[test]
fn a_sheet_with_holes_shows_its_share_of_what_lies_behind() {
    // Black, opacity 0.4, before a sky of radiance 2.
    let scene = Stage::default()
        .bounded(0.4, None)
        .quad(Vec3::new(-5.0, -5.0, 2.0), Vec3::Y * 10.0, Vec3::X * 10.0, diffuse(0.0, 0.0, 0.0), 0.0)
        .environment(2.0)
        .seen(0.3, 0.0);
    let all = render(&scene, &plan(Technique::Gpt, 3, 64, 6, 1)).combined();
    for (primal, direct) in all.primal.data().iter().zip(all.direct.data()) {
        assert!((primal + direct - 1.2).abs() < 1e-5, "{primal} + {direct}");
    }
}

/// The same scene with the code for what it lacks switched on: legs through media and holes, and inputs that are looked up.
fn forced(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.boundaries.push(Boundary { opacity: ScalarInput::Constant(1.0), media: None });
    for material in &mut scene.materials {
        if let Material::Plain(Bsdf::Diffuse(diffuse)) = material {
            let reflectance = ColourInput::Constant(diffuse.reflectance);
            *material = Material::Textured(Textured::Diffuse { reflectance, two_sided: diffuse.two_sided });
        }
    }
    scene
}

#[test]
fn what_a_scene_lacks_changes_no_bit() {
    for (name, scene) in scenes().into_iter().filter(|(_, scene)| scene.is_clear()) {
        let plan = plan(Technique::Gpt, 6, 8, 6, 3);
        let with = forced(&scene);
        assert!(!with.is_clear());
        assert_eq!(render(&scene, &plan), render(&with, &plan), "{name}");
    }
}

#[test]
fn nothing_is_ever_not_finite() {
    for (name, scene) in scenes() {
        let film = render(&scene, &plan(Technique::Gpt, 8, 64, 12, 9));
        assert_eq!(film.statistics.not_finite(), 0, "{name}");
    }
}

#[test]
fn every_filter_keeps_a_constant_scene() {
    for (name, filter, exact) in [
        ("tent", PixelFilter::Tent(1.3), true),
        ("gaussian", PixelFilter::gaussian(0.5, 2.0), true),
        ("mitchell", PixelFilter::mitchell(1.0 / 3.0, 1.0 / 3.0), false),
    ] {
        let scene = Stage::default().environment(2.0).through(Projection::Orthographic(1.0), filter);
        let all = render(&scene, &plan(Technique::Gpt, 4, 1024, 4, 1)).combined();
        let values = all.direct.data();
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
        assert!(if exact { values.iter().all(|v| (v - 2.0).abs() < 1e-6) } else { (mean - 2.0).abs() < 0.02 }, "{name}: {mean}");
    }
}
