//! The named planes that a film is made of. A technique's plan lists the planes that it measures; nothing else is kept or sent.

use crate::lattice::{Half, Offset};

/// What a plane of a [`FilmBlock`](super::FilmBlock) holds. All values are *sums over samples* of per-sample estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PlaneKind {
    /// Radiance without directly visible emission. RGB.
    Primal(Half),
    /// Squares of the per-sample primal. RGB.
    PrimalSquared(Half),
    /// Emission and environment seen directly by the camera (through no vertex); it has no gradient and is added after reconstruction. RGB.
    Direct(Half),
    /// Contribution of the base paths of this pixel to the difference across the given step, oriented along the axis: for a
    /// forward step to I(next) − I(this), for a backward step to I(this) − I(previous). RGB.
    Gradient(Half, Offset),
    /// Sum over RGB of the squares of the per-sample gradient. One channel.
    GradientSquared(Half, Offset),
    /// Albedo of the first surface. RGB.
    Albedo,
    /// Shading normal of the first surface, world space. XYZ.
    Normal,
    /// Distance along the ray to the first surface; rays that escape add zero. One channel.
    Depth,
    /// Where the pixel's surface was in the moment before: displacement (columns, rows) [pixels] to the pixel that saw it there, and 1 where
    /// there is one; the same for every sample. Three channels.
    Motion,
    /// Samples of this half that were summed, where their number differs from pixel to pixel. One channel.
    Count(Half),
    /// Displacement of the pixel's link in this slot (columns, rows) [pixels], the same for every sample; (0, 0) where the slot is empty. Two
    /// channels.
    Link(u8),
    /// Contribution of the base paths of this pixel to I(linked) − I(this), along the link in this slot. RGB.
    LinkGradient(Half, u8),
    /// Sum over RGB of the squares of the per-sample difference along the link in this slot. One channel.
    LinkGradientSquared(Half, u8),
}

impl PlaneKind {
    /// Slots for links that a pixel has at most.
    pub const SLOTS: u8 = 16;

    /// Values per pixel.
    pub fn channels(self) -> usize {
        match self {
            PlaneKind::GradientSquared(..) | PlaneKind::LinkGradientSquared(..) | PlaneKind::Depth | PlaneKind::Count(_) => 1,
            PlaneKind::Link(_) => 2,
            _ => 3,
        }
    }

    /// A stable number for the wire and for files: never reuse one.
    pub fn code(self) -> u32 {
        match self {
            PlaneKind::Primal(h) => h.index() as u32,
            PlaneKind::PrimalSquared(h) => 2 + h.index() as u32,
            PlaneKind::Direct(h) => 4 + h.index() as u32,
            PlaneKind::Albedo => 6,
            PlaneKind::Normal => 7,
            PlaneKind::Depth => 8,
            PlaneKind::Motion => 9,
            PlaneKind::Count(h) => 10 + h.index() as u32,
            PlaneKind::Gradient(h, o) => 16 + 4 * h.index() as u32 + o.index() as u32,
            PlaneKind::GradientSquared(h, o) => 24 + 4 * h.index() as u32 + o.index() as u32,
            PlaneKind::Link(slot) => 256 + u32::from(slot),
            PlaneKind::LinkGradient(h, slot) => 320 + 64 * h.index() as u32 + u32::from(slot),
            PlaneKind::LinkGradientSquared(h, slot) => 448 + 64 * h.index() as u32 + u32::from(slot),
        }
    }

    /// The inverse of [`code`](Self::code).
    pub fn from_code(code: u32) -> Option<PlaneKind> {
        Self::all().find(|kind| kind.code() == code)
    }

    /// Every plane there is.
    pub fn all() -> impl Iterator<Item = PlaneKind> {
        let per_half = Half::ALL.into_iter().flat_map(|h| {
            let gradients = Offset::IMAGE.into_iter().flat_map(move |o| [PlaneKind::Gradient(h, o), PlaneKind::GradientSquared(h, o)]);
            [PlaneKind::Primal(h), PlaneKind::PrimalSquared(h), PlaneKind::Direct(h)].into_iter().chain(gradients)
        });
        let features = [PlaneKind::Albedo, PlaneKind::Normal, PlaneKind::Depth];
        per_half.chain(features).chain([PlaneKind::Motion]).chain(Half::ALL.map(PlaneKind::Count)).chain(Self::links(Self::SLOTS))
    }

    /// The planes of the first slots for links.
    pub fn links(slots: u8) -> impl Iterator<Item = PlaneKind> {
        let pair = |half, slot| [PlaneKind::LinkGradient(half, slot), PlaneKind::LinkGradientSquared(half, slot)];
        let of_half = move |half| (0..slots).flat_map(move |slot| pair(half, slot));
        (0..slots).map(PlaneKind::Link).chain(Half::ALL.into_iter().flat_map(of_half))
    }

    /// The planes of a film whose pixels all have the same number of samples, in storage order, with or without gradients.
    pub fn layout(gradients: bool) -> Vec<PlaneKind> {
        let listed = |kind: &PlaneKind| match kind {
            PlaneKind::Gradient(..) | PlaneKind::GradientSquared(..) => gradients,
            PlaneKind::Motion
            | PlaneKind::Count(_)
            | PlaneKind::Link(_)
            | PlaneKind::LinkGradient(..)
            | PlaneKind::LinkGradientSquared(..) => false,
            _ => true,
        };
        Self::all().filter(listed).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_distinct_and_invertible() {
        let mut codes: Vec<u32> = PlaneKind::all().map(PlaneKind::code).collect();
        assert_eq!(codes.len(), 108);
        for kind in PlaneKind::all() {
            assert_eq!(PlaneKind::from_code(kind.code()), Some(kind));
        }
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), 108);
    }
}
