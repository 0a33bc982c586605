//! Weights that do not depend on the image: alike in all pixels, or by what the noise of each is.

use super::super::normal::{Errors, Weights};
use super::super::smooth::smoothed;
use super::super::variances::{RADIUS, Variances, mean_deviation};
use super::links::Links;
use super::moment::HalfMoment;
use super::source::Source;
use super::spectral::Uniform;
use super::system::{Rule, mask};
use super::weights::RANGE;
use crate::film::Image;

/// All pixels alike.
pub(super) struct Alike<'a> {
    pub(super) weights: &'a Uniform,
    pub(super) links: &'a [Option<Links>],
}

impl Rule for Alike<'_> {
    fn space(&self, _moment: usize, _y: usize, _errors: &Errors, row: Weights) -> f64 {
        row.screen.fill(self.weights.screen as f32);
        row.wx.fill(1.0);
        row.wy.fill(1.0);
        0.0
    }

    fn time(&self, pair: usize, y: usize, _errors: &Errors, mut row: Weights) -> f64 {
        let [value, slope] = self.weights.pairs[pair].map(|w| w as f32);
        row.screen.fill(value);
        row.wx.fill(slope);
        row.wy.fill(slope);
        let width = row.screen.len();
        mask(self.links[pair].as_ref(), width, y, &mut row);
        0.0
    }
}

/// Each measurement over its variance. Those of primals and of differences in space are known from their samples. Of a change there is one
/// sample, so its variance is told by how much it varies over the pixels around: that holds what really changes there, so a change is
/// believed too little rather than too much where a picture moves without its motion being followed.
pub(super) struct Inverse<'a> {
    links: &'a [Option<Links>],
    alpha: f32,
    space: Vec<Variances>,
    /// Of the change and its differences, for each pair.
    time: Vec<[Vec<f32>; 3]>,
    scale: f32,
}

impl<'a> Inverse<'a> {
    /// By the variances of a copy, which is another one than the one to be weighted.
    pub(super) fn new(copy: usize, source: &Source<'a>, alpha: f32) -> Self {
        let space: Vec<Variances> = source.moments.iter().map(|moment| Variances::new(&moment.copies()[copy].variance())).collect();
        let of_copy = Source { copy: Some(copy), ..*source };
        let time = (0..source.links.len()).map(|k| {
            let floor = 0.5 * (space[k].floor + space[k + 1].floor) / RANGE[1];
            scatter(&of_copy.time(k), source.links[k].as_ref(), floor)
        });
        let time = time.collect();
        let scale = space.iter().map(|variances| variances.scale).fold(f32::INFINITY, f32::min);
        Self { links: source.links, alpha, space, time, scale }
    }
}

impl Inverse<'_> {
    /// Variance times weight of every measurement: the weights are this over variances.
    pub(super) fn scale(&self) -> f32 {
        self.scale
    }
}

impl Rule for Inverse<'_> {
    fn space(&self, moment: usize, y: usize, _errors: &Errors, row: Weights) -> f64 {
        let variances = &self.space[moment];
        let factor = self.scale / variances.scale;
        let Weights { screen, wx, wy } = row;
        variances.weigh(y, self.alpha, Weights { screen: &mut *screen, wx: &mut *wx, wy: &mut *wy });
        screen.iter_mut().chain(wx).chain(wy).for_each(|v| *v *= factor);
        0.0
    }

    fn time(&self, pair: usize, y: usize, _errors: &Errors, mut row: Weights) -> f64 {
        let width = row.screen.len();
        let line = y * width..(y + 1) * width;
        for (out, variances) in [&mut *row.screen, &mut *row.wx, &mut *row.wy].into_iter().zip(&self.time[pair]) {
            for (out, v) in out.iter_mut().zip(&variances[line.clone()]) {
                *out = self.scale / v;
            }
        }
        mask(self.links[pair].as_ref(), width, y, &mut row);
        0.0
    }
}

/// How much a change and its differences vary over the pixels around that are linked alike, with a floor added.
fn scatter(change: &HalfMoment, links: Option<&Links>, least: f64) -> [Vec<f32>; 3] {
    let (width, height) = (change.primal.extent().width as usize, change.primal.extent().height as usize);
    let around = |image: &Image, step: usize| {
        let counts: Vec<f32> = (0..width * height)
            .map(|q| {
                let there = links.is_none_or(|links| if step == 0 { links.back(q) } else { links.back_together(q, step) }.is_some());
                if there { 1.0 } else { 0.0 }
            })
            .collect();
        let mut out = vec![0.0f32; width * height];
        let smooth = |values: &[f32]| smoothed(values, width, height, RADIUS);
        let share = smooth(&counts);
        for c in 0..3 {
            let squares: Vec<f32> = image.plane(c).iter().map(|v| v * v).collect();
            for (i, (square, mean)) in smooth(&squares).iter().zip(smooth(image.plane(c))).enumerate() {
                if share[i] > 0.0 {
                    let mean = mean / share[i];
                    out[i] += (square / share[i] - mean * mean).max(0.0);
                }
            }
        }
        let linked: Vec<f32> = out.iter().zip(&counts).filter(|(_, count)| **count > 0.0).map(|(v, _)| *v).collect();
        let floor = mean_deviation(&linked).powi(2).max(least).max(f64::from(f32::MIN_POSITIVE));
        out.iter_mut().for_each(|v| *v = (f64::from(*v) + floor).min(f64::from(f32::MAX)) as f32);
        out
    };
    [around(&change.primal, 0), around(&change.dx, 1), around(&change.dy, width)]
}
