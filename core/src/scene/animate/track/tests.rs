//! Tests of interpolation: values known in closed form, turns, keys held, time running round.

use super::*;
use crate::scene::description::Tangents;

fn track(times: &[f64], values: &[f64], interpolation: Interpolation) -> Track {
    Track {
        target: "camera.perspective.fov".into(),
        times: times.to_vec(),
        values: values.iter().map(|value| Value::Number(*value)).collect(),
        interpolation,
        tangents: None,
        repeat: false,
    }
}

fn turns(times: &[f64], values: &[[f64; 4]], interpolation: Interpolation) -> Track {
    let values = values.iter().map(|value| Value::List(value.to_vec())).collect();
    Track { target: "shapes[0].to_world[0].quaternion".into(), values, ..track(times, &[], interpolation) }
}

fn number(track: &Track, seconds: f64) -> f64 {
    match value(track, seconds) {
        Value::Number(number) => number,
        Value::List(list) => panic!("a list {list:?}"),
    }
}

fn turn(track: &Track, seconds: f64) -> [f64; 4] {
    value(track, seconds).numbers().try_into().unwrap()
}

/// A turn about +Y.
fn about_y(degrees: f64) -> [f64; 4] {
    let half = degrees.to_radians() * 0.5;
    [0.0, libm::sin(half), 0.0, libm::cos(half)]
}

fn near(found: [f64; 4], expected: [f64; 4]) {
    let same = |sign: f64| found.iter().zip(&expected).all(|(a, b)| (a - sign * b).abs() < 1e-12);
    assert!(same(1.0) || same(-1.0), "{found:?} is not {expected:?}");
}

#[test]
fn steps_hold_lines_are_straight_and_ends_hold() {
    let step = track(&[1.0, 2.0, 4.0], &[3.0, 5.0, 9.0], Interpolation::Step);
    assert_eq!([0.0, 1.0, 1.999, 2.0, 3.9, 4.0, 9.0].map(|t| number(&step, t)), [3.0, 3.0, 3.0, 5.0, 5.0, 9.0, 9.0]);
    let line = track(&[1.0, 2.0, 4.0], &[3.0, 5.0, 9.0], Interpolation::Linear);
    assert_eq!([0.0, 1.0, 1.25, 2.0, 3.5, 4.0, 1e9].map(|t| number(&line, t)), [3.0, 3.0, 3.5, 5.0, 8.0, 9.0, 9.0]);
}

#[test]
fn tangents_make_the_polynomial_that_they_belong_to() {
    // p(t) = 2 t³ − t² + 3 t − 1 and its derivative at uneven times.
    let p = |t: f64| 2.0 * t * t * t - t * t + 3.0 * t - 1.0;
    let slope = |t: f64| 6.0 * t * t - 2.0 * t + 3.0;
    let times = [0.0, 0.5, 2.0];
    let slopes: Vec<Value> = times.iter().map(|t| Value::Number(slope(*t))).collect();
    let tangents = Some(Tangents { incoming: slopes.clone(), outgoing: slopes });
    let curve = Track { tangents, ..track(&times, &times.map(p), Interpolation::Cubic) };
    for k in 0..=40 {
        let t = f64::from(k) * 0.05;
        assert!((number(&curve, t) - p(t)).abs() < 1e-12, "at {t}: {} is not {}", number(&curve, t), p(t));
    }
}

#[test]
fn without_tangents_lines_stay_lines_and_middles_are_parabolas() {
    let line = track(&[0.0, 0.3, 1.0, 1.5], &[1.0, 1.6, 3.0, 4.0], Interpolation::Cubic);
    for k in 0..=30 {
        let t = f64::from(k) * 0.05;
        assert!((number(&line, t) - (1.0 + 2.0 * t)).abs() < 1e-12, "at {t}");
    }
    // With even times the slopes of a parabola's inner keys are exact.
    let parabola = track(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 4.0, 9.0], Interpolation::Cubic);
    for t in [1.0, 1.2, 1.7, 2.0] {
        assert!((number(&parabola, t) - t * t).abs() < 1e-12, "at {t}");
    }
}

