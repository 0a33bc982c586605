//! Links are mutual, the same from any tile and within surfaces; what is measured along them is right, and so is the image.

use super::*;
use crate::film::{Film, FrameFold, TileFold};
use crate::lattice::{Extent, Moment};
use crate::plan::{ReconstructionKind, Technique, WorkUnit};
use crate::reconstruction::reconstruct;
use crate::render::render_unit;
use crate::testing::films::{Estimate, render, z_scores};
use crate::testing::{plan, scenes};

const EDGE: u32 = 7;
const RUNS: u64 = 24;

fn named(wanted: &str) -> Scene {
    scenes().into_iter().find(|(name, _)| *name == wanted).unwrap().1
}

fn graph(edge: u32, samples: u32, seed: u64) -> Plan {
    plan(Technique::Graph, edge, samples, 6, seed)
}

fn whole(extent: Extent) -> Tile {
    Tile { x: 0, y: 0, width: extent.width, height: extent.height }
}

#[test]
fn links_are_mutual_bounded_and_the_same_from_any_tile() {
    for (name, scene) in scenes() {
        let plan = Plan { extent: Extent { width: 29, height: 17 }, ..graph(1, 1, 0) };
        let all = Links::of_tile(&scene, &plan, whole(plan.extent)).links;
        let of = |x: u32, y: u32| &all[plan.extent.index(x, y)];
        for [x, y] in places(whole(plan.extent)) {
            assert!(of(x, y).len() <= plan.links as usize);
            for [dx, dy] in of(x, y) {
                assert!(dx.abs().max(dy.abs()) <= i64::from(REACH) && (*dx, *dy) != (0, 0));
                let (tx, ty) = (i64::from(x) + dx, i64::from(y) + dy);
                assert!(plan.extent.contains(tx, ty) && of(tx as u32, ty as u32).contains(&[-dx, -dy]), "{name}: {x}, {y}");
            }
        }
        for edge in [1, 4, 9] {
            for tile in plan.extent.tiles(edge) {
                let mine = Links::of_tile(&scene, &plan, tile).links;
                assert!(places(tile).zip(&mine).all(|([x, y], links)| links == of(x, y)), "{name}: {tile:?}");
            }
        }
    }
}

#[test]
fn links_stay_on_a_surface_and_reach_along_its_edge() {
    let plan = Plan { extent: Extent { width: 40, height: 40 }, ..graph(1, 1, 0) };
    let scene = named("diffuse");
    let features = Features::of_tile(&scene, plan.extent, whole(plan.extent));
    let links = Links::of_tile(&scene, &plan, whole(plan.extent)).links;
    let at = |[x, y]: [u32; 2]| features.at(x, y);
    let (mut cut, mut linked) = (0, 0);
    for (place, links) in places(whole(plan.extent)).zip(&links) {
        for [dx, dy] in links {
            let there = [(i64::from(place[0]) + dx) as u32, (i64::from(place[1]) + dy) as u32];
            assert_eq!(at(place).kind, at(there).kind);
        }
        if place[0] + 1 < plan.extent.width && at(place).kind != at([place[0] + 1, place[1]]).kind {
            cut += 1;
            linked += links.len();
        }
    }
    // Beside an edge pixels have about half of their surroundings, and still most of their links.
    assert!(cut > 50 && linked >= 4 * cut, "{linked} links of {cut} pixels");
}

/// z is t-distributed with 23 degrees or more: at a Šidák-corrected 10⁻³ over 3000 values |z| stays below 7. Values of a film share noise,
/// so that the mean square of z tells nothing.
fn hold(name: &str, a: &Estimate, b: &Estimate) {
    let z = z_scores(a, b);
    let worst = z.iter().fold(0.0f64, |worst, z| worst.max(z.abs()));
    eprintln!("{name}: worst |z| {worst:.2}, mean {:.3} over {}", z.iter().sum::<f64>() / z.len() as f64, z.len());
    assert!(!z.is_empty() && worst < 7.0, "{name}: worst z {worst}");
}

#[test]
fn differences_and_images_are_unbiased() {
    for (name, scene) in scenes() {
        let linked: Vec<Film> = (0..RUNS).map(|s| render(&scene, &graph(EDGE, 96, s))).collect();
        let alone: Vec<Film> = (0..RUNS).map(|s| render(&scene, &plan(Technique::Pt, EDGE, 512, 6, 1000 + s))).collect();
        let of = |films: &[Film], values: &dyn Fn(&Film) -> Vec<f32>| Estimate::of(&films.iter().map(values).collect::<Vec<_>>());
        let links = linked[0].combined().graph.unwrap().links;
        assert!(links.len() > 20, "{name}: {} links", links.len());
        let measured = of(&linked, &|film| film.combined().graph.unwrap().differences.concat());
        let expected = of(&alone, &|film| {
            let primal = film.combined().primal;
            links.iter().flat_map(|[i, j]| [0, 1, 2].map(|c| primal.plane(c)[*j as usize] - primal.plane(c)[*i as usize])).collect()
        });
        hold(&format!("{name}, differences"), &measured, &expected);
        let images = of(&linked, &|film| reconstruct(film, ReconstructionKind::Graph, 0.2).unwrap().image.data().to_vec());
        let primals = of(&alone, &|film| reconstruct(film, ReconstructionKind::None, 0.2).unwrap().image.data().to_vec());
        hold(&format!("{name}, images"), &images, &primals);
        let sum = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>();
        for film in &linked {
            let done = reconstruct(film, ReconstructionKind::Graph, 0.2).unwrap();
            let (image, primal) = (sum(done.image.data()), sum(done.primal.data()));
            assert!((image / primal - 1.0).abs() < 1e-6, "{name}: the image sums to {image}, the primal to {primal}");
        }
    }
}

#[test]
fn neither_tiles_nor_links_touch_a_bit() {
    let scene = named("bounded");
    let plan = graph(11, 20, 5);
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
    assert_eq!(whole, film(3));
    assert_eq!(whole, film(1));
    let alone = render(&scene, &Plan { technique: Technique::Pt, ..plan.clone() });
    assert_eq!(whole.combined().primal, alone.combined().primal);
    // One sample fills one half only.
    let single = render(&scene, &Plan { samples: 1, ..plan.clone() });
    assert!(reconstruct(&single, ReconstructionKind::Graph, 0.2).unwrap().halves.is_none());
}
