//! Which pixel of a moment shows what which pixel of the moment before showed.

use super::super::ReconstructError;
use crate::film::Image;

/// No partner.
const NONE: u32 = u32::MAX;

/// Partners between the pixels of a moment and of the one before: each has at most one, mutually.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Links {
    width: usize,
    /// For each pixel of the later moment, row-major: its partner in the earlier one.
    back: Vec<u32>,
    /// For each pixel of the earlier moment: its partner in the later one.
    ahead: Vec<u32>,
}

impl Links {
    /// From displacements (columns, rows) and validity. `None` where every pixel is its own partner. Of several pixels with one partner only
    /// the first keeps it.
    ///
    /// # Errors
    /// If a displacement of a valid pixel leads out of the image or to no pixel.
    pub(super) fn new(motion: Option<&Image>) -> Result<Option<Self>, ReconstructError> {
        let links = motion.map(Self::of).transpose()?;
        Ok(links.filter(|links| !links.are_still()))
    }

    /// The same, whether or not anything moves.
    pub(super) fn of(motion: &Image) -> Result<Self, ReconstructError> {
        let (width, pixels) = (motion.extent().width as usize, motion.extent().pixels());
        let (mut back, mut ahead) = (vec![NONE; pixels], vec![NONE; pixels]);
        for q in 0..pixels {
            let [columns, rows, valid] = [0, 1, 2].map(|c| motion.plane(c)[q]);
            if valid <= 0.0 {
                continue;
            }
            let (x, y) = ((q % width) as f32 + columns, (q / width) as f32 + rows);
            let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < motion.extent().height as f32;
            if !inside || x.fract() != 0.0 || y.fract() != 0.0 {
                return Err(ReconstructError::Motion { pixel: [(q % width) as u32, (q / width) as u32], found: [columns, rows] });
            }
            let p = y as usize * width + x as usize;
            if ahead[p] == NONE {
                (back[q], ahead[p]) = (p as u32, q as u32);
            }
        }
        Ok(Self { width, back, ahead })
    }

    /// Whether every pixel is its own partner.
    fn are_still(&self) -> bool {
        self.back.iter().enumerate().all(|(q, p)| *p as usize == q)
    }

    /// The partner of a later pixel.
    #[inline]
    pub(super) fn back(&self, later: usize) -> Option<usize> {
        let p = self.back[later];
        (p != NONE).then_some(p as usize)
    }

    /// The partner of an earlier pixel.
    #[inline]
    pub(super) fn ahead(&self, earlier: usize) -> Option<usize> {
        let q = self.ahead[earlier];
        (q != NONE).then_some(q as usize)
    }

    /// The partner of a later pixel, if the pixel `step` further on (one column or one row) was displaced alike.
    #[inline]
    pub(super) fn back_together(&self, later: usize, step: usize) -> Option<usize> {
        let p = self.back(later)?;
        // A step to the next column must not lead to the next row.
        let along = step == self.width || (later % self.width + step < self.width && p % self.width + step < self.width);
        (along && self.back.get(later + step).is_some_and(|next| *next as usize == p + step)).then_some(p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Extent;

    fn motion(width: u32, height: u32, of: impl Fn(u32, u32) -> [f32; 3]) -> Image {
        let mut image = Image::new(Extent { width, height }, 3);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            of(x, y).into_iter().enumerate().for_each(|(c, v)| image.set(x, y, c, v));
        }
        image
    }

    #[test]
    fn partners_are_mutual_and_neighbours_go_together_only_where_both_moved_alike() {
        // One column to the left: the first column was out of the picture.
        let links = Links::new(Some(&motion(4, 3, |x, _| [-1.0, 0.0, if x > 0 { 1.0 } else { 0.0 }]))).unwrap().unwrap();
        for q in 0..12 {
            assert_eq!(links.back(q), (q % 4 > 0).then(|| q - 1));
            assert_eq!(links.ahead(q), (q % 4 < 3).then(|| q + 1));
            assert_eq!(links.back_together(q, 1), (q % 4 > 0 && q % 4 < 3).then(|| q - 1), "{q}");
            assert_eq!(links.back_together(q, 4), (q % 4 > 0 && q < 8).then(|| q - 1), "{q}");
        }
        // Rows that are one after the other in memory do not touch.
        let turned =
            Links::new(Some(&motion(2, 2, |x, y| if (x, y) == (0, 0) { [1.0, 0.0, 1.0] } else { [-1.0, 1.0, (x * (1 - y)) as f32] })));
        let turned = turned.unwrap().unwrap();
        assert_eq!((turned.back(0), turned.back(1), turned.back_together(0, 1)), (Some(1), Some(2), None));
        // The second that claims a partner goes without.
        let crowded = Links::new(Some(&motion(3, 1, |x, _| [-(x as f32), 0.0, 1.0]))).unwrap().unwrap();
        assert_eq!([0, 1, 2].map(|q| crowded.back(q)), [Some(0), None, None]);
    }

    #[test]
    fn stillness_needs_no_links_and_bad_motion_is_refused() {
        assert_eq!(Links::new(None), Ok(None));
        assert_eq!(Links::new(Some(&motion(3, 2, |_, _| [0.0, 0.0, 1.0]))), Ok(None));
        for bad in [[1.0, 0.0], [0.5, 0.0], [0.0, -1.0], [f32::NAN, 0.0], [1e30, 0.0]] {
            let fault = Links::new(Some(&motion(1, 1, |_, _| [bad[0], bad[1], 1.0])));
            assert!(matches!(fault, Err(ReconstructError::Motion { pixel: [0, 0], .. })), "{fault:?}");
        }
    }
}
