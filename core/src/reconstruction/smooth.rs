//! Means over squares of pixels: what turns an estimate from one pixel into one that can be weighed by.

use rayon::prelude::*;

/// The mean of each pixel's square of `radius` pixels to each side, as far as it lies on the image. Sums run directly: a running sum would
/// carry the rounding of a spike through its whole row.
pub(super) fn smoothed(values: &[f32], width: usize, height: usize, radius: usize) -> Vec<f32> {
    let mut rows = vec![0.0f32; values.len()];
    if values.is_empty() {
        return rows;
    }
    rows.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(out, row)| {
        for k in 0..=radius.min(width - 1) {
            // Both sides at once; the middle once.
            for (out, v) in out[..width - k].iter_mut().zip(&row[k..]) {
                *out += v;
            }
            if k > 0 {
                for (out, v) in out[k..].iter_mut().zip(row) {
                    *out += v;
                }
            }
        }
        for (x, out) in out.iter_mut().enumerate() {
            *out /= reach(x, width, radius).len() as f32;
        }
    });
    let mut means = vec![0.0f32; values.len()];
    means.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let lines = reach(y, height, radius);
        let share = 1.0 / lines.len() as f32;
        for line in lines {
            for (out, v) in out.iter_mut().zip(&rows[line * width..]) {
                *out += v;
            }
        }
        out.iter_mut().for_each(|v| *v *= share);
    });
    means
}

/// The places within `radius` of a place.
fn reach(place: usize, length: usize, radius: usize) -> std::ops::Range<usize> {
    place.saturating_sub(radius)..(place + radius + 1).min(length)
}

#[cfg(test)]
mod tests {
    use super::smoothed;

    #[test]
    fn squares_are_averaged_and_borders_are_narrower() {
        for (width, height) in [(1, 1), (7, 5), (1, 6), (9, 1)] {
            let values: Vec<f32> = (0..width * height).map(|k| (k * k % 17) as f32).collect();
            for radius in [0, 1, 3, 12] {
                let means = smoothed(&values, width, height, radius);
                for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                    let (rows, columns) = (super::reach(y, height, radius), super::reach(x, width, radius));
                    let all: Vec<f32> = rows.flat_map(|y| columns.clone().map(move |x| y * width + x)).map(|i| values[i]).collect();
                    let mean = all.iter().sum::<f32>() / all.len() as f32;
                    assert!((means[y * width + x] - mean).abs() < 1e-4, "{width}×{height}, {radius}");
                }
            }
        }
    }

    #[test]
    fn smoothing_keeps_constants_and_spreads_one_value_over_its_window() {
        const RADIUS: usize = 3;
        for (w, h) in [(1, 1), (1, 9), (5, 2), (12, 10)] {
            let plane = vec![2.5; w * h];
            let plane = smoothed(&plane, w, h, RADIUS);
            assert!(plane.iter().all(|v| (v - 2.5).abs() < 1e-5));
        }
        let (w, h) = (20, 20);
        let mut plane = vec![0.0; w * h];
        plane[10 * w + 10] = 49.0;
        let plane = smoothed(&plane, w, h, RADIUS);
        for y in 0..h {
            for x in 0..w {
                let inside = x.abs_diff(10) <= RADIUS && y.abs_diff(10) <= RADIUS;
                assert!((plane[y * w + x] - if inside { 1.0 } else { 0.0 }).abs() < 1e-5);
            }
        }
    }
}
