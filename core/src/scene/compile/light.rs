//! Lights that are no surfaces.

use super::{spectrum, unsupported};
use crate::light::{Environment, Light};
use crate::scene::assets::Assets;
use crate::scene::description::SceneDescription;
use crate::scene::error::Error;

/// The lights without a surface, in the order of the description, the environment last.
pub(super) fn compile(description: &SceneDescription, _assets: &dyn Assets) -> Result<Vec<Light>, Error> {
    if !description.lights.is_empty() {
        return Err(unsupported("lights", "a light without a surface"));
    }
    let Some(environment) = description.environment.as_ref().filter(|environment| !environment.is_black()) else { return Ok(Vec::new()) };
    let radiance = environment.radiance.ok_or_else(|| unsupported("environment", "an image or a sky"))?;
    Ok(vec![Light::Environment(Environment { radiance: spectrum(radiance) })])
}
