//! ꟻLIP: the difference that a person perceives when flipping between two images.
//!
//! This is the variant for displayed (LDR) images: both are clamped to [0, 1] in linear Rec.709, as a screen at exposure 1
//! shows them. Viewing conditions are the published default: 67.02 pixels a degree (0.7 m from a 0.7 m wide 3840-pixel screen).
//!
//! # Source
//! Andersson et al., "ꟻLIP: A Difference Evaluator for Alternating Images", PACM CGIT 3(2), 2020; constants from its section 4.

use super::{SizeMismatch, same_size};
use crate::film::Image;

const PIXELS_PER_DEGREE: f64 = 67.020_643_276_582_25;
/// Exponent of the colour difference.
const COLOUR_EXPONENT: f64 = 0.7;
/// Colour differences below this part of the largest …
const COLOUR_KNEE: f64 = 0.4;
/// … fill this part of the scale.
const COLOUR_SHARE: f64 = 0.95;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f64 = 0.5;
/// Width of the feature detector [degrees].
const FEATURE_WIDTH: f64 = 0.082;
/// White point D65 as XYZ.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];

/// Mean ꟻLIP over all pixels, 0 (no difference) to 1. Needs three channels; of others the answer is 0 for equal and 1 for different images.
///
/// # Errors
/// If the images differ in size.
pub fn flip(image: &Image, reference: &Image) -> Result<f64, SizeMismatch> {
    same_size(image, reference)?;
    if image.channels() != 3 || image.extent().pixels() == 0 {
        return Ok(if image == reference { 0.0 } else { 1.0 });
    }
    let (a, b) = (Opponent::new(image), Opponent::new(reference));
    let (fa, fb) = (a.features(), b.features());
    let (ca, cb) = (a.perceived(), b.perceived());
    let largest = power(hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])), COLOUR_EXPONENT);
    let knee = COLOUR_KNEE * largest;
    let pixels = ca.len();
    let mut sum = 0.0;
    for k in 0..pixels {
        let distance = power(hyab(ca[k], cb[k]), COLOUR_EXPONENT);
        let colour = if distance < knee {
            COLOUR_SHARE / knee * distance
        } else {
            COLOUR_SHARE + (distance - knee) / (largest - knee) * (1.0 - COLOUR_SHARE)
        };
        let feature = (fa[k][0] - fb[k][0]).abs().max((fa[k][1] - fb[k][1]).abs());
        let feature = power(feature * std::f64::consts::FRAC_1_SQRT_2, FEATURE_EXPONENT);
        sum += power(colour.clamp(0.0, 1.0), 1.0 - feature.clamp(0.0, 1.0));
    }
    Ok(sum / pixels as f64)
}

fn power(x: f64, e: f64) -> f64 {
    if x <= 0.0 { if e == 0.0 { 1.0 } else { 0.0 } } else { libm::pow(x, e) }
}

/// An image in the opponent space Y Cx Cz, planes.
struct Opponent {
    width: usize,
    height: usize,
    planes: [Vec<f64>; 3],
}

impl Opponent {
    fn new(image: &Image) -> Self {
        let pixels = image.extent().pixels();
        let mut planes = [vec![0.0; pixels], vec![0.0; pixels], vec![0.0; pixels]];
        for k in 0..pixels {
            let rgb = [0, 1, 2].map(|c| shown(image.plane(c)[k]));
            let [x, y, z] = normalised_xyz(rgb);
            for (plane, v) in planes.iter_mut().zip([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]) {
                plane[k] = v;
            }
        }
        Self { width: image.extent().width as usize, height: image.extent().height as usize, planes }
    }

    /// What the eye resolves of it, in Hunt-adjusted L*a*b*.
    fn perceived(&self) -> Vec<[f64; 3]> {
        // Contrast sensitivity as sums of Gaussians a·√(π/b)·exp(−π²x²/b), x in degrees.
        let radius = (3.0 * (0.04 / (2.0 * std::f64::consts::PI.powi(2))).sqrt() * PIXELS_PER_DEGREE).ceil() as usize;
        let y = self.sensitivity(0, radius, &[(1.0, 0.0047)]);
        let cx = self.sensitivity(1, radius, &[(1.0, 0.0053)]);
        let cz = self.sensitivity(2, radius, &[(34.1, 0.04), (13.5, 0.025)]);
        (0..y.len())
            .map(|k| {
                let luminance = (y[k] + 16.0) / 116.0;
                let rgb = rgb_from_normalised([luminance + cx[k] / 500.0, luminance, luminance - cz[k] / 200.0]);
                hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
            })
            .collect()
    }

