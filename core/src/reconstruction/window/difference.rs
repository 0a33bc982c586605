//! How a moment differs from the one before, and how its spatial differences do: measured with the same random numbers.

use super::links::Links;
use super::moment::{CopyFilm, HalfMoment};
use crate::film::Image;
use rayon::prelude::*;

/// A_{t+1}(q) − B_t(p) for each pixel q and its partner p in the moment before; differences of dx and dy alike, where both pixels of the pair
/// moved together. Zero where there is no such partner. Laid out as what a half measures, of the change in place of the image.
pub(super) fn difference(later: &CopyFilm, earlier: &CopyFilm, links: Option<&Links>) -> HalfMoment {
    let (a, b) = (&later.halves[0], &earlier.halves[1]);
    let width = a.primal.extent().width as usize;
    let of = |a: &Image, b: &Image, partner: &(dyn Fn(&Links, usize) -> Option<usize> + Sync)| {
        let mut out = a.clone();
        for c in 0..3 {
            let before = b.plane(c);
            out.plane_mut(c).par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
                for (x, value) in row.iter_mut().enumerate() {
                    let q = y * width + x;
                    *value = match links {
                        None => *value - before[q],
                        Some(links) => partner(links, q).map_or(0.0, |p| *value - before[p]),
                    };
                }
            });
        }
        out
    };
    HalfMoment {
        primal: of(&a.primal, &b.primal, &|links, q| links.back(q)),
        dx: of(&a.dx, &b.dx, &|links, q| links.back_together(q, 1)),
        dy: of(&a.dy, &b.dy, &|links, q| links.back_together(q, width)),
    }
}
