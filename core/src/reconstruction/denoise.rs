//! A denoiser from outside this crate, fed what it can digest.

use super::shrink::drawn;
use super::together::{Together, unbiased};
use super::{Measurements, ReconstructError, ReconstructionKind, SolveReport};
use crate::film::Image;
use std::sync::OnceLock;

/// What can make a noisy image smooth. Called once for each half of a frame.
pub trait Denoise: Send + Sync {
    /// Its name and version, for people.
    fn name(&self) -> String;

    /// An image without noise. All images have three channels and one size; `colour` is linear radiance of any magnitude, `albedo` within
    /// [0, 1], `normal` in world space.
    ///
    /// # Errors
    /// What the denoiser complained of.
    fn denoise(&self, colour: &Image, albedo: &Image, normal: &Image) -> Result<Image, String>;
}

static DENOISER: OnceLock<Box<dyn Denoise>> = OnceLock::new();

/// Offers a denoiser to the reconstruction `oidn`, for as long as the process lives.
///
/// # Errors
/// The denoiser, if there is one already.
pub fn install_denoiser(denoiser: Box<dyn Denoise>) -> Result<(), Box<dyn Denoise>> {
    DENOISER.set(denoiser)
}

/// The denoiser that was installed.
pub fn denoiser() -> Option<&'static dyn Denoise> {
    DENOISER.get().map(|denoiser| &**denoiser)
}

/// Intel Open Image Denoise, or what stands for it. It is trained on the noise of single pixels, so it is fed the primal: the noise of an
/// image that gradients were integrated to spreads over many pixels, and it takes that for picture. Gradients come in by the unbiased
/// image that the result is drawn towards.
pub(super) struct Oidn;

impl Together for Oidn {
    const KIND: ReconstructionKind = ReconstructionKind::Oidn;

    fn solve_both(&self, halves: [&Measurements; 2], alphas: [f32; 2]) -> Result<[(Image, SolveReport); 2], ReconstructError> {
        let [(a, report_a), (b, report_b)] = unbiased(halves, alphas)?;
        let smooth = [denoised(halves[0], halves[0].primal)?, denoised(halves[1], halves[1].primal)?];
        let [a, b] = drawn([a, b], &smooth);
        Ok([(a, report_a), (b, report_b)])
    }

    fn solve_alone(&self, own: &Measurements) -> Result<Image, ReconstructError> {
        denoised(own, own.primal)
    }
}

fn denoised(m: &Measurements, colour: &Image) -> Result<Image, ReconstructError> {
    let denoiser = denoiser().ok_or(ReconstructError::NoDenoiser)?;
    let features = m.features.ok_or(ReconstructError::NoFeatures { wanted: ReconstructionKind::Oidn.name() })?;
    denoiser.denoise(colour, &features.albedo, &features.normal).map_err(|fault| ReconstructError::Denoiser { fault })
}
