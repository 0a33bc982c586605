//! Lights without a surface: domains.

use super::super::description::{Environment, Light};
use super::super::error::Error;
use super::Check;

impl Check<'_> {
    pub(super) fn light(&self, path: &str, light: &Light) -> Result<(), Error> {
        let kind = match light {
            Light::Point(_) => "point",
            Light::Spot(_) => "spot",
            Light::Directional(_) => "directional",
        };
        self.transform(&format!("{path}.{kind}.to_world"), light.to_world())?;
        match light {
            Light::Point(point) => {
                self.position(&format!("{path}.point.position"), point.position)?;
                self.colour(&format!("{path}.point.intensity"), point.intensity, f64::INFINITY)
            }
            Light::Spot(spot) => {
                self.position(&format!("{path}.spot.position"), spot.position)?;
                self.direction(&format!("{path}.spot.direction"), spot.direction)?;
                self.colour(&format!("{path}.spot.intensity"), spot.intensity, f64::INFINITY)?;
                if !(spot.outer_angle > 0.0 && spot.outer_angle <= 180.0) {
                    return self.invalid(&format!("{path}.spot.outer_angle"), spot.outer_angle, "an angle in (0, 180] degrees");
                }
                if !(0.0..=spot.outer_angle).contains(&spot.inner_angle) {
                    let expected = format!("an angle from 0 to outer_angle, {} degrees", spot.outer_angle);
                    return self.invalid(&format!("{path}.spot.inner_angle"), spot.inner_angle, expected);
                }
                Ok(())
            }
            Light::Directional(light) => {
                self.direction(&format!("{path}.directional.direction"), light.direction)?;
                self.colour(&format!("{path}.directional.irradiance"), light.irradiance, f64::INFINITY)
            }
        }
    }

    pub(super) fn environment(&self, environment: &Environment) -> Result<(), Error> {
        let given = [environment.radiance.is_some(), environment.image.is_some(), environment.sky.is_some()];
        let count = given.iter().filter(|is_given| **is_given).count();
        if count != 1 {
            return self.invalid("environment", format!("{count} of them"), "exactly one of `radiance`, `image` and `sky`");
        }
        if let Some(radiance) = environment.radiance {
            self.colour("environment.radiance", radiance, f64::INFINITY)?;
        }
        if let Some(image) = &environment.image {
            self.file_name("environment.image.file", &image.file)?;
            self.transform("environment.image.to_world", &image.to_world)?;
            self.colour("environment.image.scale", image.scale, f64::INFINITY)?;
        }
        if let Some(sky) = &environment.sky {
            self.direction("environment.sky.sun_direction", sky.sun_direction)?;
            if sky.sun_direction[1] <= 0.0 {
                return self.invalid("environment.sky.sun_direction", format!("{:?}", sky.sun_direction), "a sun above the horizon, y > 0");
            }
            if !(1.7..=10.0).contains(&sky.turbidity) {
                return self.invalid("environment.sky.turbidity", sky.turbidity, "1.7 to 10");
            }
            for (field, scale) in [("sky_scale", sky.sky_scale), ("sun_scale", sky.sun_scale)] {
                if !(scale >= 0.0 && (scale as f32).is_finite()) {
                    return self.invalid(&format!("environment.sky.{field}"), scale, "a finite factor ≥ 0");
                }
            }
            self.transform("environment.sky.to_world", &sky.to_world)?;
        }
        Ok(())
    }

    fn position(&self, path: &str, position: [f64; 3]) -> Result<(), Error> {
        if position.iter().all(|x| (*x as f32).is_finite()) {
            return Ok(());
        }
        self.invalid(path, format!("{position:?}"), "finite numbers")
    }

    fn direction(&self, path: &str, direction: [f64; 3]) -> Result<(), Error> {
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 && length.is_finite() {
            return Ok(());
        }
        self.invalid(path, format!("{direction:?}"), "a direction: finite numbers, not all zero")
    }
}
