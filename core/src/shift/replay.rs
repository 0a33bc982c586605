//! Random replay: the offset path scatters by the numbers that the base path was drawn with.
//!
//! In primary sample space the shift is the identity: the same numbers, other paths. With x = x(u) of density p and y = y(u) of density
//! p′, both totals over all lobes that lead in the same direction, f(x)/p(x) and f(y)/p′(y) have the two pixels as means over u, whichever
//! lobe a number picked. So the factor that makes ρ = p′|T′|/p equal to 1 at each step, |T′| = p/p′, is right for mixtures too; where a
//! material has a single lobe it is also the determinant of the map in solid angle.
//!
//! Legs are followed as in every shift: at the same distance inside media, behind as many surfaces with holes.

use super::chain::{Course, Rule, Turn, shift_by};
use crate::math::{Ray, Vec3};
use crate::path::{OffsetSubpath, ShiftFailure, ShiftMap, Subpath, Vertex};
use crate::sampling::{Dimension, SampleStream};
use crate::scene::Scene;

/// Replays from end to end; only the points on lights are shared.
///
/// # Source
/// Kelemen et al., "A Simple and Robust Mutation Strategy for the Metropolis Light Transport Algorithm", CGF 21(3), 2002, for the space;
/// Hua et al., "A Survey on Gradient-Domain Rendering", CGF 38(2), 2019, for the shift.
#[derive(Clone, Copy, Debug)]
pub struct ReplayShift {
    /// Roughness at and above which a vertex is connectable.
    pub threshold: f32,
}

impl ShiftMap for ReplayShift {
    fn shift(&self, scene: &Scene, base: &Subpath, camera: &Ray, out: &mut OffsetSubpath) {
        shift_by(self, scene, base, camera, out);
    }
}

impl Rule for ReplayShift {
    fn threshold(&self) -> f32 {
        self.threshold
    }

    #[inline]
    fn course(&self, base: &Vertex, offset: &Vertex, target: Option<&Vertex>) -> Course {
        // Points on lights are shared wherever both can connect, and so is light at infinity.
        if target.is_none() && base.connectable && offset.connectable { Course::Join } else { Course::Walk }
    }

    #[inline]
    fn decide(&self, scene: &Scene, base: &Vertex, offset: &mut Vertex, k: usize, stream: &SampleStream) -> Option<f32> {
        decide(scene, base, offset, k, stream)
    }

    #[inline]
    fn turn(&self, scene: &Scene, _: &Vertex, offset: &Vertex, turned: &Turn) -> Result<(Vec3, f64), ShiftFailure> {
        replay(scene, offset, turned)
    }
}

/// Decides by the number that decided at the base vertex. `None` where it decides otherwise: then it does so on the way back too.
#[inline]
pub(super) fn decide(scene: &Scene, base: &Vertex, offset: &mut Vertex, k: usize, stream: &SampleStream) -> Option<f32> {
    let choice = offset.decide(scene, || stream.number(Dimension::lobe(k)));
    (offset.delta == base.delta).then_some(choice)
}

/// Samples the offset's direction by the base step's numbers.
///
/// # Errors
/// `LobeMismatch` if the numbers lead nowhere at the offset, or through the surface on one path only where the lobe is a delta.
#[inline]
pub(super) fn replay(scene: &Scene, offset: &Vertex, turned: &Turn) -> Result<(Vec3, f64), ShiftFailure> {
    let Turn { step, k, decision, stream } = *turned;
    let scatter = offset.sample(scene, decision, stream.pair(Dimension::direction(k))).ok_or(ShiftFailure::LobeMismatch)?;
    let transmits = offset.wo.z * offset.frame.normal.dot(scatter.wi) < 0.0;
    if scatter.delta && transmits != step.transmits {
        return Err(ShiftFailure::LobeMismatch);
    }
    let jacobian = f64::from(step.evaluation.density) / f64::from(scatter.evaluation.density);
    if !(jacobian > 0.0 && jacobian.is_finite()) {
        return Err(ShiftFailure::LobeMismatch);
    }
    Ok((scatter.wi, jacobian))
}
