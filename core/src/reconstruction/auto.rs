//! The reconstruction of a frame chosen when its film is there: by the error that the halves tell of each that the film allows.
//!
//! The errors include bias, so a biased reconstruction is chosen only where it is nearer to the truth all the same. Estimates are noisy
//! themselves, so one that is unbiased is preferred to one that is not where it promises nearly as much. What goes further than `nfor` is
//! left out: `regularised` promises much the same for a third more time, and the bits of `oidn` depend on the machine.
//!
//! On a large film the candidates are tried on pieces that are spread over it, a tenth of it in all, so that the choice costs less than the
//! image. What they promise there is their share of the whole frame's error as well as anything can tell it.

use rayon::prelude::*;

use super::{Film, ReconstructError, Reconstructed, ReconstructionKind, reconstruct};
use crate::lattice::{Extent, Tile};

/// How much less error than an unbiased reconstruction a biased one must promise.
const MARGIN: f64 = 0.9;

/// What is tried for a film, the one that suits most films first.
fn candidates(film: &Film) -> &'static [ReconstructionKind] {
    let half = &film.halves[0];
    if half.gradients.is_some() {
        &[
            ReconstructionKind::L2,
            ReconstructionKind::WeightedL2,
            ReconstructionKind::WeightedCv,
            ReconstructionKind::L1,
            ReconstructionKind::Nfor,
            ReconstructionKind::None,
        ]
    } else if half.graph.is_some() {
        &[ReconstructionKind::Graph, ReconstructionKind::None]
    } else {
        &[ReconstructionKind::None]
    }
}

/// Tries all, on the film or on pieces of a large one, and keeps the best. Where there is no estimate to choose by it is the first.
///
/// # Errors
/// As [`reconstruct`] of the one that is taken.
pub(super) fn choose(film: &Film, alpha: Option<f32>) -> Result<Reconstructed, ReconstructError> {
    let pieces = if film.halves[0].gradients.is_some() { pieces(film.extent) } else { Vec::new() };
    if pieces.is_empty() { by_the_whole(film, alpha) } else { by_pieces(film, alpha, &pieces) }
}

/// Solves for the whole image in every way.
fn by_the_whole(film: &Film, alpha: Option<f32>) -> Result<Reconstructed, ReconstructError> {
    let candidates = candidates(film);
    let mut best = reconstruct(film, candidates[0], alpha)?;
    let Some(mut least) = relmse(&best) else {
        best.why = Some(format!("{}: there are no two halves to choose by", best.kind.name()));
        return Ok(best);
    };
    let mut told = vec![(best.kind, least)];
    for kind in &candidates[1..] {
        // One that fails on this film is no choice.
        let Ok(done) = reconstruct(film, *kind, alpha) else { continue };
        let Some(error) = relmse(&done) else { continue };
        told.push((*kind, error));
        if error * handicap(*kind) < least * handicap(best.kind) {
            (best, least) = (done, error);
        }
    }
    best.why = Some(reason(best.kind, &told, ""));
    Ok(best)
}

/// Solves for pieces in every way, and for the whole image in the best one.
fn by_pieces(film: &Film, alpha: Option<f32>, pieces: &[Tile]) -> Result<Reconstructed, ReconstructError> {
    let told = promises(film, alpha, pieces);
    let weighed = |(kind, error): &(ReconstructionKind, f64)| error * handicap(*kind);
    // The first of several that promise the same.
    let best = told.iter().reduce(|best, next| if weighed(next) < weighed(best) { next } else { best });
    let mut done = match best {
        Some((kind, _)) => reconstruct(film, *kind, alpha)?,
        None => reconstruct(film, candidates(film)[0], alpha)?,
    };
    let share = pieces.iter().map(|piece| piece.pixels()).sum::<usize>() as f64 / film.extent.pixels() as f64;
    done.why = Some(if told.is_empty() {
        format!("{}: there are no two halves to choose by", done.kind.name())
    } else {
        reason(done.kind, &told, &format!(" on {} pieces, {:.0} % of the frame", pieces.len(), 100.0 * share))
    });
    Ok(done)
}

