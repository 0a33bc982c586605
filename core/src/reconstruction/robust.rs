//! Images that outliers do not move.

use crate::film::Image;
use rayon::prelude::*;

/// The median over 3 × 3 pixels of an image of one channel, smaller windows at its border.
pub(super) fn median3(image: &Image) -> Image {
    let extent = image.extent();
    let mut out = Image::new(extent, 1);
    out.data_mut().par_chunks_mut(extent.width.max(1) as usize).enumerate().for_each(|(y, row)| {
        let rows = y.saturating_sub(1)..(y + 2).min(extent.height as usize);
        for (x, out) in row.iter_mut().enumerate() {
            let columns = x.saturating_sub(1)..(x + 2).min(extent.width as usize);
            let mut window = [0.0; 9];
            let mut n = 0;
            for wy in rows.clone() {
                for wx in columns.clone() {
                    window[n] = image.data()[wy * extent.width as usize + wx];
                    n += 1;
                }
            }
            *out = *window[..n].select_nth_unstable_by(n / 2, f32::total_cmp).1;
        }
    });
    out
}
