//! Reconstruction: from the film's primal and gradients to an image, and what that image's error is.
//!
//! One trait, one file each. All are deterministic for any number of threads: parallel loops write disjoint parts, and sums
//! run in a fixed order.

mod auto;
mod control_variates;
mod dct;
mod denoise;
mod error;
mod fault;
mod field;
mod graph;
mod l1;
mod l2;
mod multigrid;
mod nfor;
mod noise;
mod none;
mod normal;
mod patches;
mod regression;
mod regularised;
mod robust;
mod shrink;
mod smooth;
mod solver;
mod sparse;
mod stencil;
mod together;
mod variances;
mod weighted;
mod weighted_l1;
pub mod window;

pub use denoise::{Denoise, denoiser, install_denoiser};
pub use error::ErrorEstimate;
pub use fault::ReconstructError;

use crate::film::{Features, Film, Graph, HalfFilm, Image};
use crate::lattice::Extent;

/// The reconstruction by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ReconstructionKind {
    /// The primal as it is.
    None,
    /// Screened Poisson in the L2 norm, exact by cosine transform. Unbiased.
    L2,
    /// Screened Poisson with inverse variances as weights, by the other half's. Unbiased.
    WeightedL2,
    /// Screened Poisson in the L1 norm by iteratively reweighted least squares. Robust to outliers, biased.
    L1,
    /// Screened Poisson in the L1 norm with inverse deviations as weights, by the other half's. Robust to outliers, biased.
    WeightedL1,
    /// Least squares over the links between similar pixels. Unbiased.
    Graph,
    /// Image-space control variates, all alike. Unbiased.
    Cv,
    /// Image-space control variates, weighted by the other half's variances. Unbiased.
    WeightedCv,
    /// First-order regression on features, of the image that gradients were integrated to. Biased.
    Nfor,
    /// Screened Poisson held to what features predict, by several strengths. Biased.
    Regularised,
    /// Intel Open Image Denoise, where it is installed. Biased, and its bits depend on the machine.
    Oidn,
    /// Of those that are quick, the one of least estimated error on the film at hand.
    Auto,
}

impl ReconstructionKind {
    /// Every reconstruction.
    pub const ALL: [ReconstructionKind; 12] = [
        ReconstructionKind::None,
        ReconstructionKind::L2,
        ReconstructionKind::WeightedL2,
        ReconstructionKind::L1,
        ReconstructionKind::WeightedL1,
        ReconstructionKind::Graph,
        ReconstructionKind::Cv,
        ReconstructionKind::WeightedCv,
        ReconstructionKind::Nfor,
        ReconstructionKind::Regularised,
        ReconstructionKind::Oidn,
        ReconstructionKind::Auto,
    ];

    /// Its name on the command line and on the wire.
    pub fn name(self) -> &'static str {
        match self {
            ReconstructionKind::None => "none",
            ReconstructionKind::L2 => "l2",
            ReconstructionKind::WeightedL2 => "weighted-l2",
            ReconstructionKind::L1 => "l1",
            ReconstructionKind::WeightedL1 => "weighted-l1",
            ReconstructionKind::Graph => "graph",
            ReconstructionKind::Cv => "cv",
            ReconstructionKind::WeightedCv => "weighted-cv",
            ReconstructionKind::Nfor => "nfor",
            ReconstructionKind::Regularised => "regularised",
            ReconstructionKind::Oidn => "oidn",
            ReconstructionKind::Auto => "auto",
        }
    }

    /// Whether its image's expected value is the truth, where measurements are unbiased.
    pub fn is_unbiased(self) -> bool {
        method(self).is_some_and(|method| method.is_unbiased())
    }

    /// Whether it is nothing without two independent halves.
    pub fn needs_halves(self) -> bool {
        matches!(self, ReconstructionKind::Nfor | ReconstructionKind::Regularised)
    }

    /// Whether it can solve windows of moments as a whole.
    pub fn takes_windows(self) -> bool {
        matches!(self, ReconstructionKind::None | ReconstructionKind::L2 | ReconstructionKind::WeightedL2 | ReconstructionKind::L1)
    }

    /// Whether the same film gives the same bits on every machine.
    pub fn is_reproducible(self) -> bool {
        self != ReconstructionKind::Oidn
    }
}

