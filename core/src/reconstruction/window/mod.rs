//! Reconstruction of several moments of an animation together: a screened Poisson problem in space and time.
//!
//! Half B of a moment and half A of the next one are drawn with the same random numbers, so dt(q) = A_{t+1}(q) − B_t(p) tells with little noise
//! how the image changes from a pixel p to its partner q in the next moment; differences of spatial differences alike. The images I_t of a
//! window of moments minimise
//!
//! Σ_t α²|I_t − P_t|² + |∇I_t − G_t|² + Σ_t w_t²|D_t I − dt|² + w_m²|D_t ∇I − ddt|²,
//!
//! with D_t I(q) = I_{t+1}(q) − I_t(p). Windows overlap; what each says of a moment is weighted, and the sum is the frame.
//!
//! # Source
//! Manzi, Kettunen, Durand, Zwicker and Lehtinen, "Temporal Gradient-Domain Path Tracing", ACM TOG 35(6), 2016.

mod difference;
mod gradients;
mod l1;
mod l2;
mod links;
mod moment;
mod operator;
mod precondition;
mod rules;
mod share;
mod source;
mod spectral;
mod squares;
mod system;
mod trails;
mod weights;
mod windows;

pub use moment::{CopyFilm, MomentFilm};
pub use share::{Share, blend, finish};
pub use windows::Windows;

use super::{Reconstruct, ReconstructError, ReconstructionKind, SolveReport, merge};
use crate::film::Image;
use links::Links;
use rules::{Alike, Inverse};
use source::Source;
use spectral::Uniform;

/// The images of a window's moments.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowSolution {
    /// What the window says of each moment, in their order.
    pub moments: Vec<Share>,
    /// How the solve went.
    pub report: SolveReport,
}

/// Solves for the images of a row of moments together. Without `alpha` the noise of the measurements decides how much primals count, for each
/// copy that of the other one.
///
/// # Errors
/// If `kind` does not take windows, `alpha` is not usable, moments differ in size or in their copies, motion leads out of the image, or a
/// solve diverges.
pub fn solve(moments: &[&MomentFilm], kind: ReconstructionKind, alpha: Option<f32>) -> Result<WindowSolution, ReconstructError> {
    if let Some(found) = alpha.filter(|alpha| !(*alpha > 0.0 && alpha.is_finite())) {
        return Err(ReconstructError::Alpha { found });
    }
    let method = super::method(kind).filter(|_| kind.takes_windows()).ok_or(ReconstructError::NoWindows { wanted: kind.name() })?;
    let Some(first) = moments.first() else { return Ok(WindowSolution { moments: Vec::new(), report: SolveReport::default() }) };
    for moment in moments {
        if moment.extent() != first.extent() {
            return Err(ReconstructError::Sizes { found: moment.extent(), expected: first.extent() });
        }
        if moment.copies().len() != first.copies().len() {
            return Err(ReconstructError::Copies { found: moment.copies().len() });
        }
    }
    if first.extent().pixels() == 0 {
        let share = || Share { image: Image::new(first.extent(), 3), copies: None, unbiased: None };
        return Ok(WindowSolution { moments: moments.iter().map(|_| share()).collect(), report: SolveReport::default() });
    }
    let links = moments.iter().skip(1).map(|moment| Links::new(moment.motion())).collect::<Result<Vec<_>, _>>()?;
    let alike = matches!(kind, ReconstructionKind::L2 | ReconstructionKind::L1);
    let pairs = if alike { weights::pairs(moments, &links) } else { Vec::new() };
    let window = Window { moments, links, pairs, kind, method, alpha };
    let copies = first.copies().len();
    let solved = (0..copies).map(|copy| window.of_copy(copy)).collect::<Result<Vec<_>, _>>()?;
    let mut solution = window.join(solved);
    if kind == ReconstructionKind::L1 && copies > 1 {
        window.robust(&mut solution)?;
    }
    Ok(solution)
}

/// A row of moments and how to solve for them.
struct Window<'a> {
    moments: &'a [&'a MomentFilm],
    /// Of each moment but the first to the one before.
    links: Vec<Option<Links>>,
    /// What differences in time count, where that is alike in all pixels.
    pairs: Vec<[f64; 2]>,
    kind: ReconstructionKind,
    method: &'static dyn Reconstruct,
    alpha: Option<f32>,
}

