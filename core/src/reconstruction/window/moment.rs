//! A moment of an animation as windows need it: the measurements of its halves, copy by copy, and where its surfaces came from.

use super::super::variances::mean_deviation;
use super::super::{Measurements, ReconstructError, ReconstructionKind, Variance, check_finite};
use crate::film::{Film, HalfFilm, Image};
use crate::lattice::Extent;

/// What is kept of a moment once its tiles are stitched.
///
/// Half A has the random numbers of half B of the moment before, so halves are kept apart: half A minus that half B is how the image
/// changed. Memory: 104 bytes a pixel and copy, and 12 for motion.
#[derive(Clone, Debug, PartialEq)]
pub struct MomentFilm {
    extent: Extent,
    pub(super) copies: Vec<CopyFilm>,
    pub(super) motion: Option<Image>,
}

/// One of the independent copies of a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct CopyFilm {
    samples: [u32; 2],
    pub(super) halves: [HalfMoment; 2],
    /// Of the mean of both halves. RGB.
    primal_variance: Image,
    /// Of the mean of both halves, summed over RGB. One channel.
    dx_variance: Image,
    /// As `dx_variance`.
    dy_variance: Image,
    /// Directly visible emission, mean of both halves. RGB.
    direct: Image,
}

/// What half A or half B measured. RGB.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HalfMoment {
    pub(super) primal: Image,
    pub(super) dx: Image,
    pub(super) dy: Image,
}

impl MomentFilm {
    /// Keeps of one or two independent films of a moment (such as of its even and of its odd passes) what windows need.
    ///
    /// # Errors
    /// If a film lacks gradients or a half, holds values that are not finite, or sizes differ.
    pub fn new(copies: &[&Film]) -> Result<Self, ReconstructError> {
        let (Some(first), true) = (copies.first(), copies.len() <= 2) else {
            return Err(ReconstructError::Copies { found: copies.len() });
        };
        let extent = first.extent;
        if let Some(other) = copies.iter().find(|film| film.extent != extent) {
            return Err(ReconstructError::Sizes { found: other.extent, expected: extent });
        }
        let motion = match copies {
            [a, b] => a.motion.as_ref().zip(b.motion.as_ref()).map(|(a, b)| agreed(a, b)),
            _ => first.motion.clone(),
        };
        if let Some(motion) = &motion {
            check_finite(&[("motion", motion)])?;
        }
        Ok(Self { extent, copies: copies.iter().map(|film| CopyFilm::new(film)).collect::<Result<_, _>>()?, motion })
    }

    /// Size [pixels].
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// The one or two copies.
    pub fn copies(&self) -> &[CopyFilm] {
        &self.copies
    }

    /// Displacement (columns, rows) [pixels] of each pixel to its partner in the moment before, and 1 where it has one.
    pub fn motion(&self) -> Option<&Image> {
        self.motion.as_ref()
    }

    /// Mean of the copies' primals with directly visible emission: what plain path tracing shows for the same samples. RGB.
    pub fn primal(&self) -> Image {
        self.mean(|copy| super::super::zip(&copy.primal(), &copy.direct, |p, d| p + d))
    }

    /// Mean over copies of an image of each.
    pub(super) fn mean(&self, image: impl Fn(&CopyFilm) -> Image) -> Image {
        match self.copies.as_slice() {
            [a, b] => self.joined(&image(a), &image(b)),
            [only] => image(only),
            _ => Image::new(self.extent, 3),
        }
    }

    /// The mean of an image of each of two copies, by their samples.
    pub(super) fn joined(&self, a: &Image, b: &Image) -> Image {
        let share = match self.copies.as_slice() {
            [a, b] => a.total() / (a.total() + b.total()),
            _ => 1.0,
        };
        mix(a, b, share)
    }
}