/// What a reconstruction starts from: forward differences, none beyond the last column and row (Neumann border).
#[derive(Clone, Copy, Debug)]
pub struct Measurements<'a> {
    /// Size.
    pub extent: Extent,
    /// Primal, RGB.
    pub primal: &'a Image,
    /// I(x+1, y) − I(x, y), RGB.
    pub dx: &'a Image,
    /// I(x, y+1) − I(x, y), RGB.
    pub dy: &'a Image,
    /// Differences along links, where there are any.
    pub graph: Option<&'a Graph>,
    /// How noisy they are, where that is known.
    pub variance: Option<Variance<'a>>,
    /// Features of the first surface, where they are known; alike for both halves.
    pub features: Option<&'a Features>,
}

/// Variances of measured means, estimated from their samples.
#[derive(Clone, Copy, Debug)]
pub struct Variance<'a> {
    /// Of the primal. RGB.
    pub primal: &'a Image,
    /// Of the differences along columns, summed over RGB. One channel.
    pub dx: &'a Image,
    /// Of the differences along rows, summed over RGB. One channel.
    pub dy: &'a Image,
}

impl<'a> Measurements<'a> {
    /// Measurements of which nothing else is known. All three images have the same size and three channels.
    pub fn new(primal: &'a Image, dx: &'a Image, dy: &'a Image) -> Self {
        Self { extent: primal.extent(), primal, dx, dy, graph: None, variance: None, features: None }
    }
}

/// How a solve went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolveReport {
    /// Linear iterations, each of all channels, over all reweightings; 0 for direct solves.
    pub iterations: u32,
    /// Largest relative residual ‖b − Ax‖ / ‖b‖ of the last linear system [1].
    pub residual: f64,
    /// Weight of the primal that was taken; where halves were solved by themselves, the mean of theirs.
    pub alpha: f32,
}

/// A way from measurements to an image. Object-safe; called once a frame.
pub trait Reconstruct: Send + Sync {
    /// Whether the frame's image is the mean of its halves' images: where the image is a linear function of the measurements, or each half
    /// is weighted by what the other one tells. Where not, the frame is solved for from both halves together.
    fn joins_halves(&self) -> bool;

    /// Whether the image's expected value is the primal's, where the measurements are unbiased.
    fn is_unbiased(&self) -> bool;

    /// The weight of the primal that the noise of measurements calls for; these may be the other half's.
    fn alpha(&self, source: &Measurements) -> f32 {
        noise::alpha(source)
    }

    /// Solves for the image of `own`. `alpha` is the weight of the primal against the gradients. `other` is the other half where `own` is one:
    /// weights that follow from it are independent of what they weigh.
    ///
    /// # Errors
    /// If it needs links, variances, features or the other half and there is none, or an iterative solve diverges.
    fn solve(&self, own: &Measurements, other: Option<&Measurements>, alpha: f32) -> Result<(Image, SolveReport), ReconstructError>;

    /// Solves for the images of both halves, which some methods do in one go; each has its own weight of the primal.
    ///
    /// # Errors
    /// As [`Reconstruct::solve`].
    fn solve_halves(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Result<[(Image, SolveReport); 2], ReconstructError> {
        let [a, b] = halves;
        // One after the other: each uses all threads by itself, and the memory of one solve is enough.
        Ok([self.solve(a, Some(b), alphas[0])?, self.solve(b, Some(a), alphas[1])?])
    }
}

/// The registry: one line each. `None` for the choice among them.
fn method(kind: ReconstructionKind) -> Option<&'static dyn Reconstruct> {
    Some(match kind {
        ReconstructionKind::None => &none::None,
        ReconstructionKind::L2 => &l2::L2,
        ReconstructionKind::WeightedL2 => &weighted::WeightedL2,
        ReconstructionKind::L1 => &l1::L1,
        ReconstructionKind::WeightedL1 => &weighted_l1::WeightedL1,
        ReconstructionKind::Graph => &graph::LeastSquares,
        ReconstructionKind::Cv => &control_variates::Uniform,
        ReconstructionKind::WeightedCv => &control_variates::Weighted,
        ReconstructionKind::Nfor => &nfor::Nfor,
        ReconstructionKind::Regularised => &regularised::Regularised,
        ReconstructionKind::Oidn => &denoise::Oidn,
        ReconstructionKind::Auto => return None,
    })
}

