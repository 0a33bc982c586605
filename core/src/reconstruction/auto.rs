//! The reconstruction of a frame chosen when its film is there: by the error that the halves tell of each that the film allows.
//!
//! The errors include bias, so a biased reconstruction is chosen only where it is nearer to the truth all the same. Estimates are noisy
//! themselves, so one that is unbiased is preferred to one that is not where it promises nearly as much. Those that fit windows or call a
//! denoiser are left out: they take several times as long as all that are tried here together, which more samples may be the better use of.

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

fn relmse(done: &Reconstructed) -> Option<f64> {
    done.error.as_ref().map(|error| error.relmse).filter(|error| error.is_finite())
}

fn handicap(kind: ReconstructionKind) -> f64 {
    if kind.is_unbiased() { 1.0 } else { 1.0 / MARGIN }
}

/// Which was chosen, and what all promised.
fn reason(chosen: ReconstructionKind, told: &[(ReconstructionKind, f64)]) -> String {
    let list = |kinds: &mut dyn Iterator<Item = &(ReconstructionKind, f64)>| {
        kinds.map(|(kind, error)| format!("{} {error:.2e}", kind.name())).collect::<Vec<_>>().join(", ")
    };
    let best = list(&mut told.iter().filter(|(kind, _)| *kind == chosen));
    let others = list(&mut told.iter().filter(|(kind, _)| *kind != chosen));
    let against = if others.is_empty() { ", and nothing else is possible".to_owned() } else { format!(" against {others}") };
    format!("estimated relMSE by the halves: {best}{against}")
}
