//! A biased image drawn towards an unbiased one as far as it pays: a combination of the James–Stein kind.
//!
//! Of all images U + λ (F − U) between an unbiased U and a biased F the one of least mean squared error has
//! λ = Cov(U, U − F) / E(U − F)². Two halves that know nothing of each other estimate both: the covariance from their differences, the
//! rest from their mean. Both are smoothed over a neighbourhood, relative to its brightness, so that λ hardly depends on the noise that it
//! weighs, and the two halves have one λ. With more samples the covariance falls and the bias stays, so λ falls to 0: whatever F is, the
//! image converges to the truth, and at the rate of U.
//!
//! # Source
//! After Gu, Iwasaki, Hachisuka et al., "Neural James-Stein Combiner for Unbiased and Biased Renderings", ACM TOG 41(6), 2022, with
//! smoothed estimates from halves in place of the network; James and Stein, "Estimation with Quadratic Loss", 1961.

use super::smooth::smoothed;
use crate::film::Image;

/// Pixels to each side over which covariance and distance are smoothed.
const RADIUS: usize = 6;
/// Squared brightness below which differences are not taken relatively any more, over the squared mean.
const DARK: f64 = 1e-2;

/// How far each pixel goes from the unbiased to the biased image, in [0, 1].
fn shares(unbiased: [&Image; 2], biased: [&Image; 2]) -> Vec<f32> {
    let extent = biased[0].extent();
    let (width, height) = (extent.width as usize, extent.height as usize);
    let grey = |i: usize| -> f64 { (0..3).map(|c| f64::from(biased[0].plane(c)[i]) + f64::from(biased[1].plane(c)[i])).sum::<f64>() / 6.0 };
    let pixels = extent.pixels();
    let mean = (0..pixels).map(|i| grey(i).abs()).sum::<f64>() / pixels.max(1) as f64;
    let (mut covariance, mut distance) = (vec![0.0f32; pixels], vec![0.0f32; pixels]);
    for i in 0..pixels {
        let weight = 1.0 / (grey(i) * grey(i) + DARK * mean * mean);
        let (mut together, mut apart) = (0.0, 0.0);
        for c in 0..3 {
            let at = |image: &Image| f64::from(image.plane(c)[i]);
            let (ua, ub) = (at(unbiased[0]), at(unbiased[1]));
            let (va, vb) = (ua - at(biased[0]), ub - at(biased[1]));
            together += 0.25 * (ua - ub) * (va - vb);
            apart += 0.25 * (va + vb) * (va + vb);
        }
        (covariance[i], distance[i]) = ((weight * together) as f32, (weight * apart) as f32);
    }
    for values in [&mut covariance, &mut distance] {
        *values = smoothed(&smoothed(values, width, height, RADIUS), width, height, RADIUS);
    }
    let share = |(covariance, distance): (&f32, &f32)| {
        let share = covariance / distance;
        // Where both images are one there is nothing to choose, and where numbers end the unbiased one is the safe one.
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    };
    covariance.iter().zip(&distance).map(share).collect()
}

/// Draws the halves of a biased image towards those of an unbiased one.
pub(super) fn drawn(unbiased: [Image; 2], biased: &[Image; 2]) -> [Image; 2] {
    let shares = shares([&unbiased[0], &unbiased[1]], [&biased[0], &biased[1]]);
    let mut halves = unbiased;
    for (image, biased) in halves.iter_mut().zip(biased) {
        for c in 0..3 {
            for ((u, f), share) in image.plane_mut(c).iter_mut().zip(biased.plane(c)).zip(&shares) {
                *u += share * (f - *u);
            }
        }
    }
    halves
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Extent;

    /// Mean share of a constant bias of 0.2 against noise of that standard deviation in each half.
    fn share(deviation: f32) -> f64 {
        let extent = Extent { width: 64, height: 48 };
        let noisy = |seed: usize| {
            let mut image = crate::reconstruction::tests::random(extent, seed, deviation * 12f32.sqrt());
            image.data_mut().iter_mut().for_each(|v| *v += 1.0);
            image
        };
        let mut off = Image::new(extent, 3);
        off.data_mut().fill(1.2);
        let (a, b) = (noisy(1), noisy(2));
        let shares = shares([&a, &b], [&off, &off]);
        let [x, y] = drawn([a.clone(), b.clone()], &[off.clone(), off]);
        assert!(deviation > 0.0 || (x == a && y == b), "without noise the unbiased image stays");
        shares.iter().map(|share| f64::from(*share)).sum::<f64>() / shares.len() as f64
    }

    #[test]
    fn the_share_is_that_of_least_squared_error_and_falls_with_the_noise() {
        for deviation in [0.0f32, 0.03, 0.1, 0.3, 1.0] {
            // Of the mean of two halves.
            let variance = f64::from(deviation * deviation) / 2.0;
            let best = variance / (variance + 0.04);
            let found = share(deviation);
            assert!((found - best).abs() < 0.05, "{deviation}: {found} against {best}");
        }
    }
}