/// A finished frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Reconstructed {
    /// The image, RGB: what was solved for, with directly visible emission added.
    pub image: Image,
    /// The primal of both halves with directly visible emission: what plain path tracing shows for the same samples. RGB.
    pub primal: Image,
    /// The images of half A and of half B, where both have samples.
    pub halves: Option<[Image; 2]>,
    /// How far the image is from the truth, where both halves have samples.
    pub error: Option<ErrorEstimate>,
    /// How the solve went.
    pub report: SolveReport,
    /// What made the image: the reconstruction that was asked for, or the one that `auto` chose.
    pub kind: ReconstructionKind,
    /// Why `auto` chose it, for people.
    pub why: Option<String>,
}

impl Reconstructed {
    /// Sets negative values of the image to zero, which biases it. The halves' images and what follows from them stay as they are.
    pub fn clamp(&mut self) {
        self.image.data_mut().iter_mut().for_each(|v| *v = v.max(0.0));
    }
}

/// Reconstructs a frame. Without `alpha` the noise of the measurements decides how much the primal counts: for each half the noise of the
/// other one, so that the image stays unbiased.
///
/// # Errors
/// If the film lacks gradients that the reconstruction needs, `alpha` is not usable, or a solve fails.
pub fn reconstruct(film: &Film, kind: ReconstructionKind, alpha: impl Into<Option<f32>>) -> Result<Reconstructed, ReconstructError> {
    let alpha = alpha.into();
    if let Some(found) = alpha.filter(|alpha| !(*alpha > 0.0 && alpha.is_finite())) {
        return Err(ReconstructError::Alpha { found });
    }
    let Some(method) = method(kind) else { return auto::choose(film, alpha) };
    let combined = film.combined();
    let [a, b] = &film.halves;
    let nothing = Image::new(film.extent, 3);
    let both = |half| measurements(half, &film.features, &nothing, kind);
    let lit = |image: &Image, half: &HalfFilm| zip(image, &half.direct, |p, d| p + d);
    let weight = |source: &Measurements| alpha.unwrap_or_else(|| method.alpha(source));
    let halves = if a.samples > 0 && b.samples > 0 {
        let (of_a, of_b) = (both(a)?, both(b)?);
        let alphas = [weight(&of_b), weight(&of_a)];
        let [(image_a, report_a), (image_b, report_b)] = method.solve_halves([&of_a, &of_b], alphas)?;
        let report = merge(SolveReport { alpha: alphas[0], ..report_a }, SolveReport { alpha: alphas[1], ..report_b });
        Some(([lit(&image_a, a), lit(&image_b, b)], report))
    } else {
        None
    };
    let (image, report) = match &halves {
        Some(([image_a, image_b], report)) if method.joins_halves() => {
            let (na, nb) = (f64::from(a.samples), f64::from(b.samples));
            (zip(image_a, image_b, |p, q| ((na * f64::from(p) + nb * f64::from(q)) / (na + nb)) as f32), *report)
        }
        _ => {
            let together = both(&combined)?;
            let alpha = weight(&together);
            let (image, report) = method.solve(&together, None, alpha)?;
            (lit(&image, &combined), SolveReport { alpha, ..report })
        }
    };
    let halves = halves.map(|(images, _)| images);
    let unbiased = match &halves {
        Some(_) if !method.is_unbiased() => {
            Some([baseline(a, alpha.unwrap_or(noise::TYPICAL))?, baseline(b, alpha.unwrap_or(noise::TYPICAL))?])
        }
        _ => None,
    };
    let error = halves.as_ref().map(|halves| ErrorEstimate::new(&image, halves, unbiased.as_ref(), [a.samples, b.samples]));
    let primal = zip(&combined.primal, &combined.direct, |p, d| p + d);
    Ok(Reconstructed { image, primal, halves, error, report, kind, why: None })
}

