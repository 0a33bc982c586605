//! A clear daytime sky with its sun, from a formula, as an environment image.
//!
//! # Source
//! Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999: appendix A.2 for the sky, A.1 for what the
//! air leaves of the sun.

use super::ImageEnvironment;
use crate::math::{Frame, PI, Vec3, sin_cos};
use crate::spectrum::Spectrum;

/// What a sky is made by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Unit direction to the sun in the sky's own frame, +Y up; y > 0.
    pub sun: Vec3,
    /// Haze, 1.7 to 10.
    pub turbidity: f64,
    /// Factor on the sky's radiance ≥ 0.
    pub sky_scale: f64,
    /// Factor on the sun's radiance ≥ 0.
    pub sun_scale: f64,
}

/// Size of the image: the sun's disk is 0.53° wide, a texel 0.35°.
const WIDTH: u32 = 1024;
const HEIGHT: u32 = 512;
/// Luminance of an even spectrum of radiance 1 W·m⁻²·sr⁻¹·nm⁻¹ [cd·m⁻²]: 683 lm/W times ∫ȳ dλ. The sky's radiance is in that unit, as
/// that of other renderers' skies is.
const LUMINANCE: f64 = 683.0 * 106.857;
/// Illuminance by the sun outside the air [lux], and its colour in linear Rec.709 (x = 0.3233, y = 0.3326; ASTM E-490).
const SUN: f64 = 133_100.0;
const SUN_COLOUR: [f64; 3] = [1.097, 0.977, 0.944];
/// Angle around the sun's centre that its light is spread over [rad]: one texel more than the disk.
const SPREAD: f32 = 0.0105;

impl Sky {
    /// The image; `axes` are the world directions of the sky's own axes. `None` if it is black.
    pub fn environment(&self, axes: Frame) -> Option<ImageEnvironment> {
        let colours = Colours::new(f64::from(self.sun.y), self.turbidity);
        let mut texels = Vec::with_capacity((WIDTH * HEIGHT) as usize);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let direction = direction(x, y);
                let sky = if direction.y > 0.0 { colours.at(direction, self.sun) } else { [0.0; 3] };
                texels.push(spectrum(sky.map(|v| v * self.sky_scale)));
            }
        }
        self.shine(&mut texels);
        ImageEnvironment::new(WIDTH, HEIGHT, texels, axes)
    }

    /// Adds the sun: a round spot that is a little wider than its disk and gives the same irradiance.
    fn shine(&self, texels: &mut [Spectrum]) {
        let weight = |x: u32, y: u32| {
            // The chord, which is the angle for small ones.
            (1.0 - (direction(x, y) - self.sun).length() / SPREAD).max(0.0)
        };
        let mut spot = Vec::new();
        let mut sum = 0.0f64;
        for y in 0..HEIGHT {
            let (sine, _) = sin_cos(PI * (y as f32 + 0.5) / HEIGHT as f32);
            let solid_angle = f64::from(sine) * 2.0 * f64::from(PI * PI) / f64::from(WIDTH * HEIGHT);
            for x in 0..WIDTH {
                let weight = weight(x, y);
                if weight > 0.0 {
                    spot.push((y * WIDTH + x, weight));
                    sum += f64::from(weight) * solid_angle;
                }
            }
        }
        let irradiance = sunlight(f64::from(self.sun.y), self.turbidity).map(|v| v * self.sun_scale);
        for (texel, weight) in spot {
            texels[texel as usize] += spectrum(irradiance.map(|v| v * f64::from(weight) / sum));
        }
    }
}

/// The direction of a texel's centre in the sky's own frame, as environment images have it.
fn direction(x: u32, y: u32) -> Vec3 {
    let (sin_phi, cos_phi) = sin_cos(2.0 * PI * ((x as f32 + 0.5) / WIDTH as f32 - 0.5));
    let (sin_theta, cos_theta) = sin_cos(PI * (y as f32 + 0.5) / HEIGHT as f32);
    Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
}

fn spectrum(rgb: [f64; 3]) -> Spectrum {
    let [r, g, b] = rgb.map(|v| v as f32);
    Spectrum::rgb(r, g, b)
}

