//! What each pixel looks at, from one ray through its centre: features by which similar pixels are told.

use crate::lattice::{Extent, Tile};
use crate::math::Vec3;
use crate::path::{Vertex, walk};
use crate::scene::Scene;
use crate::sensor::View;
use crate::spectrum::Spectrum;

/// What the ray of a pixel's centre meets behind mirrors and glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feature {
    /// The materials met up to there and how each was left, in one number. Rays that leave the scene have one too.
    pub(super) kind: u64,
    /// World position.
    pub(super) position: Vec3,
    /// Unit shading normal on the side that was met; zero where the ray left the scene, so that such pixels are like no other.
    pub(super) normal: Vec3,
    /// Reflectance [1].
    pub(super) albedo: Spectrum,
    /// Size of a pixel at that distance, across the ray [scene units].
    pub(super) footprint: f32,
}

/// Delta lobes that the ray follows at most.
const CHAIN: u32 = 6;
/// The number that every choice on the way is made by: of two things that can happen, the likelier does.
const CHOICE: f32 = 0.5;

/// The features of a run of pixels.
pub(super) struct Features {
    tile: Tile,
    features: Vec<Feature>,
}

impl Features {
    /// Traces a ray for each pixel of the tile.
    pub(super) fn of_tile(scene: &Scene, extent: Extent, tile: Tile) -> Self {
        let view = scene.sensor.view(extent);
        let pixel = PixelSize::of(&view, extent);
        let places = (tile.y..tile.y + tile.height).flat_map(|y| (tile.x..tile.x + tile.width).map(move |x| [x, y]));
        Self { tile, features: places.map(|place| look(scene, &view, pixel, place)).collect() }
    }

    /// The feature of a pixel of the tile.
    #[inline]
    pub(super) fn at(&self, x: u32, y: u32) -> &Feature {
        &self.features[(y - self.tile.y) as usize * self.tile.width as usize + (x - self.tile.x) as usize]
    }
}

/// How far the rays of neighbouring pixels are apart at the middle of the film: where they start, and for each unit of distance.
#[derive(Clone, Copy)]
struct PixelSize {
    start: f32,
    slope: f32,
}

impl PixelSize {
    fn of(view: &View, extent: Extent) -> Self {
        let (x, y) = (0.5 * extent.width as f32, 0.5 * extent.height as f32);
        let (a, b) = (view.ray([x - 0.5, y], [0.5; 2]), view.ray([x + 0.5, y], [0.5; 2]));
        Self { start: (b.origin - a.origin).length(), slope: (b.direction - a.direction).length() }
    }
}

fn look(scene: &Scene, view: &View, pixel: PixelSize, [x, y]: [u32; 2]) -> Feature {
    let mut ray = view.ray([x as f32 + 0.5, y as f32 + 0.5], [0.5; 2]);
    let mut medium = scene.around;
    let mut kind = 0u64;
    let mut distance = 0.0;
    let mut tell = |number: u32| kind = (kind ^ u64::from(number)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    for link in 0..=CHAIN {
        let (_, arrival) = walk(scene, &ray, medium, |_| CHOICE);
        let Some(mut vertex) = Vertex::arrived(scene, &arrival, ray.direction, 0.0) else { break };
        distance += (vertex.position - ray.origin).length();
        tell(match vertex.matter {
            crate::path::Matter::Surface(material) => 2 * material,
            crate::path::Matter::Medium(medium) => 2 * medium.0 + 1,
        });
        let choice = vertex.decide(scene, || CHOICE);
        if vertex.delta
            && link < CHAIN
            && let Some(scatter) = vertex.sample(scene, choice, [CHOICE; 2])
        {
            tell(1 + u32::from(vertex.wo.z * vertex.frame.normal.dot(scatter.wi) < 0.0));
            ray = vertex.leave(scatter.wi);
            medium = vertex.medium_towards(scatter.wi);
            continue;
        }
        return Feature {
            kind,
            position: vertex.position,
            normal: if vertex.wo.z < 0.0 { -vertex.frame.normal } else { vertex.frame.normal },
            albedo: vertex.albedo(scene),
            footprint: pixel.start + pixel.slope * distance,
        };
    }
    Feature { kind, position: Vec3::ZERO, normal: Vec3::ZERO, albedo: Spectrum::BLACK, footprint: 1.0 }
}
