//! What fills the space between surfaces: media that absorb and scatter.

mod homogeneous;
mod phase;

pub use homogeneous::Homogeneous;
pub use phase::Phase;

use crate::spectrum::Spectrum;

/// Index of a medium in the scene's table, or vacuum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MediumId(pub u32);

impl MediumId {
    /// Empty space.
    pub const VACUUM: MediumId = MediumId(u32::MAX);
}

/// A participating medium.
#[derive(Clone, Debug, PartialEq)]
pub enum Medium {
    /// The same everywhere.
    Homogeneous(Homogeneous),
}

impl Medium {
    /// Fraction of light that passes a distance [m] of it.
    #[inline]
    pub fn transmittance(&self, distance: f32) -> Spectrum {
        match self {
            Medium::Homogeneous(medium) => medium.transmittance(distance),
        }
    }

    /// Probability that a walk passes this distance without a collision: the mean of the channels' transmittances.
    #[inline]
    pub fn pass_density(&self, transmittance: Spectrum) -> f32 {
        transmittance.mean()
    }

    /// What a collision at the end of a passage is worth: scattering coefficient times transmittance [m⁻¹], and the density with which
    /// a walk collides there [m⁻¹].
    #[inline]
    pub fn collision(&self, transmittance: Spectrum) -> (Spectrum, f32) {
        match self {
            Medium::Homogeneous(medium) => (medium.scattering() * transmittance, (medium.extinction * transmittance).mean()),
        }
    }

    /// Distance to the next collision by one number in [0, 1), which also chooses the channel; infinite where that channel meets nothing.
    #[inline]
    pub fn sample(&self, u: f32) -> f32 {
        match self {
            Medium::Homogeneous(medium) => medium.sample(u),
        }
    }

    /// How it scatters.
    #[inline]
    pub fn phase(&self) -> &Phase {
        match self {
            Medium::Homogeneous(medium) => &medium.phase,
        }
    }

    /// Single-scattering albedo [1].
    pub fn albedo(&self) -> Spectrum {
        match self {
            Medium::Homogeneous(medium) => medium.albedo,
        }
    }
}
