//! Where measurements live: the lattice of pixels (and, later, frames and wavelength bins), and the pieces it is cut into.

/// Size of a film or image [pixels].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Extent {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Extent {
    /// Number of pixels.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether the (signed) pixel lies on the lattice.
    pub fn contains(self, x: i64, y: i64) -> bool {
        x >= 0 && y >= 0 && x < i64::from(self.width) && y < i64::from(self.height)
    }

    /// Index of a pixel in row-major order.
    pub fn index(self, x: u32, y: u32) -> usize {
        y as usize * self.width as usize + x as usize
    }

    /// Cuts the lattice into tiles of at most `edge × edge` pixels, row by row. Tile `k` of the result has index `k`.
    pub fn tiles(self, edge: u32) -> Vec<Tile> {
        let edge = edge.max(1);
        let mut tiles = Vec::new();
        for y in (0..self.height).step_by(edge as usize) {
            for x in (0..self.width).step_by(edge as usize) {
                tiles.push(Tile { x, y, width: edge.min(self.width - x), height: edge.min(self.height - y) });
            }
        }
        tiles
    }
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns, ≥ 1.
    pub width: u32,
    /// Rows, ≥ 1.
    pub height: u32,
}

impl Tile {
    /// Number of pixels.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether a pixel lies on the tile.
    pub fn contains(self, x: u32, y: u32) -> bool {
        (self.x..self.x + self.width).contains(&x) && (self.y..self.y + self.height).contains(&y)
    }

    /// Whether the tile lies wholly on a lattice of this extent.
    pub fn lies_on(self, extent: Extent) -> bool {
        self.width > 0
            && self.height > 0
            && self.x.checked_add(self.width).is_some_and(|end| end <= extent.width)
            && self.y.checked_add(self.height).is_some_and(|end| end <= extent.height)
    }
}

/// A run of sample indices `first .. first + count` of every pixel of a tile.
///
/// Even indices belong to half A of the film, odd ones to half B.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SampleRange {
    /// First sample index.
    pub first: u32,
    /// How many.
    pub count: u32,
}

impl SampleRange {
    /// One past the last sample index.
    pub fn end(self) -> u32 {
        self.first + self.count
    }

    /// How many of the samples belong to the given half.
    pub fn count_of(self, half: Half) -> u32 {
        let upto = |n: u32| match half {
            Half::A => n.div_ceil(2),
            Half::B => n / 2,
        };
        upto(self.end()) - upto(self.first)
    }

    /// Cuts `0 .. samples` into runs of `batch` samples; the cut depends on nothing else, so that sums have one shape.
    pub fn batches(samples: u32, batch: u32) -> Vec<SampleRange> {
        let batch = batch.max(1);
        (0..samples).step_by(batch as usize).map(|first| SampleRange { first, count: batch.min(samples - first) }).collect()
    }
}

/// One of the two independent halves that every film is kept in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Half {
    /// Even sample indices.
    A,
    /// Odd sample indices.
    B,
}

impl Half {
    /// Both halves, in order.
    pub const ALL: [Half; 2] = [Half::A, Half::B];

    /// The half that a sample index belongs to.
    pub fn of_sample(index: u32) -> Half {
        if index.is_multiple_of(2) { Half::A } else { Half::B }
    }

    /// 0 for A, 1 for B.
    pub fn index(self) -> usize {
        match self {
            Half::A => 0,
            Half::B => 1,
        }
    }
}

/// A run of frames that show the same scene: it is rendered once.
///
/// Its halves have keys of their own: half B of a moment and half A of the next one share theirs, and with it all random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Moment {
    /// Its first frame.
    pub first: u32,
    /// The frame after its last.
    pub end: u32,
}

impl Moment {
    /// A single frame.
    pub fn of(frame: u32) -> Moment {
        Moment { first: frame, end: frame.wrapping_add(1) }
    }

    /// The part of every random number's key that stands for time.
    pub fn key(self, half: Half) -> u32 {
        match half {
            Half::A => self.first,
            Half::B => self.end,
        }
    }
}

/// A dimension of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    /// Columns.
    X,
    /// Rows.
    Y,
}

/// One step on the lattice: the neighbour that a base path is shifted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Offset {
    /// Along which dimension.
    pub axis: Axis,
    /// +1 (forward) or −1 (backward).
    pub step: i8,
}

impl Offset {
    /// The four neighbours in the image plane, in the order in which the film stores them.
    pub const IMAGE: [Offset; 4] = [
        Offset { axis: Axis::X, step: 1 },
        Offset { axis: Axis::X, step: -1 },
        Offset { axis: Axis::Y, step: 1 },
        Offset { axis: Axis::Y, step: -1 },
    ];

    /// Position in [`Offset::IMAGE`].
    pub fn index(self) -> usize {
        let axis = match self.axis {
            Axis::X => 0,
            Axis::Y => 2,
        };
        if self.step > 0 { axis } else { axis + 1 }
    }

    /// Displacement in pixels (columns, rows).
    pub fn displacement(self) -> (i64, i64) {
        match self.axis {
            Axis::X => (i64::from(self.step), 0),
            Axis::Y => (0, i64::from(self.step)),
        }
    }

    /// The step back.
    pub fn reversed(self) -> Offset {
        Offset { axis: self.axis, step: -self.step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_partition_the_lattice() {
        let extent = Extent { width: 37, height: 21 };
        for edge in [1, 5, 16, 64] {
            let mut seen = vec![0u8; extent.pixels()];
            for tile in extent.tiles(edge) {
                assert!(tile.lies_on(extent));
                for y in tile.y..tile.y + tile.height {
                    for x in tile.x..tile.x + tile.width {
                        seen[extent.index(x, y)] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1));
        }
    }

    #[test]
    fn halves_share_every_range() {
        for (first, count) in [(0, 1), (0, 2), (1, 1), (3, 4), (4, 5), (7, 8)] {
            let range = SampleRange { first, count };
            let a = (first..first + count).filter(|&s| Half::of_sample(s) == Half::A).count() as u32;
            assert_eq!(range.count_of(Half::A), a);
            assert_eq!(range.count_of(Half::B), count - a);
        }
    }

    #[test]
    fn offsets_know_their_place() {
        for (k, offset) in Offset::IMAGE.into_iter().enumerate() {
            assert_eq!(offset.index(), k);
            assert_eq!(offset.reversed().reversed(), offset);
        }
    }
}