impl CopyFilm {
    fn new(film: &Film) -> Result<Self, ReconstructError> {
        let [a, b] = &film.halves;
        if a.samples == 0 || b.samples == 0 {
            return Err(ReconstructError::NoSharedSeeds);
        }
        let together = film.combined();
        let gradients = together.gradients.ok_or(ReconstructError::NoGradients { wanted: "windows" })?;
        let copy = Self {
            samples: [a.samples, b.samples],
            halves: [HalfMoment::new(a)?, HalfMoment::new(b)?],
            primal_variance: together.primal_variance,
            dx_variance: gradients.dx_variance,
            dy_variance: gradients.dy_variance,
            direct: together.direct,
        };
        let variances = [("variance of the primal", &copy.primal_variance), ("variance of dx", &copy.dx_variance)];
        check_finite(&variances)?;
        check_finite(&[("variance of dy", &copy.dy_variance), ("direct emission", &copy.direct)])?;
        Ok(copy)
    }

    /// Samples per pixel of both halves.
    pub fn samples(&self) -> u32 {
        self.samples[0] + self.samples[1]
    }

    /// Directly visible emission. RGB.
    pub fn direct(&self) -> &Image {
        &self.direct
    }

    /// Mean of both halves' primals, without directly visible emission. RGB.
    pub fn primal(&self) -> Image {
        self.both(|half| &half.primal)
    }

    /// Mean of both halves of some image.
    pub(super) fn both(&self, image: impl Fn(&HalfMoment) -> &Image) -> Image {
        mix(image(&self.halves[0]), image(&self.halves[1]), self.share())
    }

    /// Half A's part of the mean of both.
    pub(super) fn share(&self) -> f64 {
        f64::from(self.samples[0]) / self.total()
    }

    fn total(&self) -> f64 {
        f64::from(self.samples[0]) + f64::from(self.samples[1])
    }

    /// Variances of the means of both halves.
    pub(super) fn variance(&self) -> Variance<'_> {
        Variance { primal: &self.primal_variance, dx: &self.dx_variance, dy: &self.dy_variance }
    }

    /// What a typical difference in space varies by, summed over RGB: the square of the mean standard deviation, which few loud pixels do not
    /// raise.
    pub(super) fn slope_noise(&self) -> f64 {
        let of = |image: &Image| mean_deviation(image.plane(0)).powi(2);
        0.5 * (of(&self.dx_variance) + of(&self.dy_variance))
    }

    /// The weight of the primal that the noise of a single moment calls for.
    pub(super) fn alpha(&self, method: &dyn super::super::Reconstruct) -> f32 {
        let primal = self.primal();
        let half = &self.halves[0];
        // Noise is told by the primal's brightness and the variances alone.
        method.alpha(&Measurements { variance: Some(self.variance()), ..Measurements::new(&primal, &half.dx, &half.dy) })
    }
}

impl HalfMoment {
    fn new(half: &HalfFilm) -> Result<Self, ReconstructError> {
        let gradients = half.gradients.as_ref().ok_or(ReconstructError::NoGradients { wanted: ReconstructionKind::L2.name() })?;
        let kept = Self { primal: half.primal.clone(), dx: gradients.dx.clone(), dy: gradients.dy.clone() };
        check_finite(&[("primal", &kept.primal), ("dx", &kept.dx), ("dy", &kept.dy)])?;
        Ok(kept)
    }
}

/// `share · a + (1 − share) · b`.
pub(super) fn mix(a: &Image, b: &Image, share: f64) -> Image {
    super::super::zip(a, b, |a, b| (share * f64::from(a) + (1.0 - share) * f64::from(b)) as f32)
}

/// Where two copies saw the same motion; elsewhere pixels have no partner.
fn agreed(a: &Image, b: &Image) -> Image {
    let mut out = a.clone();
    for i in 0..a.extent().pixels() {
        if (0..3).any(|c| a.plane(c)[i] != b.plane(c)[i]) {
            (0..3).for_each(|c| out.plane_mut(c)[i] = 0.0);
        }
    }
    out
}
