//! Differences along the links between similar pixels: what linked pixels measured from either end, joined into one for each link.

use super::fold::{FrameFold, variance_of_mean};
use super::image::Image;
use super::plane::PlaneKind;
use crate::lattice::{Extent, Half};
use std::sync::Arc;

/// A pixel's links as the planes tell them: for each slot the index of the pixel at the other end.
type Slots = Vec<Option<u32>>;

/// The links of a film with what one half measured along them.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    /// The linked pixels (i, j) as row-major indices, i < j, each pair once: by i, then in the order of its slots.
    pub links: Arc<Vec<[u32; 2]>>,
    /// I(j) − I(i) of each link, RGB.
    pub differences: Vec<[f32; 3]>,
    /// Variance of each difference, summed over RGB.
    pub variances: Vec<f32>,
}

/// Why the links of a film are refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// The planes do not name a pixel of the film.
    #[error("slot {slot} of pixel {pixel} names no pixel of the film, or one that another slot names")]
    Target {
        /// The pixel that has the slot.
        pixel: u32,
        /// Which slot.
        slot: u8,
    },
    /// A link that only one of its ends knows.
    #[error("pixel {from} is linked to pixel {to}, which is not linked back")]
    OneSided {
        /// The end that names the other.
        from: u32,
        /// The end that does not.
        to: u32,
    },
}

impl Graph {
    /// Joins the planes of both halves, given the samples of each pixel in either; `None` for both where the film has no links.
    pub(super) fn join(fold: &FrameFold, counts: [&Image; 2]) -> Result<[Option<Graph>; 2], LinkError> {
        let displacements: Vec<&Image> = (0..PlaneKind::SLOTS).map_while(|slot| fold.mean(PlaneKind::Link(slot))).collect();
        if displacements.is_empty() {
            return Ok([None, None]);
        }
        let slots = slots(fold.extent(), &displacements)?;
        let degree = displacements.len();
        let (mut links, mut ends) = (Vec::new(), Vec::new());
        for (k, to) in slots.iter().enumerate() {
            let (from, slot) = (k / degree, k % degree);
            let Some(to) = *to else { continue };
            let back = slots[to as usize * degree..][..degree].iter().position(|back| *back == Some(from as u32));
            let back = back.ok_or(LinkError::OneSided { from: from as u32, to })?;
            if (from as u32) < to {
                links.push([from as u32, to]);
                ends.push([slot as u8, back as u8]);
            }
        }
        let links = Arc::new(links);
        Ok([Half::A, Half::B].map(|half| Some(Graph::of_half(fold, half, counts[half.index()], &links, &ends))))
    }

    fn of_half(fold: &FrameFold, half: Half, counts: &Image, links: &Arc<Vec<[u32; 2]>>, ends: &[[u8; 2]]) -> Graph {
        let planes = |kind: fn(Half, u8) -> PlaneKind| -> Vec<Option<&Image>> {
            (0..PlaneKind::SLOTS).map(|slot| fold.mean(kind(half, slot))).collect()
        };
        let (means, squares) = (planes(PlaneKind::LinkGradient), planes(PlaneKind::LinkGradientSquared));
        let at = |planes: &[Option<&Image>], slot: u8, pixel: u32, channel: usize| {
            planes.get(usize::from(slot)).copied().flatten().map_or(0.0, |image| f64::from(image.plane(channel)[pixel as usize]))
        };
        let (mut differences, mut variances) = (Vec::with_capacity(links.len()), Vec::with_capacity(links.len()));
        for (pixels, slots) in links.iter().zip(ends) {
            let mut variance = 0.0;
            // What either end measured, seen from itself.
            let [there, back] = std::array::from_fn(|end| {
                let (pixel, slot) = (pixels[end], slots[end]);
                let mean: [f64; 3] = std::array::from_fn(|c| at(&means, slot, pixel, c));
                let squared = mean.iter().map(|m| m * m).sum();
                variance += variance_of_mean(squared, at(&squares, slot, pixel, 0), counts.plane(0)[pixel as usize]);
                mean
            });
            differences.push(std::array::from_fn(|c| (there[c] - back[c]) as f32));
            variances.push(variance);
        }
        Graph { links: Arc::clone(links), differences, variances }
    }

    /// `wx` times this and `wy` times the other half of the same film; variances by the squares.
    pub(super) fn blend(&self, other: &Graph, wx: f64, wy: f64) -> Graph {
        let mix = |x: f32, y: f32, wx: f64, wy: f64| (wx * f64::from(x) + wy * f64::from(y)) as f32;
        let pairs = self.differences.iter().zip(&other.differences);
        let variances = self.variances.iter().zip(&other.variances);
        Graph {
            links: Arc::clone(&self.links),
            differences: pairs.map(|(x, y)| std::array::from_fn(|c| mix(x[c], y[c], wx, wy))).collect(),
            variances: variances.map(|(x, y)| mix(*x, *y, wx * wx, wy * wy)).collect(),
        }
    }
}

