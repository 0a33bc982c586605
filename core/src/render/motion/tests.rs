//! Motion vectors and temporal gradients: what rests has partners and no difference at all, what moves is followed, and no mean changes.

use super::Motion;
use crate::film::Film;
use crate::lattice::{Extent, Moment, Tile};
use crate::math::Vec3;
use crate::plan::{Plan, Technique, Temporal};
use crate::scene::{Instants, Scene};
use crate::testing::films::{Estimate, agree, render_moment};
use crate::testing::{Stage, diffuse, plan, room, scenes};

const EDGE: u32 = 8;

fn temporal(edge: u32, samples: u32, seed: u64, motion: bool) -> Plan {
    let temporal = Some(Temporal { motion, ..Temporal::default() });
    Plan { temporal, ..plan(Technique::Gpt, edge, samples, 5, seed) }
}

/// A grey card in front of a lit wall, seen head on: at depth 2 a pixel of 8 is 0.25 wide.
fn card(x: f32) -> Scene {
    room().quad(Vec3::new(x - 0.375, -0.5, 2.0), Vec3::Y, Vec3::X * 0.75, diffuse(0.6, 0.3, 0.2), 0.0).seen(0.5, 0.0)
}

/// Two moments of a scene: the first one alone, the second one with what was before it.
fn pair(before: &Scene, now: &Scene, plan: &Plan) -> [Film; 2] {
    let second = Instants { before: Some(before), ..Instants::from(now) };
    [render_moment(&Instants::from(before), plan, Moment::of(6)), render_moment(&second, plan, Moment::of(7))]
}

/// A₂(q) − B₁(p) of the pixels with a partner, zero elsewhere.
fn difference([first, second]: &[Film; 2]) -> Vec<f32> {
    let motion = second.motion.as_ref();
    let (a, b) = (&second.halves[0].primal, &first.halves[1].primal);
    let mut out = Vec::new();
    for c in 0..3 {
        for y in 0..first.extent.height {
            for x in 0..first.extent.width {
                let by = |c: usize| motion.map_or(0, |motion| motion.at(x, y, c) as i64);
                let there = motion.is_none_or(|motion| motion.at(x, y, 2) == 1.0);
                let (px, py) = ((i64::from(x) + by(0)) as u32, (i64::from(y) + by(1)) as u32);
                out.push(if there { a.at(x, y, c) - b.at(px, py, c) } else { 0.0 });
            }
        }
    }
    out
}

#[test]
fn what_rests_has_no_difference_in_time() {
    for (name, scene) in scenes() {
        for motion in [false, true] {
            let films = pair(&scene, &scene, &temporal(EDGE, 8, 3, motion));
            let [first, second] = [&films[0].halves[1], &films[1].halves[0]];
            assert_eq!((&first.primal, &first.gradients), (&second.primal, &second.gradients), "{name}, motion {motion}");
            assert_ne!(films[0].halves[0].primal, first.primal, "{name}: halves are independent");
            let Some(vectors) = &films[1].motion else {
                assert!(!motion);
                continue;
            };
            // Every pixel is its own partner.
            assert!(vectors.plane(0).iter().chain(vectors.plane(1)).all(|by| *by == 0.0), "{name}");
            assert!(vectors.plane(2).iter().all(|there| *there == 1.0), "{name}");
        }
    }
}

#[test]
fn partners_follow_what_moves_and_nobody_has_two() {
    let extent = Extent { width: EDGE, height: EDGE };
    let tile = Tile { x: 0, y: 0, width: EDGE, height: EDGE };
    for pixels in [-3i64, -1, 1, 2] {
        let (before, now) = (card(0.125), card(0.125 + 0.25 * pixels as f32));
        let motion = Motion::of_tile(&now, &before, extent, tile);
        let (mut moved, mut hidden, mut taken) = (0, 0, vec![false; extent.pixels()]);
        for y in 0..EDGE {
            for x in 0..EDGE {
                let Some([px, py]) = motion.partner([x, y]) else {
                    hidden += 1;
                    continue;
                };
                assert!(!std::mem::replace(&mut taken[extent.index(px, py)], true), "{px}, {py} has two partners");
                assert_eq!(py, y);
                let by = i64::from(px) - i64::from(x);
                assert!(by == 0 || by == -pixels, "moved by {by}");
                moved += usize::from(by != 0);
            }
        }
        // The card covers 3 × 4 pixels, the wall that it uncovers has no partner, and as much of it is lost under the card.
        let uncovered = 4 * pixels.unsigned_abs().min(3) as usize;
        assert_eq!((moved, hidden), (12, uncovered), "by {pixels}");
    }
}

