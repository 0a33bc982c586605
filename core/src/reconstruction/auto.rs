//! The reconstruction of a frame chosen when its film is there: by the error that the halves tell of each that the film allows.
//!
//! The errors include bias, so a biased reconstruction is chosen only where it is nearer to the truth all the same. Estimates are noisy
//! themselves, so one that is unbiased is preferred to one that is not where it promises nearly as much. What goes further than `nfor` is
//! left out: `regularised` promises much the same for a third more time, and the bits of `oidn` depend on the machine.

use super::{Film, ReconstructError, Reconstructed, ReconstructionKind, reconstruct};

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

/// Tries all and keeps the best. Where there is no estimate to choose by it is the first.
///
/// # Errors
/// As [`reconstruct`] of the first.
pub(super) fn choose(film: &Film, alpha: Option<f32>) -> Result<Reconstructed, ReconstructError> {
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
    best.why = Some(reason(best.kind, &told));
    Ok(best)
}

/// The estimate to choose by.
fn relmse(done: &Reconstructed) -> Option<f64> {
    done.error.as_ref().map(|error| error.relmse).filter(|error| error.is_finite())
}

fn handicap(kind: ReconstructionKind) -> f64 {
    if kind.is_unbiased() { 1.0 } else { 1.0 / MARGIN }
}

/// Which was chosen, and what all promised.
fn reason(chosen: ReconstructionKind, told: &[(ReconstructionKind, f64)]) -> String {
    let own = told.iter().find(|(kind, _)| *kind == chosen).map_or(f64::NAN, |(_, error)| *error);
    let others: Vec<String> =
        told.iter().filter(|(kind, _)| *kind != chosen).map(|(kind, error)| format!("{} {error:.2e}", kind.name())).collect();
    let against = if others.is_empty() { "nothing else is possible".to_owned() } else { format!("against {}", others.join(", ")) };
    format!("{}: estimated relMSE {own:.2e} by the halves, {against}", chosen.name())
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
