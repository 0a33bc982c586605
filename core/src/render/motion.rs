//! Motion vectors: which pixel of the moment before saw what a pixel sees now.
//!
//! Each pixel looks through its centre, follows the material point that it meets to where it was, and that to the film of the moment
//! before. The pixel there does the same the other way round. Where each is the other's answer and both see the same shape, they are
//! partners: so no pixel has two, and what one of them hides from the other has none. Half A of a pixel with a partner draws the
//! numbers that half B of its partner drew.
//!
//! # Source
//! Manzi, Kettunen, Durand, Zwicker and Lehtinen, "Temporal Gradient-Domain Path Tracing", ACM TOG 35(6), 2016, 5.2. There partners may
//! be a pixel apart; here the map is a bijection between the pixels that have one.

use crate::geometry::ShapeId;
use crate::lattice::{Extent, Half, Tile};
use crate::math::Vec3;
use crate::scene::Scene;
use crate::sensor::View;

#[cfg(test)]
mod tests;

/// Set in the column of a key that belongs to a pixel without a partner, so that it shares its numbers with no pixel that has one.
const ALONE: u32 = 1 << 31;

/// The partners of a tile's pixels.
pub(super) struct Motion {
    tile: Tile,
    partners: Vec<Option<[u32; 2]>>,
}

impl Motion {
    /// Finds them, between the scene as it is and as the moment before saw it.
    pub(super) fn of_tile(now: &Scene, before: &Scene, extent: Extent, tile: Tile) -> Motion {
        let (now, before) = (Eye::new(now, extent), Eye::new(before, extent));
        let places = (tile.y..tile.y + tile.height).flat_map(|y| (tile.x..tile.x + tile.width).map(move |x| [x, y]));
        Motion { tile, partners: places.map(|place| partner(&now, &before, place)).collect() }
    }

    /// The pixel that saw before what a pixel of the tile sees now.
    pub(super) fn partner(&self, [x, y]: [u32; 2]) -> Option<[u32; 2]> {
        self.partners[(y - self.tile.y) as usize * self.tile.width as usize + (x - self.tile.x) as usize]
    }

    /// The pixel that a sample draws its numbers as.
    #[inline]
    pub(super) fn key(&self, place: [u32; 2], half: Half) -> [u32; 2] {
        match half {
            Half::A => self.partner(place).unwrap_or([place[0] | ALONE, place[1]]),
            Half::B => place,
        }
    }
}

fn partner(now: &Eye, before: &Eye, place: [u32; 2]) -> Option<[u32; 2]> {
    let (partner, shape) = now.follow(before, place)?;
    let (back, seen) = before.follow(now, partner)?;
    (back == place && seen == shape).then_some(partner)
}

/// A scene and how its camera sees it.
struct Eye<'a> {
    scene: &'a Scene,
    view: View,
    extent: Extent,
}

impl<'a> Eye<'a> {
    fn new(scene: &'a Scene, extent: Extent) -> Self {
        Self { scene, view: scene.sensor.view(extent), extent }
    }

    /// The pixel at which the other eye looks for what a pixel sees here, and the shape that it is; no shape where the ray leaves the scene.
    fn follow(&self, other: &Eye, [x, y]: [u32; 2]) -> Option<([u32; 2], Option<ShapeId>)> {
        let ray = self.view.ray([x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
        let Some(hit) = self.scene.world.closest(&ray) else {
            if other.view.is_parallel() {
                // Every pixel looks the same way: nothing tells which one saw this.
                return Some(([x, y], None));
            }
            return Some((other.pixel(other.view.project_direction(ray.direction)?)?, None));
        };
        let surface = self.scene.world.surface(&ray, &hit);
        let there: Vec3 = self.scene.world.carry(&surface, &other.scene.world)?;
        Some((other.pixel(other.view.project(there)?)?, Some(surface.shape)))
    }

    /// The pixel at a film position.
    fn pixel(&self, film: [f32; 2]) -> Option<[u32; 2]> {
        let [x, y] = film.map(|v| v.floor() as i64);
        self.extent.contains(x, y).then_some([x as u32, y as u32])
    }
}