#[test]
fn turns_go_the_short_way_at_even_speed() {
    let quarter = turns(&[0.0, 2.0], &[about_y(0.0), about_y(90.0)], Interpolation::Linear);
    near(turn(&quarter, 1.0), about_y(45.0));
    near(turn(&quarter, 0.5), about_y(22.5));
    // The same end, written by the other quaternion for it: no long way round.
    let other = turns(&[0.0, 2.0], &[about_y(0.0), about_y(90.0).map(|x| -x)], Interpolation::Linear);
    near(turn(&other, 1.0), about_y(45.0));
    // 300° is −60°.
    let back = turns(&[0.0, 1.0], &[about_y(0.0), about_y(300.0)], Interpolation::Linear);
    near(turn(&back, 0.5), about_y(-30.0));
    // Any length counts as 1.
    let long = turns(&[0.0, 1.0], &[about_y(0.0).map(|x| 3.0 * x), about_y(90.0).map(|x| 0.1 * x)], Interpolation::Linear);
    near(turn(&long, 0.5), about_y(45.0));
}

#[test]
fn degenerate_turns_are_stable() {
    for degrees in [0.0, 1e-12, 1e-7, 179.999_999_999, 180.0, 180.000_001, 360.0] {
        let track = turns(&[0.0, 1.0], &[about_y(0.0), about_y(degrees)], Interpolation::Linear);
        for k in 0..=10 {
            let q = turn(&track, f64::from(k) / 10.0);
            let length = q.iter().map(|x| x * x).sum::<f64>();
            assert!((length - 1.0).abs() < 1e-12, "{degrees}°: {q:?}");
        }
    }
    let small = turns(&[0.0, 1.0], &[about_y(0.0), about_y(1e-6)], Interpolation::Linear);
    assert!((turn(&small, 0.5)[1] / about_y(0.5e-6)[1] - 1.0).abs() < 1e-9);
}

#[test]
fn cubic_turns_pass_through_their_keys_and_stay_turns() {
    let keys = [about_y(0.0), about_y(80.0).map(|x| -x), about_y(100.0), about_y(200.0)];
    let track = turns(&[0.0, 1.0, 1.5, 3.0], &keys, Interpolation::Cubic);
    for (time, key) in track.times.iter().zip(keys) {
        near(turn(&track, *time), key);
        near(turn(&track, time + 1e-14), key);
    }
    let mut last = 0.0;
    for k in 0..=60 {
        let q = turn(&track, f64::from(k) * 0.05);
        let angle = 2.0 * libm::atan2(q[1].abs(), if q[1] < 0.0 { -q[3] } else { q[3] }).to_degrees();
        assert!(angle > last - 1e-9 && angle < 200.001, "{angle} after {last}");
        last = angle;
    }
}

#[test]
fn a_value_that_does_not_change_keeps_its_bits() {
    let odd = [0.1 + 0.2, 1.0 / 3.0, 0.7, 0.05];
    for interpolation in [Interpolation::Step, Interpolation::Linear, Interpolation::Cubic] {
        let still = turns(&[0.0, 0.7, 3.0], &[odd, odd, odd], interpolation);
        let level = track(&[0.0, 0.7, 3.0], &[odd[0]; 3], interpolation);
        for k in 0..30 {
            let t = f64::from(k) * 0.11;
            assert_eq!(turn(&still, t), odd, "{interpolation:?} at {t}");
            assert_eq!(number(&level, t), odd[0], "{interpolation:?} at {t}");
        }
    }
}

#[test]
fn time_runs_round() {
    let round = Track { repeat: true, ..track(&[1.0, 2.0, 3.0], &[0.0, 4.0, 0.0], Interpolation::Linear) };
    for (time, expected) in [(1.0, 0.0), (1.5, 2.0), (2.5, 2.0), (3.0, 0.0), (3.5, 2.0), (0.5, 2.0), (103.25, 1.0)] {
        assert!((number(&round, time) - expected).abs() < 1e-9, "at {time}: {}", number(&round, time));
    }
    let single = Track { repeat: true, ..track(&[1.0], &[7.0], Interpolation::Linear) };
    assert_eq!(number(&single, 5.0), 7.0);
}

#[test]
fn extremes_bound_a_cubic() {
    let curve = track(&[0.0, 1.0, 2.0, 2.5], &[0.0, 1.0, 1.0, -0.5], Interpolation::Cubic);
    let at = |times: &mut dyn Iterator<Item = f64>| {
        times.map(|t| number(&curve, t)).fold([9.0, -9.0], |[a, b]: [f64; 2], x| [a.min(x), b.max(x)])
    };
    let known = at(&mut curve.times.iter().copied().chain(extremes(&curve)));
    let dense = at(&mut (0..=2500).map(|k| f64::from(k) * 1e-3));
    assert!(known[1] > 1.05, "it overshoots: {known:?}");
    assert!(known[0] <= dense[0] && known[1] >= dense[1] && (known[1] - dense[1]).abs() < 1e-5, "{known:?} bounds {dense:?}");
}