    fn sensitivity(&self, plane: usize, radius: usize, terms: &[(f64, f64)]) -> Vec<f64> {
        let mut out = vec![0.0; self.planes[plane].len()];
        let mut total = 0.0;
        for (a, b) in terms {
            let kernel: Vec<f64> =
                offsets(radius).map(|x| libm::exp(-(std::f64::consts::PI * x / PIXELS_PER_DEGREE).powi(2) / b)).collect();
            let sum: f64 = kernel.iter().sum();
            let weight = a * (std::f64::consts::PI / b).sqrt() * sum * sum;
            let normalised: Vec<f64> = kernel.iter().map(|v| v / sum).collect();
            total += weight;
            for (o, v) in out.iter_mut().zip(self.filter(plane, &normalised, &normalised)) {
                *o += weight * v;
            }
        }
        out.iter_mut().for_each(|v| *v /= total);
        out
    }

    /// Strength of edges and of points at each pixel.
    fn features(&self) -> Vec<[f64; 2]> {
        let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let radius = (3.0 * sigma).ceil() as usize;
        let gauss: Vec<f64> = offsets(radius).map(|x| libm::exp(-x * x / (2.0 * sigma * sigma))).collect();
        let smooth: Vec<f64> = gauss.iter().map(|g| g / gauss.iter().sum::<f64>()).collect();
        let edge = balanced(offsets(radius).zip(&gauss).map(|(x, g)| -x * g).collect());
        let point = balanced(offsets(radius).zip(&gauss).map(|(x, g)| (x * x / (sigma * sigma) - 1.0) * g).collect());
        // Luminance on a scale of 0 to 1.
        let scaled = Opponent {
            width: self.width,
            height: self.height,
            planes: [self.planes[0].iter().map(|y| (y + 16.0) / 116.0).collect(), Vec::new(), Vec::new()],
        };
        let along = |kernel: &[f64]| (scaled.filter(0, kernel, &smooth), scaled.filter(0, &smooth, kernel));
        let ((ex, ey), (px, py)) = (along(&edge), along(&point));
        (0..ex.len()).map(|k| [(ex[k] * ex[k] + ey[k] * ey[k]).sqrt(), (px[k] * px[k] + py[k] * py[k]).sqrt()]).collect()
    }

    /// Separable correlation; beyond the border the edge pixel repeats.
    fn filter(&self, plane: usize, kernel_x: &[f64], kernel_y: &[f64]) -> Vec<f64> {
        let (w, h) = (self.width, self.height);
        let source = &self.planes[plane];
        let radius = kernel_x.len() / 2;
        let at = |i: usize, k: usize, n: usize| (i + k).saturating_sub(radius).min(n - 1);
        let mut rows = vec![0.0; w * h];
        for y in 0..h {
            for x in 0..w {
                rows[y * w + x] = kernel_x.iter().enumerate().map(|(k, g)| g * source[y * w + at(x, k, w)]).sum();
            }
        }
        let mut out = vec![0.0; w * h];
        for y in 0..h {
            for x in 0..w {
                out[y * w + x] = kernel_y.iter().enumerate().map(|(k, g)| g * rows[at(y, k, h) * w + x]).sum();
            }
        }
        out
    }
}

fn offsets(radius: usize) -> impl Iterator<Item = f64> + Clone {
    (0..=2 * radius).map(move |k| k as f64 - radius as f64)
}

/// Scales positive weights to a sum of 1 and negative ones to −1.
fn balanced(kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|v| **v > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|v| **v < 0.0).sum::<f64>();
    kernel.into_iter().map(|v| if v > 0.0 { v / positive } else { v / negative }).collect()
}

/// What a screen shows of a value; NaN is black.
fn shown(v: f32) -> f64 {
    if v > 0.0 { f64::from(v.min(1.0)) } else { 0.0 }
}

/// Rec.709 to XYZ over the white point.
fn normalised_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    let x = 0.412_390_799 * r + 0.357_584_339 * g + 0.180_480_788 * b;
    let y = 0.212_639_006 * r + 0.715_168_679 * g + 0.072_192_315 * b;
    let z = 0.019_330_819 * r + 0.119_194_780 * g + 0.950_532_152 * b;
    [x / WHITE[0], y / WHITE[1], z / WHITE[2]]
}

fn rgb_from_normalised([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (x, y, z) = (x * WHITE[0], y * WHITE[1], z * WHITE[2]);
    [
        3.240_969_942 * x - 1.537_383_178 * y - 0.498_610_760 * z,
        -0.969_243_636 * x + 1.875_967_502 * y + 0.041_555_057 * z,
        0.055_630_080 * x - 0.203_976_959 * y + 1.056_971_514 * z,
    ]
}

/// L*a*b* with chroma scaled by lightness (the Hunt effect).
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let curve = |t: f64| if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = normalised_xyz(rgb).map(curve);
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// City-block in lightness, Euclidean in chroma.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}
