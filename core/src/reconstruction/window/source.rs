//! Whose measurements a window is solved from: one copy's, or those of both copies together.

use super::difference::difference;
use super::links::Links;
use super::moment::{HalfMoment, MomentFilm};
use crate::film::Image;

/// The measurements of a row of moments.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) moments: &'a [&'a MomentFilm],
    /// Of each moment but the first to the one before.
    pub(super) links: &'a [Option<Links>],
    /// Which copy, or `None` for the mean of all.
    pub(super) copy: Option<usize>,
}

impl Source<'_> {
    /// Width and height [pixels].
    pub(super) fn size(&self) -> (usize, usize) {
        let extent = self.moments[0].extent();
        (extent.width as usize, extent.height as usize)
    }

    /// Primal and differences in space of a moment, means of both halves.
    pub(super) fn space(&self, moment: usize) -> HalfMoment {
        let film = self.moments[moment];
        let of = |image: fn(&HalfMoment) -> &Image| match self.copy {
            Some(copy) => film.copies()[copy].both(image),
            None => film.mean(|copy| copy.both(image)),
        };
        HalfMoment { primal: of(|half| &half.primal), dx: of(|half| &half.dx), dy: of(|half| &half.dy) }
    }

    /// How a moment differs from the one before, and how its differences in space do.
    pub(super) fn time(&self, pair: usize) -> HalfMoment {
        let (earlier, later) = (self.moments[pair], self.moments[pair + 1]);
        let of = |copy: usize| difference(&later.copies()[copy], &earlier.copies()[copy], self.links[pair].as_ref());
        match (self.copy, later.copies().len()) {
            (Some(copy), _) => of(copy),
            (None, 2) => {
                let (a, b) = (of(0), of(1));
                let both = |image: fn(&HalfMoment) -> &Image| later.joined(image(&a), image(&b));
                HalfMoment { primal: both(|half| &half.primal), dx: both(|half| &half.dx), dy: both(|half| &half.dy) }
            }
            (None, _) => of(0),
        }
    }
}
