//! Contact sheets: small pictures of many frames on one page.

use super::{Error, png};
use crate::lattice::Extent;

/// Widest picture of a frame on the sheet [pixels].
const WIDEST: u32 = 192;
/// Pixels of a sheet at which its pictures become smaller.
const PIXELS: u64 = 1 << 26;
/// Pixels between pictures.
const GAP: u32 = 4;

/// A sheet while its frames come in, in any order.
#[derive(Clone, Debug)]
pub struct ContactSheet {
    frame: Extent,
    cell: Extent,
    columns: u32,
    page: Extent,
    pixels: Vec<u8>,
}

impl ContactSheet {
    /// Most pictures in a row where nothing else was asked.
    pub const COLUMNS: u32 = 8;

    /// A dark page for so many frames of this size, with at most so many in a row, all ≥ 1. Few frames make a square, very many ones small
    /// pictures.
    pub fn new(frame: Extent, frames: u32, columns: u32) -> Self {
        let (frames, most) = (frames.max(1), columns.max(1));
        let columns = (1..=most).find(|columns| columns.saturating_mul(*columns) >= frames).unwrap_or(most);
        let rows = frames.div_ceil(columns);
        let edge = |count: u32, picture: u32| u64::from(count) * u64::from(picture + GAP) + u64::from(GAP);
        let mut cell = cell(frame, WIDEST);
        let mut widest = WIDEST;
        while widest > 1 && edge(columns, cell.width) * edge(rows, cell.height) > PIXELS {
            widest /= 2;
            cell = self::cell(frame, widest);
        }
        let page = Extent { width: edge(columns, cell.width) as u32, height: edge(rows, cell.height) as u32 };
        Self { frame, cell, columns, page, pixels: vec![24; 3 * page.pixels()] }
    }

    /// Puts the picture of the k-th frame in its place: red, green and blue of each of its pixels, row by row. Each pixel of the sheet is the
    /// mean of those that it stands for, of their light and not of their bytes. Pictures of other sizes and beyond the page are left out.
    pub fn place(&mut self, k: u32, pixels: &[u8]) {
        let (column, row) = (k % self.columns, k / self.columns);
        let (x0, y0) = (GAP + column * (self.cell.width + GAP), GAP + row * (self.cell.height + GAP));
        if pixels.len() != 3 * self.frame.pixels() || y0 + self.cell.height > self.page.height {
            return;
        }
        let linear: Vec<f32> = (0..=255u8).map(png::linear).collect();
        for y in 0..self.cell.height {
            for x in 0..self.cell.width {
                let columns = span(x, self.cell.width, self.frame.width);
                let rows = span(y, self.cell.height, self.frame.height);
                let mut sum = [0.0f32; 3];
                for from_y in rows.clone() {
                    for from_x in columns.clone() {
                        let at = 3 * self.frame.index(from_x, from_y);
                        (0..3).for_each(|c| sum[c] += linear[usize::from(pixels[at + c])]);
                    }
                }
                let count = (columns.len() * rows.len()) as f32;
                let to = 3 * self.page.index(x0 + x, y0 + y);
                (0..3).for_each(|c| self.pixels[to + c] = png::byte(sum[c] / count));
            }
        }
    }

    /// The sheet as a PNG file.
    ///
    /// # Errors
    /// If the encoder fails.
    pub fn encode(&self) -> Result<Vec<u8>, Error> {
        png::encode_bytes(self.page, &self.pixels)
    }
}

/// The size of a picture that is no wider than this, and no larger than the frame.
fn cell(frame: Extent, widest: u32) -> Extent {
    let width = frame.width.clamp(1, widest);
    let height = (u64::from(frame.height) * u64::from(width) / u64::from(frame.width.max(1))).clamp(1, 4 * u64::from(widest)) as u32;
    Extent { width, height }
}

/// The pixels of a frame that the k-th of `cells` stands for: at least one.
fn span(k: u32, cells: u32, pixels: u32) -> std::ops::Range<u32> {
    let at = |k: u32| (u64::from(k) * u64::from(pixels) / u64::from(cells)) as u32;
    at(k)..at(k + 1).max(at(k) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_stand_in_rows_and_keep_their_light() {
        let frame = Extent { width: 384, height: 100 };
        let mut sheet = ContactSheet::new(frame, 5, 8);
        assert_eq!((sheet.columns, sheet.cell), (3, Extent { width: 192, height: 50 }));
        // Columns of black and white: half the light of white.
        let stripes: Vec<u8> = (0..3 * frame.pixels()).map(|i| if (i / 3).is_multiple_of(2) { 0 } else { 255 }).collect();
        sheet.place(4, &stripes);
        sheet.place(9, &stripes);
        sheet.place(0, &[1, 2, 3]);
        let (extent, pixels) = png::decode(&sheet.encode().unwrap()).unwrap();
        assert_eq!(extent, Extent { width: 3 * 196 + 4, height: 2 * 54 + 4 });
        let at = |x: u32, y: u32| pixels[3 * extent.index(x, y)];
        assert_eq!((at(200, 58), at(391, 107), at(199, 58), at(4, 4)), (188, 188, 24, 24));
    }

    #[test]
    fn any_number_of_frames_of_any_size_fits() {
        let long = ContactSheet::new(Extent { width: 1920, height: 1080 }, 100_000, 8);
        assert!(long.page.pixels() as u64 <= PIXELS && long.columns == 8, "{:?}", long.page);
        assert_eq!(ContactSheet::new(Extent { width: 16, height: 9 }, 48, 12).columns, 7);
        assert_eq!(ContactSheet::new(Extent { width: 16, height: 9 }, 48, 4).columns, 4);
        for (width, height, frames) in [(1, 1, 1), (1, 5000, 3), (5000, 1, 64), (16, 9, 65), (640, 480, 0)] {
            let frame = Extent { width, height };
            let mut sheet = ContactSheet::new(frame, frames, ContactSheet::COLUMNS);
            let white = vec![255; 3 * frame.pixels()];
            (0..frames).for_each(|k| sheet.place(k, &white));
            let shown = sheet.pixels.iter().filter(|byte| **byte == 255).count();
            assert_eq!(shown, 3 * sheet.cell.pixels() * frames as usize, "{width} × {height}, {frames}");
        }
    }
}
