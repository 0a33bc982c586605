//! The weighted least squares of a window: weights by the errors of an image, and the residual under them.

use super::super::Measurements;
use super::super::field::Field;
use super::super::normal::{Errors, Weights, weigh};
use super::super::solver::{Solved, Squares};
use super::gradients::{Enough, Gradients, fields};
use super::links::Links;
use super::moment::HalfMoment;
use super::operator::{Operator, change, inner, spread};
use super::precondition::Preconditioner;
use super::source::Source;
use crate::film::Image;

/// How rows are weighted. Every weight is finite and ≥ 0, those of primals > 0.
pub(super) trait Rule: Sync {
    /// Weights of row y of a moment from its errors; returns its share of what is minimised.
    fn space(&self, moment: usize, y: usize, errors: &Errors, row: Weights) -> f64;

    /// The same for the change since the moment before: `row.screen` weighs the change, the others its differences. Weights where there is no
    /// link must be zero: see [`mask`].
    fn time(&self, pair: usize, y: usize, errors: &Errors, row: Weights) -> f64;
}

/// A window's measurements, its weights and the images that are solved for.
pub(super) struct System<'a> {
    source: Source<'a>,
    pub(super) operator: Operator<'a>,
    preconditioner: Preconditioner,
    gradients: Gradients,
    images: Vec<Field>,
    /// What the last weights called for.
    squares: [f64; 3],
}

impl<'a> System<'a> {
    /// From black images on.
    pub(super) fn new(source: Source<'a>) -> Self {
        let (w, h) = source.size();
        let n = source.moments.len();
        Self {
            source,
            operator: Operator::new(w, h, n, source.links),
            preconditioner: Preconditioner::new(w, h, source.links),
            gradients: Gradients::new(w, h, n),
            images: fields(w, h, n),
            squares: [0.0; 3],
        }
    }

    /// Goes on from the primals.
    pub(super) fn start_from_primals(&mut self) {
        for t in 0..self.images.len() {
            self.images[t].copy_from(&self.source.space(t).primal);
        }
    }

    /// Takes weights by the errors of the images as they are, and the residual under them. Returns what is minimised, and the residual's squared
    /// norm by channel.
    pub(super) fn weigh(&mut self, rule: &impl Rule) -> (f64, [f64; 3]) {
        let mut objective = 0.0;
        let (w, h) = self.source.size();
        let residual = &mut self.gradients.residual;
        for t in 0..self.images.len() {
            let measured = self.source.space(t);
            let set = |y: usize, errors: &Errors, row: Weights| rule.space(t, y, errors, row);
            objective += weigh(&measurements(&measured), &self.images[t], &mut self.operator.space[t], &mut residual[t], set).0;
        }
        let (mut changed, mut weighted) = (Field::new(w, h), Field::new(w, h));
        for k in 0..self.operator.time.len() {
            let links = self.source.links[k].as_ref();
            let measured = self.source.time(k);
            change(&self.images[k + 1], &self.images[k], links, &mut changed);
            let set = |y: usize, errors: &Errors, row: Weights| rule.time(k, y, errors, row);
            objective += weigh(&measurements(&measured), &changed, &mut self.operator.time[k], &mut weighted, set).0;
            spread(&weighted, links, k, residual);
        }
        self.squares = inner(residual, residual);
        (objective, self.squares)
    }

    /// Improves the images under the weights of the last [`weigh`](Self::weigh), until they are good `enough`, the residual relative to what `b`
    /// stands for (‖b‖, or where it starts), or `most` iterations are done.
    pub(super) fn improve(&mut self, b: [f64; 3], enough: Enough, most: u32) -> Solved {
        self.preconditioner.adapt(&self.operator);
        let squares = Squares { b, residual: self.squares };
        self.gradients.improve(&mut self.operator, &mut self.preconditioner, &mut self.images, squares, enough, most)
    }

    /// Squared norm of the right-hand side under the weights of the last [`weigh`](Self::weigh): of A x and the residual together.
    pub(super) fn right_hand_side(&mut self) -> [f64; 3] {
        let Gradients { residual, image, .. } = &mut self.gradients;
        self.operator.apply(&self.images, image);
        let [ab, bb] = [inner(image, residual), inner(image, image)];
        std::array::from_fn(|c| (self.squares[c] + 2.0 * ab[c] + bb[c]).max(0.0))
    }

    /// The images as they are.
    pub(super) fn images(&self) -> Vec<Image> {
        let extent = self.source.moments[0].extent();
        let of = |field: &Field| {
            let mut image = Image::new(extent, 3);
            field.copy_to(&mut image);
            image
        };
        self.images.iter().map(of).collect()
    }
}

fn measurements(half: &HalfMoment) -> Measurements<'_> {
    Measurements::new(&half.primal, &half.dx, &half.dy)
}

/// Sets to zero what stands for changes of pixels without a partner, and of neighbours that were not displaced alike.
pub(super) fn mask(links: Option<&Links>, width: usize, y: usize, row: &mut Weights) {
    let Some(links) = links else { return };
    for x in 0..width {
        let q = y * width + x;
        if links.back(q).is_none() {
            row.screen[x] = 0.0;
        }
        if links.back_together(q, 1).is_none() {
            row.wx[x] = 0.0;
        }
        if links.back_together(q, width).is_none() {
            row.wy[x] = 0.0;
        }
    }
}