/// What each candidate promises on pieces: estimated relMSE, of those that can be had on all of them.
fn promises(film: &Film, alpha: Option<f32>, pieces: &[Tile]) -> Vec<(ReconstructionKind, f64)> {
    let candidates = candidates(film);
    // For each piece one after the other what all candidates promise, so that a piece is cut once; the sum runs in the order of the pieces.
    let of_piece = |piece: &Tile| {
        let film = film.cut(*piece);
        let inside = inside(film.extent);
        let error = |done: Reconstructed| done.error.map(|error| error.of_tile(inside)).filter(|error| error.is_finite());
        candidates.iter().map(|kind| error(reconstruct(&film, *kind, alpha).ok()?)).collect::<Vec<_>>()
    };
    let all: Vec<Vec<Option<f64>>> = pieces.par_iter().map(of_piece).collect();
    let pixels: f64 = pieces.iter().map(|piece| piece.pixels() as f64).sum();
    let mean = |k: usize| {
        let errors = all.iter().zip(pieces).map(|(errors, piece)| Some(errors[k]? * piece.pixels() as f64));
        errors.sum::<Option<f64>>().map(|sum| sum / pixels)
    };
    candidates.iter().enumerate().filter_map(|(k, kind)| Some((*kind, mean(k)?))).collect()
}

/// Pixels from which on a choice is made by pieces.
const LARGE: usize = 250_000;
/// Edge of a piece [pixels].
const EDGE: u32 = 128;
/// What does not count along the borders of a piece, because reconstructions look as far as that [pixels].
const BORDER: u32 = 16;
/// One in so many pixels lies in a piece.
const SHARE: usize = 10;
/// Fewest and most pieces.
const PIECES: [usize; 2] = [12, 64];

/// Pieces of a large film, spread evenly over it: one in the middle of each cell of a grid. None for a film that is not large.
fn pieces(extent: Extent) -> Vec<Tile> {
    if extent.pixels() <= LARGE {
        return Vec::new();
    }
    let count = (extent.pixels() / SHARE / (EDGE * EDGE) as usize).clamp(PIECES[0], PIECES[1]);
    spread(extent, count, EDGE)
}

/// The part of a piece that counts.
fn inside(extent: Extent) -> Tile {
    let [dx, dy] = [extent.width, extent.height].map(|side| BORDER.min(side / 4));
    Tile { x: dx, y: dy, width: extent.width - 2 * dx, height: extent.height - 2 * dy }
}

/// About so many pieces.
fn spread(extent: Extent, count: usize, edge: u32) -> Vec<Tile> {
    let (width, height) = (f64::from(extent.width), f64::from(extent.height));
    // As many cells along a side as pieces fit there, and no more than there are to be.
    let along = |side: f64, other: f64| {
        let most = (side / f64::from(edge)).clamp(1.0, count as f64);
        libm::round((count as f64 * side / other).sqrt()).clamp(1.0, most) as u32
    };
    let (columns, rows) = (along(width, height), along(height, width));
    let middle = |k: u32, cells: u32, side: u32| {
        let edge = edge.min(side);
        let centre = (u64::from(side) * u64::from(2 * k + 1) / u64::from(2 * cells)) as u32;
        (centre.saturating_sub(edge / 2).min(side - edge), edge)
    };
    let cell = |row: u32, column: u32| {
        let ((x, width), (y, height)) = (middle(column, columns, extent.width), middle(row, rows, extent.height));
        Tile { x, y, width, height }
    };
    (0..rows).flat_map(|row| (0..columns).map(move |column| cell(row, column))).collect()
}

/// The estimate to choose by.
fn relmse(done: &Reconstructed) -> Option<f64> {
    done.error.as_ref().map(|error| error.relmse).filter(|error| error.is_finite())
}

fn handicap(kind: ReconstructionKind) -> f64 {
    if kind.is_unbiased() { 1.0 } else { 1.0 / MARGIN }
}

