//! Path reusing: each pixel's estimate is right by itself, differences are right, and no bit depends on how the film is cut.

use super::render_unit;
use crate::film::{Counter, Film, FrameFold, PlaneKind, TileFold};
use crate::lattice::{Moment, Offset};
use crate::math::Vec3;
use crate::plan::{Plan, ShiftKind, Technique, WorkUnit};
use crate::testing::films::{Estimate, finite_differences, gradients, render, z_scores};
use crate::testing::{Stage, diffuse, plan, scenes};

const EDGE: u32 = 5;
const RUNS: u64 = 24;

fn reuse(edge: u32, reuse_edge: u32, samples: u32, seed: u64) -> Plan {
    Plan { reuse_edge, shift: ShiftKind::Composable, ..plan(Technique::Reuse, edge, samples, 6, seed) }
}

fn primal(film: &Film) -> Vec<f32> {
    film.combined().primal.data().to_vec()
}

/// Holds two independent estimates against each other. The pixels of a group share their noise, so that the mean square of z tells
/// nothing: z itself is t-distributed with 23 degrees or more, and at a Šidák-corrected 10⁻³ over 3000 values |z| stays below 7.
fn hold(name: &str, a: &Estimate, b: &Estimate) {
    let z = z_scores(a, b);
    let worst = z.iter().fold(0.0f64, |worst, z| worst.max(z.abs()));
    eprintln!("{name}: worst |z| {worst:.2}, mean {:.3} over {}", z.iter().sum::<f64>() / z.len() as f64, z.len());
    assert!(worst < 7.0, "{name}: worst z {worst}");
}

#[test]
fn shared_paths_estimate_every_pixel_and_every_difference() {
    for (name, scene) in scenes() {
        // Groups of 3, 2 and 1 columns and rows; the last ones have nothing beyond them.
        let shared: Vec<Film> = (0..RUNS).map(|s| render(&scene, &reuse(EDGE, 3, 192, s))).collect();
        let alone: Vec<Film> = (0..RUNS).map(|s| render(&scene, &plan(Technique::Pt, EDGE, 1536, 6, 1000 + s))).collect();
        let of = |films: &[Film], values: &dyn Fn(&Film) -> Vec<f32>| Estimate::of(&films.iter().map(values).collect::<Vec<_>>());
        let mean = |film: &Film| vec![primal(film).iter().sum::<f32>()];
        hold(&format!("{name}, primal of the frame"), &of(&shared, &mean), &of(&alone, &mean));
        hold(&format!("{name}, primal"), &of(&shared, &primal), &of(&alone, &primal));
        for vertical in [false, true] {
            let measured = of(&shared, &|film| gradients(film, vertical));
            let expected = of(&alone, &|film| finite_differences(&film.combined().primal, vertical));
            hold(&format!("{name}, vertical {vertical}"), &measured, &expected);
        }
    }
}

#[test]
fn roulette_on_shared_paths_changes_no_mean() {
    let (name, scene) = scenes().swap_remove(0);
    let skipped: Vec<Film> = (0..RUNS).map(|s| render(&scene, &Plan { shift_survival: 0.1, ..reuse(EDGE, 3, 192, s) })).collect();
    let always: Vec<Film> = (0..RUNS).map(|s| render(&scene, &reuse(EDGE, 3, 192, 1000 + s))).collect();
    assert!(skipped[0].statistics.get(Counter::ShiftSkipped) > skipped[0].statistics.get(Counter::Samples));
    let of = |films: &[Film], values: &dyn Fn(&Film) -> Vec<f32>| Estimate::of(&films.iter().map(values).collect::<Vec<_>>());
    hold(&format!("{name}, primal"), &of(&skipped, &primal), &of(&always, &primal));
    hold(&format!("{name}, dx"), &of(&skipped, &|film| gradients(film, false)), &of(&always, &|film| gradients(film, false)));
}

#[test]
fn groups_of_one_pixel_agree_with_pairs() {
    for name in ["mirror", "rough", "fog"] {
        let scene = scenes().into_iter().find(|(other, _)| *other == name).unwrap().1;
        let groups: Vec<Film> = (0..RUNS).map(|s| render(&scene, &reuse(EDGE, 1, 128, s))).collect();
        let pairs: Vec<Film> = (0..RUNS).map(|s| render(&scene, &plan(Technique::Gpt, EDGE, 256, 6, 1000 + s))).collect();
        for vertical in [false, true] {
            let of = |films: &[Film]| Estimate::of(&films.iter().map(|film| gradients(film, vertical)).collect::<Vec<_>>());
            hold(&format!("{name}, vertical {vertical}"), &of(&groups), &of(&pairs));
        }
    }
}

#[test]
fn tiles_that_cut_groups_change_no_bit() {
    let scene = scenes().into_iter().find(|(name, _)| *name == "rough").unwrap().1;
    let plan = reuse(11, 4, 20, 5);
    let layout = plan.layout();
    let film = |edge| {
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
    let whole = film(64);
    // 11 = 4 + 4 + 3 columns reach over to 5 + 5 + 3.
    assert_eq!(whole.statistics.get(Counter::Samples), 20 * 13 * 13);
    for edge in [2, 3, 5, 8] {
        assert_eq!(film(edge), whole, "tiles of {edge}");
    }
}

#[test]
fn differences_within_a_group_are_those_of_its_primal() {
    let scene = scenes().swap_remove(0).1;
    let film = render(&scene, &reuse(6, 3, 32, 2)).combined();
    let dx = film.gradients.unwrap().dx;
    for (x, inside) in [(0, true), (1, true), (2, false), (3, true), (4, true)] {
        let across: f32 = (0..6).map(|y| (film.primal.at(x + 1, y, 0) - film.primal.at(x, y, 0) - dx.at(x, y, 0)).abs()).sum();
        assert_eq!(across < 1e-4, inside, "column {x}: {across}");
    }
}

#[test]
fn only_forward_differences_are_kept() {
    let layout = reuse(4, 2, 4, 1).layout();
    let steps: Vec<Offset> =
        layout.iter().filter_map(|kind| if let PlaneKind::Gradient(_, step) = kind { Some(*step) } else { None }).collect();
    assert_eq!(steps.len(), 4);
    assert!(steps.iter().all(|step| step.step > 0));
}

#[test]
fn open_furnace_has_its_closed_form() {
    // A convex body of albedo 0.6 under a constant sky of radiance 2: every point of it has radiance 1.2.
    let scene = Stage::default().sphere(Vec3::new(0.0, 0.0, 4.0), 1.0, diffuse(0.6, 0.6, 0.6), 0.0).environment(2.0).seen(0.1, 0.0);
    let all = render(&scene, &Plan { max_depth: 4, ..reuse(6, 3, 256, 1) }).combined();
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
fn a_dark_scene_has_gradients_of_exactly_zero() {
    let scene = Stage::default().sphere(Vec3::new(0.0, 0.0, 4.0), 1.0, diffuse(0.6, 0.6, 0.6), 0.0).seen(0.1, 0.0);
    let all = render(&scene, &reuse(4, 2, 8, 1)).combined();
    let g = all.gradients.unwrap();
    assert!(g.dx.data().iter().chain(g.dy.data()).chain(all.primal.data()).all(|v| *v == 0.0));
}

#[test]
fn nothing_is_ever_not_finite() {
    for (name, scene) in scenes() {
        let film = render(&scene, &Plan { max_depth: 12, ..reuse(8, 4, 16, 9) });
        assert_eq!(film.statistics.not_finite(), 0, "{name}");
    }
}