/// The links of every pixel, slot by slot.
fn slots(extent: Extent, displacements: &[&Image]) -> Result<Slots, LinkError> {
    let degree = displacements.len();
    let mut slots = Vec::with_capacity(extent.pixels() * degree);
    for y in 0..extent.height {
        for x in 0..extent.width {
            let pixel = extent.index(x, y) as u32;
            let first = slots.len();
            for (slot, image) in displacements.iter().enumerate() {
                let wrong = LinkError::Target { pixel, slot: slot as u8 };
                let (dx, dy) = (image.at(x, y, 0), image.at(x, y, 1));
                if dx == 0.0 && dy == 0.0 {
                    slots.push(None);
                    continue;
                }
                let (tx, ty) = (i64::from(x) + dx as i64, i64::from(y) + dy as i64);
                // Each sample adds the same displacement, so the mean of a sound film is a whole number.
                if dx != dx.trunc() || dy != dy.trunc() || !extent.contains(tx, ty) {
                    return Err(wrong);
                }
                let to = Some(extent.index(tx as u32, ty as u32) as u32);
                if slots[first..].contains(&to) {
                    return Err(wrong);
                }
                slots.push(to);
            }
        }
    }
    Ok(slots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmBlock, FoldError, Statistics, TileFold};
    use crate::lattice::SampleRange;

    /// A film of three pixels and two samples: links by pixel and slot, and pixel k measures 10 k + slot + 1 along each.
    fn film(links: [[[f32; 2]; 2]; 3]) -> Result<[Option<Graph>; 2], FoldError> {
        let extent = Extent { width: 3, height: 1 };
        let mut layout = PlaneKind::layout(false);
        layout.extend(PlaneKind::links(2));
        let value = |kind, channel: usize, pixel: usize| match kind {
            PlaneKind::Link(slot) => 2.0 * links[pixel][usize::from(slot)][channel],
            PlaneKind::LinkGradient(_, slot) => (10 * pixel) as f32 + f32::from(slot) + 1.0,
            PlaneKind::LinkGradientSquared(..) => 1e4,
            _ => 0.0,
        };
        let plane = |kind: &PlaneKind| {
            let values = (0..kind.channels()).flat_map(|channel| (0..3).map(move |pixel| value(*kind, channel, pixel))).collect();
            (*kind, values)
        };
        let [tile] = extent.tiles(8)[..] else { unreachable!() };
        let samples = SampleRange { first: 0, count: 2 };
        let block = FilmBlock { tile, samples, planes: layout.iter().map(plane).collect(), statistics: Statistics::default() };
        let mut fold = TileFold::new(tile, &layout);
        fold.add(&block)?;
        let mut frame = FrameFold::new(extent, &layout);
        frame.place(&fold)?;
        Ok(frame.finish()?.halves.map(|half| half.graph))
    }

    const NONE: [f32; 2] = [0.0; 2];

    #[test]
    fn links_join_what_their_ends_measured() {
        let [graph, _] = film([[[2.0, 0.0], [1.0, 0.0]], [NONE, [-1.0, 0.0]], [[-2.0, 0.0], NONE]]).unwrap();
        let graph = graph.unwrap();
        assert_eq!(*graph.links, [[0, 2], [0, 1]]);
        assert_eq!(graph.differences, [[1.0 - 21.0; 3], [2.0 - 12.0; 3]]);
        assert_eq!(graph.blend(&graph, 0.5, 0.25).differences[1], [-7.5; 3]);
    }

    #[test]
    fn links_that_do_not_fit_are_refused() {
        let refused = |links| film(links).unwrap_err().to_string();
        assert!(refused([[[1.0, 0.0], NONE], [NONE; 2], [NONE; 2]]).contains("pixel 0 is linked to pixel 1, which is not linked back"));
        for target in [[-1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [3.0, 0.0]] {
            let message = refused([[NONE, target], [NONE; 2], [NONE; 2]]);
            assert!(message.contains("slot 1 of pixel 0"), "{target:?}: {message}");
        }
        let twice = [[1.0, 0.0]; 2];
        assert!(refused([twice, [[-1.0, 0.0], NONE], [NONE; 2]]).contains("slot 1 of pixel 0"));
        assert!(film([[NONE; 2]; 3]).unwrap().iter().all(|graph| graph.as_ref().unwrap().links.is_empty()));
    }
}
