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
    /// Samples of this half that were summed, where their number differs from pixel to pixel. One channel.
    Count(Half),
}

impl PlaneKind {
    /// Values per pixel.
    pub fn channels(self) -> usize {
        match self {
            PlaneKind::GradientSquared(..) | PlaneKind::Depth | PlaneKind::Count(_) => 1,
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
            PlaneKind::Count(h) => 10 + h.index() as u32,
            PlaneKind::Gradient(h, o) => 16 + 4 * h.index() as u32 + o.index() as u32,
            PlaneKind::GradientSquared(h, o) => 24 + 4 * h.index() as u32 + o.index() as u32,
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
        per_half.chain([PlaneKind::Albedo, PlaneKind::Normal, PlaneKind::Depth]).chain(Half::ALL.map(PlaneKind::Count))
    }

    /// The planes of a film whose pixels all have the same number of samples, in storage order, with or without gradients.
    pub fn layout(gradients: bool) -> Vec<PlaneKind> {
        let of_gradients = |kind: &PlaneKind| matches!(kind, PlaneKind::Gradient(..) | PlaneKind::GradientSquared(..));
        Self::all().filter(|kind| !matches!(kind, PlaneKind::Count(_)) && (gradients || !of_gradients(kind))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_distinct_and_invertible() {
        let mut codes: Vec<u32> = PlaneKind::all().map(PlaneKind::code).collect();
        assert_eq!(codes.len(), 27);
        for kind in PlaneKind::all() {
            assert_eq!(PlaneKind::from_code(kind.code()), Some(kind));
        }
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), 27);
    }
}
