//! Tracks: the value of a number, a list of numbers or a turn at any time.
//!
//! # Source
//! Khronos Group, "glTF 2.0 Specification", 2021, appendix C (interpolation); Shoemake, "Animating Rotation with Quaternion Curves",
//! SIGGRAPH 1985 (slerp); Catmull and Rom, "A Class of Local Interpolating Splines", 1974, on uneven times.

use crate::scene::description::{Interpolation, Track, Value};

/// Where a time lies among keys.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Spot {
    /// At a key, or held by one.
    Key(usize),
    /// Past key `k` by this share of the time to the next one, in (0, 1).
    Between(usize, f64),
}

/// Whether a track turns something.
pub(in crate::scene) fn is_turn(track: &Track) -> bool {
    track.target.ends_with(".quaternion")
}

/// The value of a sound track at a time [s].
pub(in crate::scene) fn value(track: &Track, seconds: f64) -> Value {
    let numbers = match spot(track, seconds) {
        Spot::Key(k) => track.values[k].numbers().to_vec(),
        Spot::Between(k, _) if track.interpolation == Interpolation::Step => track.values[k].numbers().to_vec(),
        Spot::Between(k, u) => between(track, k, u),
    };
    match &track.values[0] {
        Value::Number(_) => Value::Number(numbers[0]),
        Value::List(_) => Value::List(numbers),
    }
}

fn spot(track: &Track, seconds: f64) -> Spot {
    let times = &track.times;
    let last = times.len() - 1;
    let (start, end) = (times[0], times[last]);
    let mut seconds = seconds;
    if track.repeat && end > start {
        let period = end - start;
        let round = (seconds - start) / period;
        seconds = start + (round - round.floor()) * period;
    }
    if seconds <= start {
        return Spot::Key(0);
    }
    if seconds >= end {
        return Spot::Key(last);
    }
    let k = times.partition_point(|time| *time <= seconds) - 1;
    let u = (seconds - times[k]) / (times[k + 1] - times[k]);
    if u <= 0.0 { Spot::Key(k) } else { Spot::Between(k, u) }
}

fn between(track: &Track, k: usize, u: f64) -> Vec<f64> {
    let (from, to) = (track.values[k].numbers(), track.values[k + 1].numbers());
    let turn = is_turn(track);
    if track.interpolation == Interpolation::Linear && from == to {
        return from.to_vec();
    }
    if track.interpolation == Interpolation::Linear {
        return match (quaternion(from), quaternion(to)) {
            (Some(from), Some(to)) if turn => slerp(from, to, u).to_vec(),
            _ => from.iter().zip(to).map(|(a, b)| if a == b { *a } else { a * (1.0 - u) + b * u }).collect(),
        };
    }
    let span = track.times[k + 1] - track.times[k];
    let mut numbers: Vec<f64> = (0..from.len())
        .map(|component| {
            let [a, leaving, b, reaching] = hermite(track, k, component);
            if a == b && leaving == 0.0 && reaching == 0.0 { a } else { cubic([a, leaving * span, b, reaching * span], u) }
        })
        .collect();
    if turn && numbers != from {
        let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 && length.is_finite() {
            numbers.iter_mut().for_each(|x| *x /= length);
        } else {
            numbers = from.to_vec();
        }
    }
    numbers
}