/// Which was chosen, and what all promised, `there`.
fn reason(chosen: ReconstructionKind, told: &[(ReconstructionKind, f64)], there: &str) -> String {
    let own = told.iter().find(|(kind, _)| *kind == chosen).map_or(f64::NAN, |(_, error)| *error);
    let others: Vec<String> =
        told.iter().filter(|(kind, _)| *kind != chosen).map(|(kind, error)| format!("{} {error:.2e}", kind.name())).collect();
    let against = if others.is_empty() { "nothing else is possible".to_owned() } else { format!("against {}", others.join(", ")) };
    format!("{}: estimated relMSE {own:.2e} by the halves{there}, {against}", chosen.name())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Image;
    use crate::lattice::Extent;

    #[test]
    fn the_least_error_wins_and_the_others_are_named() {
        let film = crate::reconstruction::tests::film([3, 2], true);
        let done = reconstruct(&film, ReconstructionKind::Auto, Some(0.2)).unwrap();
        let best = reconstruct(&film, done.kind, Some(0.2)).unwrap();
        assert_eq!((&done.image, done.error.as_ref()), (&best.image, best.error.as_ref()));
        let why = done.why.unwrap();
        assert!(why.starts_with(done.kind.name()) && candidates(&film).iter().all(|kind| why.contains(kind.name())), "{why}");
        for kind in candidates(&film) {
            let other = relmse(&reconstruct(&film, *kind, Some(0.2)).unwrap()).unwrap();
            assert!(relmse(&best).unwrap() * handicap(best.kind) <= other * handicap(*kind), "{}", kind.name());
        }
    }

    #[test]
    fn where_nothing_can_be_told_apart_the_first_stands() {
        let single = reconstruct(&crate::reconstruction::tests::film([1, 0], true), ReconstructionKind::Auto, Some(0.2)).unwrap();
        assert_eq!(single.kind, ReconstructionKind::L2);
        assert!(single.why.unwrap().contains("no two halves"));
        let paths = reconstruct(&crate::reconstruction::tests::film([2, 2], false), ReconstructionKind::Auto, Some(0.2)).unwrap();
        assert_eq!(paths.kind, ReconstructionKind::None);
        assert!(paths.why.unwrap().contains("nothing else is possible"));
    }

    #[test]
    fn pieces_lie_apart_on_large_films_alone() {
        for (width, height) in [(500, 500), (16, 15_625), (1, 1)] {
            assert!(pieces(Extent { width, height }).is_empty());
        }
        for (width, height) in [(640, 480), (1920, 1080), (3840, 2160), (300_000, 1), (50, 20_000), (4096, 64)] {
            let extent = Extent { width, height };
            let pieces = pieces(extent);
            assert!(pieces.iter().all(|piece| piece.lies_on(extent)), "{width}×{height}");
            assert!((6..=80).contains(&pieces.len()), "{width}×{height}: {} pieces", pieces.len());
            for (k, a) in pieces.iter().enumerate() {
                let apart = |b: &Tile| a.x + a.width <= b.x || b.x + b.width <= a.x || a.y + a.height <= b.y || b.y + b.height <= a.y;
                assert!(pieces[..k].iter().all(apart), "{width}×{height}: {a:?}");
            }
        }
        assert_eq!(pieces(Extent { width: 1920, height: 1080 }).len(), 15);
        assert_eq!(inside(Extent { width: 128, height: 8 }), Tile { x: 16, y: 2, width: 96, height: 4 });
    }

    /// Pieces promise what the whole promises, so the choice is as good.
    #[test]
    fn what_pieces_promise_holds_for_the_whole() {
        use crate::reconstruction::tests::{convergence::frame, picture};
        let extent = Extent { width: 240, height: 160 };
        let film = frame(&picture(extent), 0);
        let pieces = spread(extent, 6, 64);
        assert_eq!(pieces.len(), 6);
        let told = promises(&film, None, &pieces);
        let whole = |kind| relmse(&reconstruct(&film, kind, None).unwrap()).unwrap();
        assert_eq!(told.len(), candidates(&film).len());
        for (kind, promised) in &told {
            let found = whole(*kind);
            assert!((0.5..2.0).contains(&(promised / found)), "{}: {promised} of {found}", kind.name());
        }
        let done = by_pieces(&film, None, &pieces).unwrap();
        let best = by_the_whole(&film, None).unwrap();
        assert!(relmse(&done).unwrap() * handicap(done.kind) <= 1.1 * relmse(&best).unwrap() * handicap(best.kind), "{:?}", done.why);
        assert_eq!(done.image, reconstruct(&film, done.kind, None).unwrap().image);
        assert!(done.why.unwrap().contains("on 6 pieces, 64 % of the frame"));
        // A film without two halves has nothing to promise.
        let mut single = film.clone();
        single.halves[1].samples = 0;
        let done = by_pieces(&single, None, &pieces).unwrap();
        assert_eq!((done.kind, done.why.unwrap().contains("no two halves")), (ReconstructionKind::L2, true));
    }

    #[test]
    fn a_biased_one_must_be_clearly_better() {
        let extent = Extent { width: 24, height: 16 };
        let mut flat = Image::new(extent, 3);
        flat.data_mut().fill(1.0);
        let mut film = crate::reconstruction::tests::film([4, 4], true);
        film.extent = extent;
        let none = Image::new(extent, 1);
        let black = Image::new(extent, 3);
        film.features = crate::film::Features { albedo: black.clone(), normal: black.clone(), depth: none.clone() };
        for half in &mut film.halves {
            (half.primal, half.primal_variance, half.direct) = (flat.clone(), black.clone(), black.clone());
            let g = half.gradients.as_mut().unwrap();
            (g.dx, g.dy, g.dx_variance, g.dy_variance) = (black.clone(), black.clone(), none.clone(), none.clone());
        }
        // All are exact: the unbiased one that suits most films is taken.
        assert_eq!(reconstruct(&film, ReconstructionKind::Auto, Some(0.2)).unwrap().kind, ReconstructionKind::L2);
    }
}
