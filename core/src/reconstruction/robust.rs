//! Images that outliers do not move.

use crate::film::Image;
use rayon::prelude::*;

/// Pixels of a full window: 5 × 5.
const WINDOW: usize = 25;
/// Of a full window so many smallest and so many largest values are left out.
const LEFT_OUT: usize = 3;

/// The trimmed mean over 5 × 5 pixels of an image of one channel, smaller windows at its border.
///
/// Noise of light paths is skewed: a median lies below its mean, and a mean follows every outlier. This stays near the mean and still
/// passes over a firefly.
pub(super) fn trimmed_mean(image: &Image) -> Image {
    let extent = image.extent();
    let mut out = Image::new(extent, 1);
    out.data_mut().par_chunks_mut(extent.width.max(1) as usize).enumerate().for_each(|(y, row)| {
        let rows = y.saturating_sub(2)..(y + 3).min(extent.height as usize);
        for (x, out) in row.iter_mut().enumerate() {
            let columns = x.saturating_sub(2)..(x + 3).min(extent.width as usize);
            let mut window = [0.0; WINDOW];
            let mut n = 0;
            for wy in rows.clone() {
                for wx in columns.clone() {
                    window[n] = image.data()[wy * extent.width as usize + wx];
                    n += 1;
                }
            }
            window[..n].sort_unstable_by(f32::total_cmp);
            let cut = LEFT_OUT * n / WINDOW;
            let kept = &window[cut..n - cut];
            *out = kept.iter().sum::<f32>() / kept.len() as f32;
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Extent;

    #[test]
    fn outliers_are_passed_over_and_slopes_are_kept() {
        let extent = Extent { width: 9, height: 7 };
        let mut image = Image::new(extent, 1);
        for y in 0..7 {
            for x in 0..9 {
                image.set(x, y, 0, 2.0 + x as f32 - 0.5 * y as f32);
            }
        }
        let at = |image: &Image| trimmed_mean(image).at(4, 3, 0);
        let slope = at(&image);
        assert!((slope - 4.5).abs() < 1e-6);
        image.set(5, 3, 0, 1e30);
        image.set(3, 3, 0, -1e30);
        assert!((at(&image) - slope).abs() < 0.2);
        let single = Image::from_planes(Extent { width: 1, height: 1 }, 1, vec![3.0]).unwrap();
        assert_eq!(trimmed_mean(&single), single);
    }
}
