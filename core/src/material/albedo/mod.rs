//! Directional albedo of rough surfaces, tabulated: what light a surface loses between its facets, and what a coat lets through.

mod facets;
mod profile;
mod sheen;

pub(super) use facets::{FacetAlbedo, dielectric_albedo, dielectric_transmittance, facet_albedo, mean_dielectric_reflectance};
pub(super) use profile::Profile;
pub(super) use sheen::{charlie, sheen_albedo, sheen_scale};

/// Nodes of roughness α in tables, evenly spaced in √α: albedos change fastest where surfaces are smooth.
const ROWS: usize = 24;

/// Roughness α of a row.
fn alpha_of_row(row: usize) -> f32 {
    let t = row as f32 / (ROWS - 1) as f32;
    (t * t).max(1e-4)
}

/// The row below roughness α in [0, 1], and how far towards the next.
#[inline]
fn row_of_alpha(alpha: f32) -> (usize, f32) {
    let at = alpha.clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f32;
    let row = (at as usize).min(ROWS - 2);
    (row, at - row as f32)
}

/// A table over roughness of whatever can be mixed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ByRoughness<T>(Vec<T>);

impl<T> ByRoughness<T> {
    /// Evaluates `f` for the roughness α of each row.
    pub(super) fn new(f: impl FnMut(f32) -> T) -> Self {
        Self((0..ROWS).map(alpha_of_row).map(f).collect())
    }

    /// Mixes the two rows next to α.
    #[inline]
    pub(super) fn at<R>(&self, alpha: f32, mix: impl FnOnce(&T, &T, f32) -> R) -> R {
        let (row, t) = row_of_alpha(alpha);
        mix(&self.0[row], &self.0[row + 1], t)
    }
}
