//! Least squares over a window, all pixels weighted alike: exact by [`Spectral`] where nothing moves.

use super::moment::{CopyFilm, HalfMoment};
use super::spectral::{Spectral, Uniform};
use crate::film::Image;
use rayon::prelude::*;

/// The images of all moments where every pixel is its own partner in time.
pub(super) fn solve_still(copies: &[&CopyFilm], weights: &Uniform) -> Vec<Image> {
    let Some(extent) = copies.first().map(|copy| copy.halves[0].primal.extent()) else { return Vec::new() };
    let (w, h) = (extent.width as usize, extent.height as usize);
    let mut images = vec![Image::new(extent, 3); copies.len()];
    if w * h == 0 {
        return images;
    }
    let inverse = Spectral::new(w, h, weights.clone());
    for c in 0..3 {
        let mut values = right_hand_side(copies, weights, c);
        inverse.solve(&mut values);
        for (image, values) in images.iter_mut().zip(&values) {
            for (out, v) in image.plane_mut(c).iter_mut().zip(values) {
                *out = *v as f32;
            }
        }
    }
    images
}

/// One channel of α² P + ∇ᵀG + D_tᵀ(w_t² dt + w_m² ∇ᵀ(D_t G)), by moment.
fn right_hand_side(copies: &[&CopyFilm], weights: &Uniform, channel: usize) -> Vec<Vec<f64>> {
    let width = copies[0].halves[0].primal.extent().width as usize;
    (0..copies.len())
        .into_par_iter()
        .map(|t| {
            let copy = copies[t];
            let share = copy.share();
            let mut out = vec![0.0; copy.halves[0].primal.extent().pixels()];
            let mean = |image: fn(&HalfMoment) -> &Image| {
                let [a, b] = copy.halves.each_ref().map(|half| image(half).plane(channel));
                move |i: usize| share * f64::from(a[i]) + (1.0 - share) * f64::from(b[i])
            };
            scatter(&mut out, width, [weights.screen, 1.0], mean(primal), mean(dx), mean(dy));
            // The change since the moment before, and to the moment after.
            let changes = [t.checked_sub(1).map(|k| (k, 1.0)), (t + 1 < copies.len()).then_some((t, -1.0))];
            for (k, sign) in changes.into_iter().flatten() {
                let (later, earlier) = (&copies[k + 1].halves[0], &copies[k].halves[1]);
                let change = |image: fn(&HalfMoment) -> &Image| {
                    let (a, b) = (image(later).plane(channel), image(earlier).plane(channel));
                    move |i: usize| f64::from(a[i] - b[i])
                };
                scatter(&mut out, width, weights.pairs[k].map(|w| sign * w), change(primal), change(dx), change(dy));
            }
            out
        })
        .collect()
}

fn primal(half: &HalfMoment) -> &Image {
    &half.primal
}

fn dx(half: &HalfMoment) -> &Image {
    &half.dx
}

fn dy(half: &HalfMoment) -> &Image {
    &half.dy
}

/// Adds v · value + s · ∇ᵀ(dx, dy).
fn scatter(
    out: &mut [f64],
    width: usize,
    [v, s]: [f64; 2],
    value: impl Fn(usize) -> f64,
    dx: impl Fn(usize) -> f64,
    dy: impl Fn(usize) -> f64,
) {
    for i in 0..out.len() {
        out[i] += v * value(i);
        if i % width + 1 < width {
            let step = s * dx(i);
            out[i] -= step;
            out[i + 1] += step;
        }
        if i + width < out.len() {
            let step = s * dy(i);
            out[i] -= step;
            out[i + width] += step;
        }
    }
}
