//! The weighted screened Laplacian of a graph of pixels: (A x)ᵢ = s·xᵢ + Σⱼ wᵢⱼ (xᵢ − xⱼ).

use super::field::{Field, Row};
use super::solver::Operator;
use super::stencil::Stencil;

/// A symmetric positive definite operator with a row for each pixel.
pub(super) struct Sparse {
    width: usize,
    height: usize,
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
        let mut operator = Self { width, height, screen, starts, to: vec![0; 2 * links.len()], weights: vec![0.0; 2 * links.len()] };
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

    /// A five-point stencil near the operator. A link across a columns and b rows stands for a straight step (a·∂x + b·∂y), whose square
    /// is a² ∂x² + b² ∂y² where links lie evenly: it adds its weight a times to each of the a edges on its way, half of it on the way
    /// that goes along the row first and half on the other.
    pub(super) fn nearby(&self, links: &[[u32; 2]], weights: &[f32]) -> Stencil {
        let mut stencil = Stencil::new(self.width, self.height);
        stencil.screen.fill(self.screen);
        for ([i, j], weight) in links.iter().zip(weights) {
            let [(ax, ay), (bx, by)] = [*i, *j].map(|pixel| (pixel as usize % self.width, pixel as usize / self.width));
            let (left, right) = (ax.min(bx), ax.max(bx));
            let (columns, rows) = (0.5 * weight * (right - left) as f32, 0.5 * weight * (by - ay) as f32);
            for row in [ay, by] {
                stencil.wx[row * self.width + left..row * self.width + right].iter_mut().for_each(|w| *w += columns);
            }
            for column in [ax, bx] {
                (ay + 1..=by).for_each(|row| stencil.wy[row * self.width + column] += rows);
            }
        }
        stencil
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