/// Solves for the image of measurements that stand alone, such as another renderer's. Without `alpha` their noise decides, where it is known.
///
/// # Errors
/// If `kind` needs halves, which `auto` does to choose by, `alpha` is not usable, planes hold values that are not finite, variances or links are needed and missing, or the solve fails.
pub fn solve(m: &Measurements, kind: ReconstructionKind, alpha: Option<f32>) -> Result<(Image, SolveReport), ReconstructError> {
    if let Some(found) = alpha.filter(|alpha| !(*alpha > 0.0 && alpha.is_finite())) {
        return Err(ReconstructError::Alpha { found });
    }
    check_finite(&[("primal", m.primal), ("dx", m.dx), ("dy", m.dy)])?;
    if let Some(variance) = &m.variance {
        check_finite(&[("variance of the primal", variance.primal), ("variance of dx", variance.dx), ("variance of dy", variance.dy)])?;
    }
    let method = method(kind).ok_or(ReconstructError::NoHalves { wanted: kind.name() })?;
    let alpha = alpha.unwrap_or_else(|| method.alpha(m));
    let (image, report) = method.solve(m, None, alpha)?;
    Ok((image, SolveReport { alpha, ..report }))
}

fn check_finite(planes: &[(&'static str, &Image)]) -> Result<(), ReconstructError> {
    for (plane, image) in planes {
        if let Some(index) = image.data().iter().position(|v| !v.is_finite()) {
            return Err(ReconstructError::NotFinite { plane, index });
        }
    }
    Ok(())
}

/// What a half (or both together) has for a reconstruction. `nothing` stands for gradients that are not needed.
fn measurements<'a>(
    half: &'a HalfFilm,
    features: &'a Features,
    nothing: &'a Image,
    kind: ReconstructionKind,
) -> Result<Measurements<'a>, ReconstructError> {
    let (dx, dy, variance) = match &half.gradients {
        Some(g) => (&g.dx, &g.dy, Some(Variance { primal: &half.primal_variance, dx: &g.dx_variance, dy: &g.dy_variance })),
        None if matches!(kind, ReconstructionKind::None | ReconstructionKind::Graph) => {
            (nothing, nothing, Some(Variance { primal: &half.primal_variance, dx: nothing, dy: nothing }))
        }
        None => return Err(ReconstructError::NoGradients { wanted: kind.name() }),
    };
    check_finite(&[("primal", &half.primal), ("dx", dx), ("dy", dy)])?;
    Ok(Measurements { graph: half.graph.as_ref(), variance, features: Some(features), ..Measurements::new(&half.primal, dx, dy) })
}

/// The unbiased image of a half that tells the bias of others: least squares where there are gradients, else what was measured.
fn baseline(half: &HalfFilm, alpha: f32) -> Result<Image, ReconstructError> {
    let image = match &half.gradients {
        Some(g) => l2::L2.solve(&Measurements::new(&half.primal, &g.dx, &g.dy), None, alpha)?.0,
        None => half.primal.clone(),
    };
    Ok(zip(&image, &half.direct, |p, d| p + d))
}

fn merge(a: SolveReport, b: SolveReport) -> SolveReport {
    SolveReport { iterations: a.iterations + b.iterations, residual: a.residual.max(b.residual), alpha: 0.5 * (a.alpha + b.alpha) }
}

fn zip(a: &Image, b: &Image, f: impl Fn(f32, f32) -> f32) -> Image {
    let mut out = a.clone();
    for (o, v) in out.data_mut().iter_mut().zip(b.data()) {
        *o = f(*o, *v);
    }
    out
}

#[cfg(test)]
mod tests;