/// The images of all moments.
type Solved = (Vec<Image>, SolveReport);

impl Window<'_> {
    /// From one copy alone; what the other one tells are weights.
    fn of_copy(&self, own: usize) -> Result<Solved, ReconstructError> {
        let other = if self.moments[0].copies().len() == 2 { 1 - own } else { own };
        let alpha = self.alpha.unwrap_or_else(|| self.typical_alpha(other));
        let source = self.source(Some(own));
        let told = |(images, report): Solved| (images, SolveReport { alpha, ..report });
        match self.kind {
            ReconstructionKind::None => {
                let copies = self.moments.iter().map(|moment| &moment.copies()[own]);
                Ok((copies.map(CopyFilm::primal).collect(), SolveReport::default()))
            }
            ReconstructionKind::WeightedL2 => {
                let rule = Inverse::new(other, &source, alpha);
                squares::solve(source, &rule, squares::by_noise(&source, f64::from(rule.scale()))).map(told)
            }
            ReconstructionKind::L1 => l1::minimise(source, &Uniform::typical(alpha, self.links.len())),
            _ => self.l2(own, alpha).map(told),
        }
    }

    /// Least squares, all pixels alike.
    fn l2(&self, own: usize, alpha: f32) -> Result<Solved, ReconstructError> {
        let weights = Uniform { screen: f64::from(alpha) * f64::from(alpha), pairs: self.pairs.clone() };
        if self.links.iter().all(Option::is_none) {
            let copies: Vec<&CopyFilm> = self.moments.iter().map(|moment| &moment.copies()[own]).collect();
            return Ok((l2::solve_still(&copies, &weights), SolveReport::default()));
        }
        let source = self.source(Some(own));
        let noise: f64 = self.moments.iter().map(|moment| moment.copies()[own].slope_noise()).sum();
        let enough = squares::by_noise(&source, noise / self.moments.len() as f64);
        squares::solve(source, &Alike { weights: &weights, links: &self.links }, enough)
    }

    /// Replaces the mean of the copies' images by what both copies' measurements make together, and adds what least squares make of each.
    fn robust(&self, solution: &mut WindowSolution) -> Result<(), ReconstructError> {
        let alpha = solution.report.alpha;
        let (images, report) = l1::minimise(self.source(None), &Uniform::typical(alpha, self.links.len()))?;
        let [a, b] = [self.l2(0, alpha)?.0, self.l2(1, alpha)?.0];
        for ((share, image), unbiased) in solution.moments.iter_mut().zip(images).zip(a.into_iter().zip(b)) {
            share.image = image;
            share.unbiased = Some(unbiased.into());
        }
        solution.report = report;
        Ok(())
    }

    fn source(&self, copy: Option<usize>) -> Source<'_> {
        Source { moments: self.moments, links: &self.links, copy }
    }

    /// The mean over moments of the weight that the noise of one copy calls for.
    fn typical_alpha(&self, copy: usize) -> f32 {
        let sum: f64 = self.moments.iter().map(|moment| f64::from(moment.copies()[copy].alpha(self.method))).sum();
        (sum / self.moments.len() as f64) as f32
    }

    /// What one or two copies make together.
    fn join(&self, mut solved: Vec<Solved>) -> WindowSolution {
        let report = match solved.as_slice() {
            [(_, a), (_, b)] => merge(*a, *b),
            _ => solved.first().map(|(_, report)| *report).unwrap_or_default(),
        };
        let second = if solved.len() > 1 { solved.pop().map(|(images, _)| images) } else { None };
        let first = solved.pop().map(|(images, _)| images).unwrap_or_default();
        let moments = match second {
            None => first.into_iter().map(|image| Share { image, copies: None, unbiased: None }).collect(),
            Some(second) => {
                let pairs = first.into_iter().zip(second).zip(self.moments);
                pairs.map(|((a, b), moment)| Share { image: moment.joined(&a, &b), copies: Some([a, b]), unbiased: None }).collect()
            }
        };
        WindowSolution { moments, report }
    }
}

#[cfg(test)]
mod tests;