/// What the air leaves of the sun's light, as irradiance of a surface that faces it [W·m⁻²·nm⁻¹].
fn sunlight(sine: f64, turbidity: f64) -> [f64; 3] {
    let zenith = libm::acos(sine.clamp(0.0, 1.0));
    let mass = 1.0 / (sine + 0.15 * libm::pow(93.885 - zenith.to_degrees(), -1.253));
    let beta = 0.04608 * turbidity - 0.04586;
    // Wavelengths that stand for red, green and blue [µm], and the absorption of 0.35 cm of ozone [cm⁻¹].
    let bands = [(0.61, 0.12), (0.55, 0.085), (0.465, 0.008)];
    std::array::from_fn(|c| {
        let (wavelength, ozone) = bands[c];
        let rayleigh = 0.008735 * libm::pow(wavelength, -4.08);
        let aerosol = beta * libm::pow(wavelength, -1.3);
        SUN / LUMINANCE * SUN_COLOUR[c] * libm::exp(-mass * (rayleigh + aerosol + 0.35 * ozone))
    })
}

/// Luminance and chromaticity (Y, x, y) over the dome, relative to the zenith.
struct Colours {
    /// Perez's coefficients A to E, for Y, x and y.
    shape: [[f64; 5]; 3],
    /// Values at the zenith over Perez's function there.
    zenith: [f64; 3],
}

impl Colours {
    fn new(sine: f64, turbidity: f64) -> Self {
        let t = turbidity;
        let shape = [
            [0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771, -0.0670 * t + 0.3703],
            [-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989, -0.0033 * t + 0.0452],
            [-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537, -0.0109 * t + 0.0529],
        ];
        let s = libm::acos(sine.clamp(0.0, 1.0));
        let chi = (4.0 / 9.0 - t / 120.0) * (std::f64::consts::PI - 2.0 * s);
        // In kcd·m⁻².
        let luminance = (4.0453 * t - 4.9710) * libm::tan(chi) - 0.2155 * t + 2.4192;
        let cubic = |[a, b, c, d]: [f64; 4]| ((a * s + b) * s + c) * s + d;
        let chromaticity = |rows: [[f64; 4]; 3]| (cubic(rows[0]) * t + cubic(rows[1])) * t + cubic(rows[2]);
        let x = chromaticity([
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]);
        let y = chromaticity([
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]);
        let values = [luminance * 1000.0, x, y];
        let zenith = std::array::from_fn(|k| values[k] / perez(&shape[k], 1.0, sine));
        Self { shape, zenith }
    }

    /// Radiance from a direction above the horizon, linear Rec.709 [W·m⁻²·sr⁻¹·nm⁻¹].
    fn at(&self, direction: Vec3, sun: Vec3) -> [f64; 3] {
        let (up, towards_sun) = (f64::from(direction.y), f64::from(direction.dot(sun)));
        let [luminance, x, y] = std::array::from_fn(|k| self.zenith[k] * perez(&self.shape[k], up, towards_sun));
        let tristimulus = [x / y, 1.0, (1.0 - x - y) / y].map(|v| v * luminance / LUMINANCE);
        // CIE XYZ to linear Rec.709 (IEC 61966-2-1); colours outside of it are drawn in.
        let rows = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];
        rows.map(|row: [f64; 3]| row.iter().zip(tristimulus).map(|(a, b)| a * b).sum::<f64>().max(0.0))
    }
}

