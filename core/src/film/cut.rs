//! A film's pixels inside a rectangle, as a film of their own.

use super::{Features, Film, Gradients, HalfFilm, Image, Statistics};
use crate::lattice::{Extent, Tile};

impl Film {
    /// The pixels of a tile that lies on the film, with the differences between them. Links are left out, and so are counters, which are of the whole film.
    pub fn cut(&self, tile: Tile) -> Film {
        let image = |image: &Image| cut(image, tile);
        let half = |half: &HalfFilm| HalfFilm {
            samples: half.samples,
            primal: image(&half.primal),
            primal_variance: image(&half.primal_variance),
            direct: image(&half.direct),
            gradients: half.gradients.as_ref().map(|g| Gradients {
                dx: without_last(image(&g.dx), [1, 0]),
                dy: without_last(image(&g.dy), [0, 1]),
                dx_variance: without_last(image(&g.dx_variance), [1, 0]),
                dy_variance: without_last(image(&g.dy_variance), [0, 1]),
            }),
            graph: None,
        };
        let Features { albedo, normal, depth } = &self.features;
        Film {
            extent: Extent { width: tile.width, height: tile.height },
            halves: self.halves.each_ref().map(half),
            counts: self.counts.as_ref().map(image),
            motion: self.motion.as_ref().map(image),
            features: Features { albedo: image(albedo), normal: image(normal), depth: image(depth) },
            statistics: Statistics::default(),
        }
    }
}

fn cut(image: &Image, tile: Tile) -> Image {
    let mut out = Image::new(Extent { width: tile.width, height: tile.height }, image.channels());
    let (width, from) = (tile.width as usize, image.extent());
    for c in 0..image.channels() {
        let plane = image.plane(c);
        for (y, row) in (tile.y..).zip(out.plane_mut(c).chunks_exact_mut(width)) {
            row.copy_from_slice(&plane[from.index(tile.x, y)..][..width]);
        }
    }
    out
}

/// Sets what leads out of the film to zero: there is no such pair any more.
fn without_last(mut image: Image, [columns, rows]: [u32; 2]) -> Image {
    let Extent { width, height } = image.extent();
    for c in 0..image.channels() {
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            if x + columns >= width && columns > 0 || y + rows >= height && rows > 0 {
                image.set(x, y, c, 0.0);
            }
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_has_its_own_pixels_and_no_difference_that_leads_out() {
        let extent = Extent { width: 7, height: 5 };
        let image = |channels: usize, k: f32| {
            let values = (0..channels * extent.pixels()).map(|i| i as f32 + k).collect();
            Image::from_planes(extent, channels, values).unwrap()
        };
        let half = |k: f32| HalfFilm {
            samples: 3,
            primal: image(3, k),
            primal_variance: image(3, k + 1.0),
            direct: image(3, k + 2.0),
            gradients: Some(Gradients { dx: image(3, k), dy: image(3, k), dx_variance: image(1, k), dy_variance: image(1, k) }),
            graph: None,
        };
        let features = Features { albedo: image(3, 0.0), normal: image(3, 0.0), depth: image(1, 0.0) };
        let film = Film {
            extent,
            halves: [half(1000.0), half(2000.0)],
            counts: Some(image(1, 0.5)),
            motion: None,
            features,
            statistics: Statistics::default(),
        };
        let piece = film.cut(Tile { x: 2, y: 1, width: 3, height: 4 });
        assert_eq!(piece.extent, Extent { width: 3, height: 4 });
        for (x, y) in (0..4).flat_map(|y| (0..3).map(move |x| (x, y))) {
            for (piece, film) in piece.halves.iter().zip(&film.halves) {
                assert_eq!(piece.primal.at(x, y, 2), film.primal.at(x + 2, y + 1, 2));
                let (own, whole) = (piece.gradients.as_ref().unwrap(), film.gradients.as_ref().unwrap());
                assert_eq!(own.dx.at(x, y, 1), if x < 2 { whole.dx.at(x + 2, y + 1, 1) } else { 0.0 });
                assert_eq!(own.dy_variance.at(x, y, 0), if y < 3 { whole.dy_variance.at(x + 2, y + 1, 0) } else { 0.0 });
            }
            assert_eq!(piece.counts.as_ref().unwrap().at(x, y, 0), film.counts.as_ref().unwrap().at(x + 2, y + 1, 0));
        }
        let whole = film.cut(Tile { x: 0, y: 0, width: 7, height: 5 });
        assert_eq!(
            (whole.halves[0].primal.data(), whole.features.depth.data()),
            (film.halves[0].primal.data(), film.features.depth.data())
        );
    }
}
