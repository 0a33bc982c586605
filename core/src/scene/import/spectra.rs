//! Spectra of other renderers as colours in linear Rec.709: sampled curves and black bodies, seen by the CIE 1931 observer.
//!
//! The observer is Wyman's fit, good to about one percent; what is converted here is a colour, and the reports say so.
//!
//! # Source
//! Wyman, Sloan, Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013, equation 4.
//! CIE standard illuminant D65, ISO 11664-2, at every twentieth nanometre.

use crate::scene::description::Colour;

/// First wavelength that is seen [nm].
const FIRST: u32 = 380;
/// Last wavelength that is seen [nm].
const LAST: u32 = 780;

/// D65 at 380, 400, … 780 nm.
const D65: [f64; 21] = [
    49.9755, 82.7549, 93.4318, 104.865, 117.812, 115.923, 109.354, 104.790, 104.405, 100.0, 95.788, 90.0062, 87.6987, 83.6992, 80.2146,
    78.2842, 71.6091, 61.604, 75.087, 46.4182, 63.3828,
];

/// Planck's first and second radiation constants for radiance per wavelength [W·m²·sr⁻¹] and [m·K].
const PLANCK: (f64, f64) = (1.191_042_972e-16, 1.438_776_877e-2);

/// A curve of values over wavelengths [nm], which rise; linear in between, zero outside.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve(pub(super) Vec<(f64, f64)>);

impl Curve {
    /// The value at a wavelength [nm].
    pub(super) fn at(&self, wavelength: f64) -> f64 {
        let after = self.0.partition_point(|(at, _)| *at < wavelength);
        match (after.checked_sub(1).and_then(|before| self.0.get(before)), self.0.get(after)) {
            (_, Some((at, value))) if *at == wavelength => *value,
            (Some((a, low)), Some((b, high))) => low + (high - low) * (wavelength - a) / (b - a),
            _ => 0.0,
        }
    }

    /// The colour of a surface that reflects so, in the light of D65: the curve that is 1 everywhere is white. Clipped to [0, 1].
    pub(super) fn reflectance(&self) -> Colour {
        Colour(self.plain().0.map(|channel| channel.min(1.0)))
    }

    /// The colour of numbers that are no reflectances, such as indices of refraction: as `reflectance`, but of any size ≥ 0.
    pub(super) fn plain(&self) -> Colour {
        let white = rgb(integral(d65));
        let lit = rgb(integral(|wavelength| self.at(wavelength) * d65(wavelength)));
        Colour([0, 1, 2].map(|channel| (lit[channel] / white[channel]).max(0.0)))
    }

    /// The colour of light with this curve: the curve that is 1 everywhere has luminance 1.
    pub(super) fn radiance(&self) -> Colour {
        radiance(|wavelength| self.at(wavelength))
    }
}

/// The colour of light that is `value` at every wavelength; it is a little red, since white is D65 and that is not flat.
pub(super) fn flat(value: f64) -> Colour {
    radiance(|_| value)
}

/// The colour of a black body [W·sr⁻¹·m⁻²·nm⁻¹] at a temperature [K].
pub(super) fn black_body(kelvin: f64) -> Colour {
    radiance(|wavelength| {
        let metres = wavelength * 1e-9;
        let per_metre = PLANCK.0 / (metres * metres * metres * metres * metres) / libm::expm1(PLANCK.1 / (metres * kelvin));
        per_metre * 1e-9
    })
}

fn radiance(curve: impl Fn(f64) -> f64) -> Colour {
    let flat = integral(|_| 1.0)[1];
    Colour(rgb(integral(curve).map(|part| part / flat)).map(|channel| channel.max(0.0)))
}

fn d65(wavelength: f64) -> f64 {
    let place = (wavelength - f64::from(FIRST)) / 20.0;
    let before = (place.floor() as usize).min(D65.len() - 2);
    D65[before] + (D65[before + 1] - D65[before]) * (place - before as f64)
}

/// X, Y and Z of a curve, summed over whole nanometres.
fn integral(curve: impl Fn(f64) -> f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for wavelength in (FIRST..=LAST).map(f64::from) {
        let value = curve(wavelength);
        for (sum, matching) in sum.iter_mut().zip(observer(wavelength)) {
            *sum += matching * value;
        }
    }
    sum
}

/// The colour matching functions x̄, ȳ, z̄.
fn observer(wavelength: f64) -> [f64; 3] {
    let lobe = |peak: f64, mean: f64, below: f64, above: f64| {
        let t = (wavelength - mean) * if wavelength < mean { below } else { above };
        peak * libm::exp(-0.5 * t * t)
    };
    [
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ]
}

/// XYZ to linear Rec.709 (IEC 61966-2-1).
fn rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_479 * x - 1.537_150 * y - 0.498_535 * z,
        -0.969_256 * x + 1.875_991 * y + 0.041_556 * z,
        0.055_648 * x - 0.204_043 * y + 1.057_311 * z,
    ]
}

/// A number in [0, 1] of sRGB's transfer curve, made linear.
pub(super) fn from_srgb(value: f64) -> f64 {
    if value <= 0.040_45 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: Colour, expected: [f64; 3], within: f64) {
        let near = found.0.iter().zip(expected).all(|(a, b)| (a - b).abs() <= within * b.max(0.1));
        assert!(near, "{found:?} is not {expected:?}");
    }

    /// The numbers are those of Mitsuba 3.9.1 in its RGB mode.
    #[test]
    fn curves_have_the_colours_that_another_renderer_gives_them() {
        let curve = Curve(vec![(400.0, 0.1), (500.0, 0.5), (600.0, 0.9), (700.0, 0.2)]);
        close(curve.reflectance(), [0.833826, 0.689122, 0.265243], 0.02);
        close(curve.radiance(), [0.974324, 0.661608, 0.229711], 0.03);
        close(flat(2.0), [2.40959, 1.89658, 1.81783], 0.01);
        close(Curve(vec![(300.0, 0.5), (900.0, 0.5)]).reflectance(), [0.5; 3], 0.01);
    }

    #[test]
    fn black_bodies_follow_planck() {
        // Wien: the peak of 5000 K lies at 580 nm with 1.28e4 W·sr⁻¹·m⁻²·nm⁻¹; hotter is bluer.
        let Colour([red, green, blue]) = black_body(5000.0);
        assert!(red > green && green > blue, "{red} {green} {blue}");
        assert!((0.2126 * red + 0.7152 * green + 0.0722 * blue - 1.26e4).abs() < 400.0);
        let Colour([red, _, blue]) = black_body(10_000.0);
        assert!(blue > red);
    }

    #[test]
    fn srgb_is_decoded() {
        assert!((from_srgb(0.5) - 0.214_041).abs() < 1e-5 && from_srgb(1.0) == 1.0 && from_srgb(0.0) == 0.0);
    }
}
