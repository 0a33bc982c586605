//! Images of images: what a method shows, where it is wrong, and a part of it close up.

use gradfarm_core::film::Image;
use gradfarm_core::lattice::{Extent, Tile};
use gradfarm_core::metrics::REL_MSE_FLOOR;

/// Relative squared errors from blue (10⁻⁴ and less) over green and yellow to red (1 and more): a decade a colour.
pub fn error_map(image: &Image, reference: &Image) -> Image {
    let mut out = Image::new(image.extent(), 3);
    for i in 0..image.extent().pixels() {
        for (c, value) in false_colour(relative(image, reference, i)).into_iter().enumerate() {
            out.plane_mut(c)[i] = value;
        }
    }
    out
}

/// Mean over channels of the squared error over the squared grey value, as relMSE counts it.
fn relative(image: &Image, reference: &Image, pixel: usize) -> f64 {
    let at = |image: &Image, c: usize| f64::from(image.plane(c)[pixel]);
    let grey = (0..3).map(|c| at(reference, c)).sum::<f64>() / 3.0;
    let square = (0..3).map(|c| (at(image, c) - at(reference, c)).powi(2)).sum::<f64>() / 3.0;
    square / (grey * grey + REL_MSE_FLOOR)
}

/// Colours of 10⁻⁴, 10⁻³, … 1, in linear light.
const COLOURS: [[f32; 3]; 5] = [[0.01, 0.01, 0.12], [0.02, 0.2, 0.6], [0.05, 0.55, 0.15], [0.95, 0.75, 0.05], [0.85, 0.05, 0.03]];

/// The colour of a relative squared error.
pub fn false_colour(error: f64) -> [f32; 3] {
    let place = (error.max(1e-4).log10() + 4.0).clamp(0.0, 4.0) as f32;
    let first = (place as usize).min(COLOURS.len() - 2);
    let share = place - first as f32;
    std::array::from_fn(|c| COLOURS[first][c] * (1.0 - share) + COLOURS[first + 1][c] * share)
}

/// The part of the film, a third of it in each direction, where `worst` is furthest from the reference.
pub fn telling_part(worst: &Image, reference: &Image) -> Tile {
    let extent = worst.extent();
    let (width, height) = (extent.width.div_ceil(3), extent.height.div_ceil(3));
    let mut best = (f64::NEG_INFINITY, Tile { x: 0, y: 0, width, height });
    // A grid of half a part is fine enough, and fireflies must not decide alone: each pixel counts at most 1.
    for y in (0..=extent.height - height).step_by((height / 2).max(1) as usize) {
        for x in (0..=extent.width - width).step_by((width / 2).max(1) as usize) {
            let row = |y: u32| (x..x + width).map(move |x| relative(worst, reference, extent.index(x, y)).min(1.0));
            let sum: f64 = (y..y + height).flat_map(row).sum();
            if sum > best.0 {
                best = (sum, Tile { x, y, width, height });
            }
        }
    }
    best.1
}

/// A part of an image. The tile lies on it.
pub fn part(image: &Image, tile: Tile) -> Image {
    let mut out = Image::new(Extent { width: tile.width, height: tile.height }, image.channels());
    for c in 0..image.channels() {
        for y in 0..tile.height {
            for x in 0..tile.width {
                out.set(x, y, c, image.at(tile.x + x, tile.y + y, c));
            }
        }
    }
    out
}

/// The exposure that brings the reference's mean grey to a fifth; 1 for black images.
pub fn exposure(reference: &Image) -> f32 {
    // Of bright sources no more than ten times the white: a lamp in view must not darken the rest.
    let grey = reference.data().iter().map(|v| v.clamp(0.0, 10.0)).sum::<f32>() / reference.data().len().max(1) as f32;
    if grey > 0.0 { 0.2 / grey } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_climb_by_decades() {
        assert_eq!(false_colour(0.0), COLOURS[0]);
        assert_eq!(false_colour(1e9), COLOURS[4]);
        for (k, colour) in COLOURS.iter().enumerate() {
            let found = false_colour(10f64.powi(k as i32 - 4));
            assert!(found.iter().zip(colour).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
        }
    }

    #[test]
    fn the_part_with_the_errors_is_shown() {
        let extent = Extent { width: 30, height: 21 };
        let mut reference = Image::new(extent, 3);
        reference.data_mut().fill(1.0);
        let mut image = reference.clone();
        (12..14).for_each(|y| (22..28).for_each(|x| image.set(x, y, 1, 3.0)));
        // One pixel beyond all measure elsewhere.
        image.set(2, 2, 0, 1e6);
        let tile = telling_part(&image, &reference);
        assert!(tile.lies_on(extent) && tile.contains(22, 12) && tile.contains(27, 13), "{tile:?}");
        assert_eq!(part(&image, tile).at(22 - tile.x, 12 - tile.y, 1), 3.0);
        let map = error_map(&image, &reference);
        assert_eq!([0, 1, 2].map(|c| map.at(2, 2, c)), COLOURS[4]);
        assert_eq!([0, 1, 2].map(|c| map.at(0, 0, c)), COLOURS[0]);
        assert!((exposure(&reference) - 0.2).abs() < 1e-6);
    }

    #[test]
    fn films_of_one_pixel_have_parts() {
        let image = Image::new(Extent { width: 1, height: 1 }, 3);
        assert_eq!(telling_part(&image, &image), Tile { x: 0, y: 0, width: 1, height: 1 });
    }
}