/// Perez's function by the cosines of the angles to the zenith and to the sun.
fn perez([a, b, c, d, e]: &[f64; 5], up: f64, towards_sun: f64) -> f64 {
    let towards_sun = towards_sun.clamp(-1.0, 1.0);
    (1.0 + a * libm::exp(b / up.max(1e-3))) * (1.0 + c * libm::exp(d * libm::acos(towards_sun)) + e * towards_sun * towards_sun)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp::cosine_hemisphere;

    const AXES: Frame = Frame::WORLD;

    fn sky(height: f32, turbidity: f64, scales: [f64; 2]) -> Sky {
        let (sin, cos) = sin_cos(height.to_radians());
        Sky { sun: Vec3::new(cos, sin, 0.0), turbidity, sky_scale: scales[0], sun_scale: scales[1] }
    }

    /// Illuminance of level ground [lux], by uniform points of the light's own sampling.
    fn illuminance(sky: Sky) -> f64 {
        let image = sky.environment(AXES).unwrap();
        let n = 200;
        let sum: f64 = (0..n * n)
            .filter_map(|k| image.sample(0, [((k % n) as f32 + 0.5) / n as f32, ((k / n) as f32 + 0.5) / n as f32]))
            .map(|(point, density)| {
                let [r, g, b] = image.radiance(point.position).to_rgb().map(f64::from);
                (0.2126 * r + 0.7152 * g + 0.0722 * b) * f64::from(point.position.y.max(0.0)) / f64::from(density)
            })
            .sum();
        sum / f64::from(n * n) * LUMINANCE
    }

    #[test]
    fn the_sun_gives_the_irradiance_that_the_air_leaves() {
        for height in [10.0f32, 45.0, 89.0] {
            let sine = f64::from(height.to_radians()).sin();
            let [r, g, b] = sunlight(sine, 3.0);
            let expected = (0.2126 * r + 0.7152 * g + 0.0722 * b) * sine * LUMINANCE;
            let found = illuminance(sky(height, 3.0, [0.0, 1.0]));
            assert!((found / expected - 1.0).abs() < 0.02, "{height}°: {found} lux, expected {expected}");
        }
        // Measured clear skies give 60 to 100 klux at noon in summer, and a sun that is red when it is low.
        let noon = illuminance(sky(65.0, 3.0, [0.0, 1.0]));
        assert!((60_000.0..100_000.0).contains(&noon), "{noon} lux");
        let [r, _, b] = sunlight(0.05, 3.0);
        assert!(r > 5.0 * b);
    }

    #[test]
    fn the_dome_is_blue_bright_around_the_sun_and_black_below() {
        let image = sky(45.0, 2.5, [1.0, 0.0]).environment(AXES).unwrap();
        let [r, g, b] = image.radiance(Vec3::new(-0.5, 0.8, 0.1).normalize()).to_rgb();
        assert!(b > 1.5 * r && b > g, "{r} {g} {b}");
        let near = image.radiance(Vec3::new(0.8, 0.7, 0.0).normalize()).mean();
        assert!(near > 3.0 * image.radiance(Vec3::new(-0.7, 0.7, 0.0).normalize()).mean());
        assert!(image.radiance(Vec3::new(0.1, -0.5, 0.2).normalize()).is_black());
        // Ground under a clear sky without its sun gets 5 to 25 klux; this model is known to be too bright around the sun.
        let diffuse = illuminance(sky(45.0, 3.0, [1.0, 0.0]));
        assert!((5_000.0..35_000.0).contains(&diffuse), "{diffuse} lux");
        assert!(sky(45.0, 3.0, [0.0, 0.0]).environment(AXES).is_none());
    }

    #[test]
    fn the_zenith_has_its_published_luminance() {
        // T = 3, sun 60° from the zenith: χ = (4/9 − 1/40)·π/3, Y = 7.1649 tan χ + 1.7727 kcd·m⁻².
        let chi = (4.0 / 9.0 - 3.0 / 120.0) * std::f64::consts::PI / 3.0;
        let expected = (7.1649 * chi.tan() + 1.7727) * 1000.0;
        let [r, g, b] = Colours::new(0.5, 3.0).at(Vec3::Y, Vec3::new(0.75f32.sqrt(), 0.5, 0.0));
        let found = (0.2126 * r + 0.7152 * g + 0.0722 * b) * LUMINANCE;
        assert!((found / expected - 1.0).abs() < 1e-3, "{found}, expected {expected}");
    }

    #[test]
    fn sampling_by_the_image_agrees_with_sampling_by_the_cosine() {
        let sky = sky(30.0, 4.0, [1.0, 0.0]);
        let image = sky.environment(AXES).unwrap();
        let n = 300;
        let sum: f64 = (0..n * n)
            .map(|k| cosine_hemisphere([((k % n) as f32 + 0.5) / n as f32, ((k / n) as f32 + 0.5) / n as f32]))
            .map(|d| image.radiance(Vec3::new(d.x, d.z, d.y)).to_rgb().map(f64::from))
            .map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b)
            .sum();
        let by_cosine = sum / f64::from(n * n) * std::f64::consts::PI * LUMINANCE;
        assert!((illuminance(sky) / by_cosine - 1.0).abs() < 5e-3);
    }
}
