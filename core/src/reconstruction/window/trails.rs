//! Where the pixels of the middle moment of a window lie in all others, along the links.

use super::super::field::Field;
use super::super::stencil::Stencil;
use super::links::Links;
use rayon::prelude::*;

/// No such pixel.
const NONE: u32 = u32::MAX;

/// One trail for each pixel of the middle moment, as far as its links lead.
pub(super) struct Trails {
    /// For each moment and pixel of the middle one: where it lies there. `None` where all lie in their own place.
    from_middle: Vec<Option<Vec<u32>>>,
    /// For each moment and pixel: where it lies in the middle one.
    to_middle: Vec<Option<Vec<u32>>>,
}

impl Trails {
    /// Through the links of each moment but the first to the one before.
    pub(super) fn new(pixels: usize, links: &[Option<Links>]) -> Self {
        let middle = links.len().div_ceil(2);
        let mut from_middle: Vec<Option<Vec<u32>>> = vec![None; links.len() + 1];
        for t in middle + 1..=links.len() {
            from_middle[t] = follow(from_middle[t - 1].as_deref(), pixels, links[t - 1].as_ref(), Links::ahead);
        }
        for t in (0..middle).rev() {
            from_middle[t] = follow(from_middle[t + 1].as_deref(), pixels, links[t].as_ref(), Links::back);
        }
        let inverse = |places: &Vec<u32>| {
            let mut inverse = vec![NONE; pixels];
            for (m, i) in places.iter().enumerate().filter(|(_, i)| **i != NONE) {
                inverse[*i as usize] = m as u32;
            }
            inverse
        };
        let to_middle = from_middle.iter().map(|places| places.as_ref().map(inverse)).collect();
        Self { from_middle, to_middle }
    }

    /// Sums each trail.
    pub(super) fn sum(&self, moments: &[Field], out: &mut Field) {
        let width = out.width;
        out.each_line(
            || (),
            |(), y, line| {
                line.fill(0.0);
                for (field, places) in moments.iter().zip(&self.from_middle) {
                    gather(field, places.as_deref(), width, y, line);
                }
            },
        );
    }

    /// Adds to each pixel what stands at the middle of its trail.
    pub(super) fn add(&self, middle: &Field, moments: &mut [Field]) {
        let width = middle.width;
        for (field, places) in moments.iter_mut().zip(&self.to_middle) {
            field.each_line(|| (), |(), y, line| gather(middle, places.as_deref(), width, y, line));
        }
    }

    /// Adds the stencil of a moment, trail by trail. An edge that leads away from the trail beside it holds its pixel.
    pub(super) fn add_stencil(&self, moment: usize, stencil: &Stencil, out: &mut Stencil) {
        let (width, pixels) = (out.width, out.width * out.height);
        let places = self.from_middle[moment].as_deref();
        let at = |m: usize| places.map_or(Some(m), |places| (places[m] != NONE).then_some(places[m] as usize));
        let rows = out.screen.par_chunks_mut(width).zip(out.wx.par_chunks_mut(width)).zip(out.wy[..pixels].par_chunks_mut(width));
        rows.enumerate().for_each(|(y, ((screen, wx), wy))| {
            for x in 0..width {
                let m = y * width + x;
                let Some(i) = at(m) else { continue };
                let (right, left) = (stencil.wx[i], if i > 0 { stencil.wx[i - 1] } else { 0.0 });
                let (above, below) = (stencil.wy[i], stencil.wy[i + width]);
                let beside = |there: bool, m: usize, i: usize| there && at(m) == Some(i);
                screen[x] += stencil.screen[i];
                // An edge counts for the pixel to its left or below it, and where it leads away for both.
                if beside(x + 1 < width, m + 1, i + 1) {
                    wx[x] += right
                } else {
                    screen[x] += right
                }
                if !beside(x > 0, m.wrapping_sub(1), i.wrapping_sub(1)) {
                    screen[x] += left;
                }
                if beside(y > 0, m.wrapping_sub(width), i.wrapping_sub(width)) {
                    wy[x] += above
                } else {
                    screen[x] += above
                }
                if !beside(m + width < pixels, m + width, i + width) {
                    screen[x] += below;
                }
            }
        });
    }
}

/// One link further.
fn follow(places: Option<&[u32]>, pixels: usize, links: Option<&Links>, next: impl Fn(&Links, usize) -> Option<usize>) -> Option<Vec<u32>> {
    let Some(links) = links else { return places.map(<[u32]>::to_vec) };
    let step = |i: u32| if i == NONE { NONE } else { next(links, i as usize).map_or(NONE, |i| i as u32) };
    Some((0..pixels).map(|m| step(places.map_or(m as u32, |places| places[m]))).collect())
}

/// Adds to one row, channel by channel, what stands where its pixels lie.
fn gather(field: &Field, places: Option<&[u32]>, width: usize, y: usize, line: &mut [f32]) {
    match places {
        None => {
            for (c, out) in line.chunks_mut(width.max(1)).enumerate() {
                out.iter_mut().zip(field.row(y, c)).for_each(|(out, v)| *out += v);
            }
        }
        Some(places) => {
            for (x, place) in places[y * width..(y + 1) * width].iter().enumerate().filter(|(_, place)| **place != NONE) {
                let (row, column) = (*place as usize / width, *place as usize % width);
                (0..3).for_each(|c| line[c * width + x] += field.row(row, c)[column]);
            }
        }
    }
}
