//! The weighted screened Laplacian of a graph of pixels: (A x)ᵢ = s·xᵢ + Σⱼ wᵢⱼ (xᵢ − xⱼ).

use super::field::{Field, Row, dot};
use super::solver::{Operator, Precondition};

/// A symmetric positive definite operator with a row for each pixel.
pub(super) struct Sparse {
    width: usize,
    screen: f32,
    /// Where the links of each pixel start; one entry more than there are pixels.
    starts: Vec<u32>,
    /// The pixel at the other end: where its red value stands in a field.
    to: Vec<u32>,
    weights: Vec<f32>,
}

impl Sparse {
    /// The operator of a film with links (i, j), each with its weight ≥ 0.
    pub(super) fn new(width: usize, height: usize, screen: f32, links: &[[u32; 2]], weights: &[f32]) -> Self {
        let pixels = width * height;
        let mut starts = vec![0u32; pixels + 1];
        for pixel in links.iter().flatten() {
            starts[*pixel as usize + 1] += 1;
        }
        for i in 0..pixels {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut operator = Self { width, screen, starts, to: vec![0; 2 * links.len()], weights: vec![0.0; 2 * links.len()] };
        let in_field = |pixel: u32| (3 * (pixel as usize / width) * width + pixel as usize % width) as u32;
        for ([i, j], weight) in links.iter().zip(weights) {
            for (from, to) in [(*i, *j), (*j, *i)] {
                let place = next[from as usize] as usize;
                next[from as usize] += 1;
                operator.to[place] = in_field(to);
                operator.weights[place] = *weight;
            }
        }
        operator
    }

    /// The inverse of the diagonal.
    pub(super) fn diagonal(&self) -> Diagonal {
        let weight = |links: &[u32]| self.weights[links[0] as usize..links[1] as usize].iter().sum::<f32>();
        Diagonal { width: self.width, inverse: self.starts.windows(2).map(|links| 1.0 / (self.screen + weight(links))).collect() }
    }
}

/// Jacobi's preconditioner: one over the diagonal.
pub(super) struct Diagonal {
    width: usize,
    inverse: Vec<f32>,
}

impl Precondition for Diagonal {
    fn precondition(&mut self, r: &Field, z: &mut Field) -> [f64; 3] {
        z.sum_rows(|Row { y, channel, values }| {
            let (inverse, r) = (&self.inverse[y * self.width..(y + 1) * self.width], r.row(y, channel));
            for (z, (r, inverse)) in values.iter_mut().zip(r.iter().zip(inverse)) {
                *z = r * inverse;
            }
            dot(values, r)
        })
    }
}

impl Operator for Sparse {
    #[inline]
    fn row(&self, x: &Field, Row { y, channel, values }: &mut Row) {
        let here = x.row(*y, *channel);
        let shifted = &x.values()[*channel * self.width..];
        let starts = &self.starts[*y * self.width..];
        for (column, out) in values.iter_mut().enumerate() {
            let own = here[column];
            let links = starts[column] as usize..starts[column + 1] as usize;
            let pairs = self.to[links.clone()].iter().zip(&self.weights[links]);
            *out = pairs.fold(self.screen * own, |sum, (to, weight)| sum + weight * (own - shifted[*to as usize]));
        }
    }
}