#[test]
fn differences_in_time_have_the_mean_of_what_they_measure() {
    let runs = 24;
    for (pixels, motion) in [(0.0f32, false), (1.0, false), (1.0, true)] {
        let (before, now) = (card(0.125), card(0.125 + 0.25 * pixels + 0.03));
        let measured: Vec<[Film; 2]> = (0..runs).map(|seed| pair(&before, &now, &temporal(EDGE, 64, seed, motion))).collect();
        // The same pixels, from halves that share nothing.
        let expected = (0..runs).map(|seed| {
            let [mut first, mut second] = pair(&before, &now, &temporal(EDGE, 256, 1000 + seed, motion));
            second.halves.swap(0, 1);
            first.halves.swap(0, 1);
            difference(&[first, second])
        });
        let expected: Vec<Vec<f32>> = expected.collect();
        let differences: Vec<Vec<f32>> = measured.iter().map(difference).collect();
        agree(&format!("by {pixels}, motion {motion}"), &Estimate::of(&differences), &Estimate::of(&expected));
        // Numbers drawn as another pixel: the half keeps its mean.
        let half = |films: &[Film; 2], k: usize| films[1].halves[k].primal.data().to_vec();
        let of = |k: usize| Estimate::of(&measured.iter().map(|films| half(films, k)).collect::<Vec<_>>());
        agree("half A against half B", &of(0), &of(1));
    }
}

#[test]
fn following_what_moves_lowers_the_noise_of_differences() {
    let spread = |motion: bool| {
        let (before, now) = (card(0.125), card(0.375));
        let runs: Vec<[Film; 2]> = (0..16).map(|seed| pair(&before, &now, &temporal(EDGE, 16, seed, motion))).collect();
        // The middle of the card, where it is now and was not before but for its other half.
        let [x, y] = [5, 4];
        let vectors = |films: &[Film; 2]| films[1].motion.as_ref().map_or(0.0, |motion| motion.at(x, y, 0));
        assert!(!motion || vectors(&runs[0]) == -1.0);
        let index = Extent { width: EDGE, height: EDGE }.index(x, y);
        let values: Vec<f64> = runs.iter().map(|films| f64::from(difference(films)[index])).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
        let halves: Vec<f64> = runs.iter().map(|films| f64::from(films[1].halves[0].primal.data()[index])).collect();
        let mean = halves.iter().sum::<f64>() / halves.len() as f64;
        variance / (halves.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (halves.len() - 1) as f64)
    };
    let (followed, left) = (spread(true), spread(false));
    eprintln!("variance of the difference over that of the half: {followed:.3} followed, {left:.3} not");
    // Two independent halves have twice the variance of one.
    assert!(followed < 0.5 && followed < left, "{followed} {left}");
}

#[test]
fn a_sky_is_followed_by_direction() {
    let turned = |radians: f64| {
        let (s, c) = (libm::sin(radians), libm::cos(radians));
        let rows = [[c, 0.0, s, 0.0], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, 0.0]];
        let mut scene = Stage::default().environment(1.0).seen(0.5, 0.0);
        scene.sensor.to_world = crate::math::Transform::from_rows(rows).unwrap();
        scene
    };
    let extent = Extent { width: 16, height: 16 };
    let tile = Tile { x: 0, y: 0, width: 16, height: 16 };
    // Two pixels' worth at the middle.
    let motion = Motion::of_tile(&turned(0.125), &turned(0.0), extent, tile);
    let partners = (0..16).filter_map(|x| motion.partner([x, 8])).count();
    assert!((12..16).contains(&partners), "{partners}");
    assert_eq!(motion.partner([8, 8]).map(|[_, y]| y), Some(8));
}
