//! Noisy measurements of moving pictures: half B of a moment and half A of the next one share their random numbers.

use super::super::super::tests::{differences, picture};
use super::*;

/// A moving picture and how it is measured.
pub(super) struct Clip {
    /// What is to be seen, by moment.
    pub(super) truth: Vec<Image>,
    /// Columns and rows of the picture's motion from each moment to the next, if it is followed.
    pub(super) pan: Option<[i64; 2]>,
    /// Samples of each half of a copy.
    pub(super) samples: usize,
    /// Copies: 1 or 2.
    pub(super) copies: usize,
    /// Which pixels keep nothing of the random numbers of the moment before.
    pub(super) fresh: Pixels,
    /// What makes one run differ from another.
    pub(super) seed: u64,
}

/// Which pixels, by column and row.
pub(super) type Pixels = fn(u32, u32) -> bool;

pub(super) const NOWHERE: Pixels = |_, _| false;

/// A picture that stands still, brightens by `pace` a moment.
pub(super) fn brightening(extent: Extent, count: usize, pace: f32) -> Vec<Image> {
    let mut truth = vec![picture(extent); count];
    for (t, image) in truth.iter_mut().enumerate() {
        image.data_mut().iter_mut().for_each(|v| *v *= 1.0 + pace * t as f32);
    }
    truth
}

/// A large picture seen through a frame that moves over it, so that what is seen moves by `pan` a moment.
pub(super) fn panning(extent: Extent, count: usize, pan: [i64; 2]) -> Vec<Image> {
    let reach = |pan: i64, size: u32| size + (count as i64 * pan.abs()) as u32;
    let large = picture(Extent { width: reach(pan[0], extent.width), height: reach(pan[1], extent.height) });
    let start = pan.map(|pan| if pan > 0 { count as i64 * pan } else { 0 });
    let see = |t: i64| {
        let mut image = Image::new(extent, 3);
        for (y, x) in (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| (y, x))) {
            let at = |k: usize, place: u32| (start[k] - t * pan[k] + i64::from(place)) as u32;
            (0..3).for_each(|c| image.set(x, y, c, large.at(at(0, x), at(1, y), c)));
        }
        image
    };
    (0..count as i64).map(see).collect()
}

/// A uniform number in [0, 1).
fn number(words: [u64; 5]) -> f32 {
    let mut z = 0x9e37_79b9_7f4a_7c15u64;
    for word in words {
        z = (z ^ word).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 32;
    }
    (z >> 40) as f32 / (1 << 24) as f32
}

impl Clip {
    pub(super) fn new(truth: Vec<Image>) -> Self {
        Self { truth, pan: None, samples: 8, copies: 2, fresh: NOWHERE, seed: 0 }
    }

    fn extent(&self) -> Extent {
        self.truth[0].extent()
    }

    /// The pixel of the moment before that shows the same as this one.
    pub(super) fn partner(&self, x: u32, y: u32) -> Option<(u32, u32)> {
        let [columns, rows] = self.pan.unwrap_or([0, 0]);
        let (px, py) = (i64::from(x) - columns, i64::from(y) - rows);
        self.extent().contains(px, py).then_some((px as u32, py as u32))
    }

    pub(super) fn moments(&self) -> Vec<MomentFilm> {
        (0..self.truth.len())
            .map(|t| {
                let films: Vec<Film> = (0..self.copies).map(|copy| self.film(t, copy)).collect();
                MomentFilm::new(&films.iter().collect::<Vec<_>>()).unwrap()
            })
            .collect()
    }

    pub(super) fn film(&self, t: usize, copy: usize) -> Film {
        let extent = self.extent();
        let motion = self.pan.map(|[columns, rows]| {
            let mut motion = Image::new(extent, 3);
            for (y, x) in (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| (y, x))) {
                if self.partner(x, y).is_some() {
                    [-columns as f32, -rows as f32, 1.0].into_iter().enumerate().for_each(|(c, v)| motion.set(x, y, c, v));
                }
            }
            motion
        });
        let (rgb, grey) = (Image::new(extent, 3), Image::new(extent, 1));
        let features = Features { albedo: rgb.clone(), normal: rgb, depth: grey };
        let halves = [self.half(t, copy, true), self.half(t, copy, false)];
        Film { extent, halves, counts: None, motion, features, statistics: Statistics::default() }
    }

    /// Samples are skewed as those of paths are: most are dark, and mean and variance go together.
    fn half(&self, t: usize, copy: usize, is_a: bool) -> HalfFilm {
        let extent = self.extent();
        let (gx, gy) = differences(&self.truth[t]);
        let key = if is_a { t } else { t + 1 };
        // The number of a sample of some plane. Half A takes it from where it was in the moment before.
        let drawn = |x: u32, y: u32, plane: u64, sample: usize| {
            let place = match self.partner(x, y).filter(|_| is_a) {
                Some(before) if !(self.fresh)(x, y) => extent.index(before.0, before.1) as u64,
                None | Some(_) if is_a => extent.index(x, y) as u64 + (1 << 32),
                _ => extent.index(x, y) as u64,
            };
            number([self.seed, (copy as u64) << 32 | key as u64, plane, place, sample as u64])
        };
        let mut planes = [Image::new(extent, 3), Image::new(extent, 3), Image::new(extent, 3)];
        let mut variances = [Image::new(extent, 3), Image::new(extent, 1), Image::new(extent, 1)];
        for (y, x) in (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| (y, x))) {
            for (k, (plane, variance)) in planes.iter_mut().zip(&mut variances).enumerate() {
                if k == 1 && x + 1 == extent.width || k == 2 && y + 1 == extent.height {
                    continue;
                }
                let draws: Vec<f32> = (0..self.samples).map(|s| if drawn(x, y, k as u64, s) < 0.25 { 3.0 } else { -1.0 }).collect();
                for c in 0..3 {
                    let truth = self.truth[t].at(x, y, c);
                    let samples = draws.iter().map(|draw| match k {
                        0 => truth * (1.0 + draw),
                        1 => gx.at(x, y, c) + 0.3 * truth * draw,
                        _ => gy.at(x, y, c) + 0.3 * truth * draw,
                    });
                    let samples: Vec<f64> = samples.map(f64::from).collect();
                    let n = samples.len() as f64;
                    let mean = samples.iter().sum::<f64>() / n;
                    let square = samples.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
                    plane.set(x, y, c, mean as f32);
                    let channel = if k == 0 { c } else { 0 };
                    let sum = if k == 0 { 0.0 } else { variance.at(x, y, 0) };
                    variance.set(x, y, channel, sum + square as f32);
                }
            }
        }
        let [primal, dx, dy] = planes;
        let [primal_variance, dx_variance, dy_variance] = variances;
        HalfFilm {
            samples: self.samples as u32,
            primal,
            primal_variance,
            direct: Image::new(extent, 3),
            gradients: Some(Gradients { dx, dy, dx_variance, dy_variance }),
            graph: None,
        }
    }
}
