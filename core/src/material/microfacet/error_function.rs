//! The error function and its inverse.

/// erf(x), by the portable library: the same bits everywhere.
#[inline]
pub(super) fn erf(x: f32) -> f32 {
    libm::erff(x)
}

/// The inverse of erf on (−1, 1), to a relative error of 3·10⁻⁷ or so.
///
/// # Source
/// Giles, "Approximating the erfinv Function", GPU Computing Gems Jade Edition, 2011, single precision.
#[inline]
pub(super) fn inverse_erf(x: f32) -> f32 {
    let w = -libm::logf((1.0 - x) * (1.0 + x));
    let polynomial = |w: f32, c: [f32; 9]| c.into_iter().reduce(|sum, term| sum * w + term).unwrap_or(0.0);
    if w < 5.0 {
        let c = [
            2.810_226_4e-8,
            3.432_739_4e-7,
            -3.523_387_7e-6,
            -4.391_506_5e-6,
            2.185_808_7e-4,
            -1.253_725e-3,
            -4.177_681_6e-3,
            0.246_640_73,
            1.501_409_4,
        ];
        x * polynomial(w - 2.5, c)
    } else {
        let c = [
            -2.002_142_6e-4,
            1.009_505_6e-4,
            1.349_343_2e-3,
            -3.673_428_4e-3,
            5.739_507_7e-3,
            -7.622_461_3e-3,
            9.438_870_5e-3,
            1.001_674,
            2.832_976_8,
        ];
        x * polynomial(w.sqrt() - 3.0, c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_function() {
        for k in -38..=38 {
            let x = k as f32 * 0.1;
            let back = inverse_erf(erf(x));
            // Where erf is flat, one unit in its last place moves x by this much.
            let slack = 2e-6 + 1.2e-7 * libm::expf(x * x);
            assert!((back - x).abs() < slack * x.abs().max(1.0), "{x}: {back}");
        }
    }
}