/// Value and slope at key `k` as it is left, and at the next one as it is reached.
fn hermite(track: &Track, k: usize, component: usize) -> [f64; 4] {
    if let Some(tangents) = &track.tangents {
        let value = |k: usize| track.values[k].numbers()[component];
        return [value(k), tangents.outgoing[k].numbers()[component], value(k + 1), tangents.incoming[k + 1].numbers()[component]];
    }
    // The keys around this segment; of two quaternions for the same turn the one on the side of key `k`.
    let signed = |at: usize, towards: usize| {
        let (here, there) = (track.values[at].numbers(), track.values[towards].numbers());
        let dot: f64 = here.iter().zip(there).map(|(a, b)| a * b).sum();
        if is_turn(track) && dot < 0.0 { -1.0 } else { 1.0 }
    };
    let last = track.times.len() - 1;
    let number = |at: usize, sign: f64| (track.times[at], track.values[at].numbers()[component] * sign);
    let here = number(k, 1.0);
    let next_sign = signed(k + 1, k);
    let next = number(k + 1, next_sign);
    let before = if k == 0 { here } else { number(k - 1, signed(k - 1, k)) };
    let after = if k + 1 == last { next } else { number(k + 2, next_sign * signed(k + 2, k + 1)) };
    let slope = |from: (f64, f64), to: (f64, f64)| (to.1 - from.1) / (to.0 - from.0);
    [here.1, slope(before, next), next.1, slope(here, after)]
}

/// Hermite's cubic through a and b, with slopes over the whole segment.
fn cubic([a, leaving, b, reaching]: [f64; 4], u: f64) -> f64 {
    let v = 1.0 - u;
    // In Bernstein's form, which keeps to the ends however large the numbers are.
    let (inner, outer) = (a + leaving / 3.0, b - reaching / 3.0);
    a * (v * v * v) + inner * (3.0 * u * v * v) + outer * (3.0 * u * u * v) + b * (u * u * u)
}

fn quaternion(numbers: &[f64]) -> Option<[f64; 4]> {
    let numbers: [f64; 4] = numbers.try_into().ok()?;
    let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length > 0.0 && length.is_finite()).then(|| numbers.map(|x| x / length))
}

/// The turn between two unit quaternions, along the shorter way, at even speed.
fn slerp(a: [f64; 4], b: [f64; 4], u: f64) -> [f64; 4] {
    let dot: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    let b = if dot < 0.0 { b.map(|x| -x) } else { b };
    if a == b {
        return a;
    }
    let norm = |sign: f64| a.iter().zip(&b).map(|(a, b)| (a + sign * b) * (a + sign * b)).sum::<f64>().sqrt();
    // Exact for small angles, where the arc cosine of the product is not.
    let angle = 2.0 * libm::atan2(norm(-1.0), norm(1.0));
    let sine = libm::sin(angle);
    let (p, q) = if sine > 1e-9 { (libm::sin((1.0 - u) * angle) / sine, libm::sin(u * angle) / sine) } else { (1.0 - u, u) };
    let mut turn: [f64; 4] = std::array::from_fn(|k| p * a[k] + q * b[k]);
    let length = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
    turn.iter_mut().for_each(|x| *x /= length);
    turn
}

/// Times at which a component of a cubic track is greatest or least between its keys: with the keys, all that its range depends on.
pub(in crate::scene) fn extremes(track: &Track) -> Vec<f64> {
    let mut times = Vec::new();
    if track.interpolation != Interpolation::Cubic || is_turn(track) {
        return times;
    }
    for k in 0..track.times.len().saturating_sub(1) {
        let span = track.times[k + 1] - track.times[k];
        for component in 0..track.values[k].numbers().len() {
            let [a, leaving, b, reaching] = hermite(track, k, component);
            let (p, q, r) = (leaving * span / 3.0, b - reaching * span / 3.0 - (a + leaving * span / 3.0), reaching * span / 3.0);
            // The derivative over three: p v² + 2 q u v + r u², v = 1 − u.
            let (second, first) = (p - 2.0 * q + r, 2.0 * (q - p));
            let roots = if second == 0.0 {
                [-p / first, f64::NAN]
            } else {
                let root = (first * first - 4.0 * second * p).sqrt();
                [(-first - root) / (2.0 * second), (-first + root) / (2.0 * second)]
            };
            times.extend(roots.into_iter().filter(|u| *u > 0.0 && *u < 1.0).map(|u| track.times[k] + u * span));
        }
    }
    times
}

#[cfg(test)]
mod tests;
