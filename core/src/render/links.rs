//! Which pixels are linked: those that look at nearly the same thing, as either of the two would choose.
//!
//! Each pixel ranks the pixels of a window around it, by their distance on the film and by how much their features differ, and picks
//! the first few. A link is where two pixels pick each other. It is a pure function of scene and plan: tiles see enough of their
//! surroundings to agree about it.
//!
//! # Source
//! Manzi, Rousselle, Kettunen, Lehtinen and Zwicker, "Improved Sampling for Gradient-Domain Metropolis Light Transport", ACM TOG 33(6), 2014.

use super::features::{Feature, Features};
use crate::lattice::Tile;
use crate::plan::Plan;
use crate::scene::Scene;

#[cfg(test)]
mod tests;

/// How far linked pixels lie apart at most, in columns and in rows.
const REACH: u32 = 2;
/// Weight of normals that differ, by 1 − cosine.
const NORMAL: f32 = 50.0;
/// Weight of the distance from each other's tangent plane, over pixels of displacement, squared.
const PLANE: f32 = 4.0;
/// Weight of the relative difference of albedos, squared.
const ALBEDO: f32 = 20.0;
/// Features that differ by more are never linked.
const MOST: f32 = 20.0;

/// The links of a tile's pixels.
pub(super) struct Links {
    links: Vec<Vec<[i64; 2]>>,
}

impl Links {
    /// Finds the links of the pixels of a tile.
    pub(super) fn of_tile(scene: &Scene, plan: &Plan, tile: Tile) -> Self {
        let features = Features::of_tile(scene, plan.extent, grown(tile, 2 * REACH, plan));
        let around = grown(tile, REACH, plan);
        let picks: Vec<Vec<[u32; 2]>> = places(around).map(|place| picked(&features, plan, place)).collect();
        let of = |[x, y]: [u32; 2]| &picks[(y - around.y) as usize * around.width as usize + (x - around.x) as usize];
        let links = places(tile).map(|place| {
            let mutual = of(place).iter().filter(|other| of(**other).contains(&place));
            mutual.map(|[x, y]| [i64::from(*x) - i64::from(place[0]), i64::from(*y) - i64::from(place[1])]).collect()
        });
        Self { links: links.collect() }
    }

    /// The displacements (columns, rows) of a pixel's links, by its index within the tile; the most similar first.
    pub(super) fn of(&self, pixel: usize) -> impl Iterator<Item = [i64; 2]> {
        self.links[pixel].iter().copied()
    }
}

/// The tile with so many pixels more on every side, as far as the film goes.
fn grown(tile: Tile, by: u32, plan: &Plan) -> Tile {
    let (x, y) = (tile.x.saturating_sub(by), tile.y.saturating_sub(by));
    let end = |start: u32, size: u32, film: u32| start.saturating_add(size).saturating_add(by).min(film);
    Tile { x, y, width: end(tile.x, tile.width, plan.extent.width) - x, height: end(tile.y, tile.height, plan.extent.height) - y }
}

fn places(tile: Tile) -> impl Iterator<Item = [u32; 2]> {
    (tile.y..tile.y + tile.height).flat_map(move |y| (tile.x..tile.x + tile.width).map(move |x| [x, y]))
}

/// The pixels that one would be linked to, the most similar first. Ties go to the earlier row, then to the earlier column.
fn picked(features: &Features, plan: &Plan, [x, y]: [u32; 2]) -> Vec<[u32; 2]> {
    let window = grown(Tile { x, y, width: 1, height: 1 }, REACH, plan);
    let here = features.at(x, y);
    let mut ranked: Vec<(f32, [u32; 2])> = places(window)
        .filter(|place| *place != [x, y])
        .filter_map(|[tx, ty]| Some((unlike(here, features.at(tx, ty), [tx.abs_diff(x), ty.abs_diff(y)])?, [tx, ty])))
        .collect();
    // The sort is stable, and places come row by row.
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().take(plan.links as usize).map(|(_, place)| place).collect()
}

/// How unlike two pixels are, the same from either side; `None` where they have nothing to do with each other.
fn unlike(a: &Feature, b: &Feature, [dx, dy]: [u32; 2]) -> Option<f32> {
    let apart = (dx * dx + dy * dy) as f32;
    if a.kind != b.kind {
        return None;
    }
    let turned = NORMAL * (1.0 - a.normal.dot(b.normal)).max(0.0);
    let way = b.position - a.position;
    let (from_a, from_b) = (a.normal.dot(way), b.normal.dot(way));
    let pixel = a.footprint.max(b.footprint);
    let off = PLANE * (from_a * from_a + from_b * from_b) / (pixel * pixel * apart).max(f32::MIN_POSITIVE);
    let colour = a.albedo - b.albedo;
    let brighter = a.albedo.square_sum().max(b.albedo.square_sum());
    let colour = ALBEDO * colour.square_sum() / (brighter + 1e-4);
    let features = turned + off + colour;
    // Not a number counts as unlike, too.
    (features <= MOST).then_some(apart + features)
}
