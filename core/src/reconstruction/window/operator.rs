//! The window's operator: a weighted stencil over each moment, and one over each change from a moment to the next.
//!
//! With D the change along links and S_t, T_k the stencils, A x = S x + Dᵀ T D x. A stencil over changes holds w_t² in place of the primal's
//! weight and w_m² on its edges; where a pixel has no partner, or two neighbours were not displaced alike, its weights are zero.

use super::super::field::{Field, total};
use super::super::stencil::Stencil;
use super::links::Links;

/// Weights of a window, and how its moments are linked.
pub(super) struct Operator<'a> {
    pub(super) links: &'a [Option<Links>],
    /// Of each moment.
    pub(super) space: Vec<Stencil>,
    /// Of each moment but the first, over the change since the one before.
    pub(super) time: Vec<Stencil>,
    change: Field,
    weighted: Field,
}

impl<'a> Operator<'a> {
    pub(super) fn new(width: usize, height: usize, moments: usize, links: &'a [Option<Links>]) -> Self {
        let stencils = |n: usize| (0..n).map(|_| Stencil::new(width, height)).collect();
        Self {
            links,
            space: stencils(moments),
            time: stencils(moments.saturating_sub(1)),
            change: Field::new(width, height),
            weighted: Field::new(width, height),
        }
    }

    /// out = A x; returns ⟨x, A x⟩ by channel.
    pub(super) fn apply(&mut self, x: &[Field], out: &mut [Field]) -> [f64; 3] {
        for (stencil, (x, out)) in self.space.iter().zip(x.iter().zip(out.iter_mut())) {
            out.each_row(|row| stencil.apply_row(x, row.y, row.channel, row.values));
        }
        for (k, (stencil, links)) in self.time.iter().zip(self.links).enumerate() {
            change(&x[k + 1], &x[k], links.as_ref(), &mut self.change);
            let change = &self.change;
            self.weighted.each_row(|row| stencil.apply_row(change, row.y, row.channel, row.values));
            spread(&self.weighted, links.as_ref(), k, out);
        }
        inner(x, out)
    }

    /// What holds a moment, as a stencil: its own one, and those of the changes since the moment before and to the moment after as far as these
    /// are asked for. Changes only have edges between pixels that moved alike, so that theirs are edges of the moment.
    pub(super) fn block(&self, moment: usize, [since, until]: [bool; 2]) -> Stencil {
        let mut block = self.space[moment].clone();
        if let Some(time) = moment.checked_sub(1).filter(|_| since).and_then(|before| self.time.get(before)) {
            for (sum, add) in [(&mut block.screen, &time.screen), (&mut block.wx, &time.wx), (&mut block.wy, &time.wy)] {
                sum.iter_mut().zip(add).for_each(|(sum, add)| *sum += add);
            }
        }
        if let Some(time) = self.time.get(moment).filter(|_| until) {
            let (width, pixels) = (block.width, block.screen.len());
            for p in 0..pixels {
                let Some(q) = partner_ahead(self.links[moment].as_ref(), p) else { continue };
                block.screen[p] += time.screen[q];
                block.wx[p] += time.wx[q];
                if p + width < pixels && q + width < pixels {
                    block.wy[p + width] += time.wy[q + width];
                }
            }
        }
        block
    }
}

fn partner_ahead(links: Option<&Links>, earlier: usize) -> Option<usize> {
    links.map_or(Some(earlier), |links| links.ahead(earlier))
}

/// D x: what each later pixel shows more than its partner; 0 where it has none.
pub(super) fn change(later: &Field, earlier: &Field, links: Option<&Links>, out: &mut Field) {
    let (width, before) = (out.width, earlier.values());
    match links {
        None => out.each_row(|row| {
            let (later, earlier) = (later.row(row.y, row.channel), earlier.row(row.y, row.channel));
            for (out, (later, earlier)) in row.values.iter_mut().zip(later.iter().zip(earlier)) {
                *out = later - earlier;
            }
        }),
        Some(links) => out.each_line(
            || (),
            |(), y, line| {
                for x in 0..width {
                    let partner = links.back(y * width + x).map(|p| place(p, width));
                    for c in 0..3 {
                        line[c * width + x] = partner.map_or(0.0, |p| later.row(y, c)[x] - before[p + c * width]);
                    }
                }
            },
        ),
    }
}

/// Adds Dᵀ s of one pair to both of its moments.
pub(super) fn spread(s: &Field, links: Option<&Links>, pair: usize, moments: &mut [Field]) {
    moments[pair + 1].each_row(|row| row.values.iter_mut().zip(s.row(row.y, row.channel)).for_each(|(out, s)| *out += s));
    let earlier = &mut moments[pair];
    let (width, values) = (s.width, s.values());
    match links {
        None => earlier.each_row(|row| row.values.iter_mut().zip(s.row(row.y, row.channel)).for_each(|(out, s)| *out -= s)),
        Some(links) => earlier.each_line(
            || (),
            |(), y, line| {
                for x in 0..width {
                    if let Some(q) = links.ahead(y * width + x).map(|q| place(q, width)) {
                        (0..3).for_each(|c| line[c * width + x] -= values[q + c * width]);
                    }
                }
            },
        ),
    }
}

/// Where the first channel of a pixel stands in a field.
#[inline]
fn place(pixel: usize, width: usize) -> usize {
    let (y, x) = (pixel / width, pixel % width);
    3 * y * width + x
}

/// Inner products by channel, over all moments in their order.
pub(super) fn inner(a: &[Field], b: &[Field]) -> [f64; 3] {
    total(&a.iter().zip(b).map(|(a, b)| a.dot(b)).collect::<Vec<_>>())
}
