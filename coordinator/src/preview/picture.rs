//! Smaller pictures of large ones.

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;

/// The least whole factor by which an extent gets at most so many pixels.
pub(super) fn factor(extent: Extent, most: usize) -> u32 {
    (1..=extent.width.max(extent.height).max(1)).find(|factor| smaller(extent, *factor).pixels() <= most.max(1)).unwrap_or(1)
}

/// An extent divided by a whole factor, rounded up.
pub(super) fn smaller(extent: Extent, factor: u32) -> Extent {
    Extent { width: extent.width.div_ceil(factor), height: extent.height.div_ceil(factor) }
}

/// Means over squares of pixels, so that at most `most` remain. Values that are not finite count as zero.
pub fn reduce(image: &Image, most: usize) -> Image {
    let extent = image.extent();
    let factor = factor(extent, most);
    if factor == 1 {
        return image.clone();
    }
    let mut small = Image::new(smaller(extent, factor), image.channels());
    for channel in 0..image.channels() {
        for y in 0..small.extent().height {
            for x in 0..small.extent().width {
                let (columns, rows) = (x * factor..((x + 1) * factor).min(extent.width), y * factor..((y + 1) * factor).min(extent.height));
                let count = columns.len() * rows.len();
                let values = rows.flat_map(|row| columns.clone().map(move |column| (column, row)));
                let sum: f64 = values.map(|(x, y)| f64::from(image.at(x, y, channel))).filter(|value| value.is_finite()).sum();
                small.set(x, y, channel, (sum / count as f64) as f32);
            }
        }
    }
    small
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_are_means() {
        let mut image = Image::new(Extent { width: 3, height: 2 }, 1);
        image.data_mut().copy_from_slice(&[1.0, 3.0, 5.0, 2.0, f32::NAN, 7.0]);
        let small = reduce(&image, 2);
        assert_eq!(small.extent(), Extent { width: 2, height: 1 });
        assert_eq!(small.data(), [1.5, 6.0]);
        assert_eq!(reduce(&image, 6).extent(), image.extent());
        assert_eq!(reduce(&image, 0).extent().pixels(), 1);
    }
}
