//! One base path for a whole set of pixels: the base and its images under the shifts to all others share its light.
//!
//! The formula of `pair`, for more than two. With T the shifts, which must compose (T_im = T_km ∘ T_ik), and the balance heuristic
//! over all strategies s and over all pixels m of the set, the base path x of pixel i gives pixel k
//!
//! ```text
//! fₖ(yₖ) |T′ᵢₖ| / D,   D = Σₘ |T′ᵢₘ| Σₛ pₛ(yₘ),   yₘ = Tᵢₘ(x),   yᵢ = x:
//! ```
//!
//! D is the same from whichever image the path was drawn, up to the Jacobian that measures it, so the weights of all pixels add up
//! to one, and each pixel's estimate is unbiased on its own. Where a shift has no answer, value and density are zero. As in `pair`,
//! everything is kept relative to the density of the base path.
//!
//! # Source
//! Bauszat, Petitjean and Eisemann, "Gradient-Domain Path Reusing", ACM TOG 36(6), 2017.

use super::offset::{Shared, There, advance, connected, copied, passage_known, scatter};
use crate::path::{Joint, OffsetEnd, OffsetSubpath, Strategy, Subpath};
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// An image of the base path that is still on its way.
#[derive(Clone, Copy, Debug)]
struct Image {
    /// Which pixel of the set.
    pixel: usize,
    /// Throughput over the base path's density: f |T′| / p.
    throughput: Spectrum,
    /// ρ: density times |T′| over that of the base path [1].
    ratio: f64,
    /// What it makes of the joint at hand.
    there: There,
}

impl Image {
    /// |T′| times the density of the joint at hand, relative to the base path up to there.
    #[inline]
    fn density(&self) -> f64 {
        self.ratio * self.there.jacobian * self.there.density
    }

    /// Throughput times |T′| times the value of the joint at hand.
    #[inline]
    fn value(&self) -> Spectrum {
        self.throughput * self.there.value * (self.there.jacobian as f32)
    }
}

/// Shares base paths among the pixels of a set. Holds nothing between paths but its memory.
#[derive(Clone, Debug, Default)]
pub struct Sharing {
    /// Images that have not failed, by pixel.
    images: Vec<Image>,
}

impl Sharing {
    /// Adds what the base path of pixel `own` gives to each pixel of the set, and returns the shadow rays that it took.
    ///
    /// `images` are its shifts by pixel, all by a shift that composes; the entry of `own` is not read. `sums` has one entry a pixel.
    pub fn share(&mut self, scene: &Scene, base: &Subpath, own: usize, images: &[OffsetSubpath], sums: &mut [Spectrum]) -> u32 {
        let mut here = base.camera.passage.weight();
        let camera = base.camera.passage.density;
        self.images.clear();
        self.images.extend(images.iter().enumerate().filter(|(pixel, _)| *pixel != own).map(|(pixel, offset)| Image {
            pixel,
            throughput: offset.camera.value / camera,
            ratio: f64::from(offset.camera.density) / f64::from(camera),
            there: There::NOTHING,
        }));
        let mut rays = 0;
        let mut joints = &base.joints[..];
        for (k, vertex) in base.vertices.iter().enumerate() {
            self.images.retain(|image| !matches!(images[image.pixel].end, OffsetEnd::Failed { at, .. } if at == k));
            let Some(first) = self.images.first() else {
                sums[own] += here * base.radiance[k];
                return rays;
            };
            let (at_vertex, rest) = joints.split_at(joints.iter().take_while(|j| j.vertex as usize == k).count());
            joints = rest;
            // Where a path joins is its own affair, so all images do at once; shifts that do not compose lose the others.
            let joins = |image: &Image| matches!(images[image.pixel].end, OffsetEnd::Rejoined { at } if at == k);
            let all_join = joins(first);
            self.images.retain(|image| joins(image) == all_join);
            if all_join {
                self.joined(scene, base, k, here, at_vertex, own, images, sums);
                return rays;
            }
            let step = base.steps.get(k);
            for joint in at_vertex.iter().filter(|joint| vertex.connectable || joint.point.delta) {
                for image in &mut self.images {
                    let offset = &images[image.pixel];
                    let shifted = &offset.vertices[k];
                    image.there = if shifted.connectable || joint.point.delta {
                        connected(scene, vertex, shifted, joint, passage_known(offset, base, k, joint), &mut rays)
                    } else {
                        There::NOTHING
                    };
                }
                self.weigh(here, (joint.value(), f64::from(joint.density())), joint.survival, own, sums);
            }
            let Some(step) = step else { return rays };
            if !vertex.connectable {
                let hit = at_vertex.iter().find(|joint| joint.strategy == Strategy::Hit);
                for image in &mut self.images {
                    let offset = &images[image.pixel];
                    image.there = if offset.vertices[k].connectable { There::NOTHING } else { copied(scene, offset, k, step) };
                }
                let density = f64::from(step.evaluation.density) * f64::from(step.leg.passage.density);
                self.weigh(here, (hit.map_or(Spectrum::BLACK, Joint::value), density), step.survival, own, sums);
            }
            self.images.retain_mut(|image| {
                let offset = &images[image.pixel];
                let Some(turned) = offset.steps.get(k) else { return false };
                let there = scatter(scene, &offset.vertices[k], step, turned.wi);
                (image.throughput, image.ratio) = advance((image.throughput, image.ratio), step, there, turned);
                true
            });
            here *= step.weight();
        }
        rays
    }

    /// The first shared vertex sees each image come from elsewhere; beyond it everything is shared.
    #[expect(clippy::too_many_arguments, reason = "the state of one walk, handed over where it ends")]
    fn joined(
        &mut self,
        scene: &Scene,
        base: &Subpath,
        k: usize,
        here: Spectrum,
        joints: &[Joint],
        own: usize,
        images: &[OffsetSubpath],
        sums: &mut [Spectrum],
    ) {
        let vertex = &base.vertices[k];
        let shared = |image: &Image| Shared::new(scene, vertex, images[image.pixel].vertices[k - 1].position);
        for joint in joints {
            for image in &mut self.images {
                image.there = shared(image).joint(scene, joint);
            }
            self.weigh(here, (joint.value(), f64::from(joint.density())), joint.survival, own, sums);
        }
        let (Some(step), Some(radiance)) = (base.steps.get(k), base.radiance.get(k + 1)) else { return };
        if radiance.is_black() {
            return;
        }
        let mut density = 1.0;
        for image in &mut self.images {
            let (there, turned) = shared(image).step(scene, step);
            (image.throughput, image.ratio) = advance((image.throughput, image.ratio), step, there, &turned);
            density += image.ratio;
        }
        let scale = (1.0 / density) as f32;
        for image in &self.images {
            sums[image.pixel] += image.throughput * *radiance * scale;
        }
        sums[own] += here * step.weight() * *radiance * scale;
    }

    /// Adds a joint, weighted, given its value and density on the base path.
    #[inline]
    fn weigh(&self, here: Spectrum, (value, density): (Spectrum, f64), survival: f32, own: usize, sums: &mut [Spectrum]) {
        let all = self.images.iter().fold(density, |sum, image| sum + image.density());
        if all <= 0.0 {
            return;
        }
        let scale = (1.0 / all) as f32 / survival;
        for image in &self.images {
            sums[image.pixel] += image.value() * scale;
        }
        sums[own] += here * value * scale;
    }
}
