//! A made room of any size for benches: bumpy closed walls, balls, long slats and floating debris, the same bits on every run,
//! and the rays of a path tracer in it.

use gradfarm_core::geometry::{Mesh, ShapeId, World, WorldBuilder};
use gradfarm_core::math::{Frame, Ray, Vec3, segment, spawn};
use gradfarm_core::sampling::{Dimension, SampleKey, SampleStream, warp};

/// Half the edge of the room.
const HALF: f32 = 4.0;

fn stream(x: u32, y: u32) -> SampleStream {
    SampleStream::open(SampleKey { seed: 11, frame: 0, x, y, index: 0 })
}

/// Three numbers in [−1, 1).
fn triple(s: &SampleStream, vertex: usize) -> Vec3 {
    let [a, b] = s.pair(Dimension::direction(vertex));
    Vec3::new(a, b, s.number(Dimension::lobe(vertex))) * 2.0 - 1.0
}

/// Six faces of `n` × `n` quads on a cube; the bumps are a function of the place on the cube, so that edges fit to the bit.
fn walls(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for face in 0..6usize {
        let (axis, far) = (face % 3, face >= 3);
        let first = mesh.positions.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                let along = |k: u32| k as f32 / n as f32 * 2.0 - 1.0;
                let mut p = Vec3::ZERO;
                p[axis] = if far { 1.0 } else { -1.0 };
                p[(axis + 1) % 3] = along(i);
                p[(axis + 2) % 3] = along(j);
                let (a, b, c) = (libm::sinf(9.0 * p.x), libm::sinf(11.0 * p.y + 1.0), libm::sinf(8.0 * p.z + 2.0));
                let ripple = libm::sinf(61.0 * (p.x + p.y)) * libm::sinf(57.0 * (p.y - p.z));
                mesh.positions.push(p * (HALF * (1.0 + 0.03 * a * b * c + 0.002 * ripple)));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let at = |i: u32, j: u32| first + j * (n + 1) + i;
                let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                mesh.triangles.push([quad[0], quad[1], quad[2]]);
                mesh.triangles.push([quad[0], quad[2], quad[3]]);
            }
        }
    }
    mesh
}

fn ball(mesh: &mut Mesh, centre: Vec3, radius: f32, rings: u32) {
    let columns = 2 * rings;
    let first = mesh.positions.len() as u32;
    for i in 0..=rings {
        for j in 0..columns {
            let (s, c) = libm::sincosf(i as f32 / rings as f32 * std::f32::consts::PI);
            let (t, u) = libm::sincosf(j as f32 / columns as f32 * std::f32::consts::TAU);
            mesh.positions.push(centre + Vec3::new(s * u, s * t, c) * radius);
        }
    }
    for i in 0..rings {
        for j in 0..columns {
            let at = |i: u32, j: u32| first + i * columns + j % columns;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
}

/// A bar with square ends between two points.
fn slat(mesh: &mut Mesh, from: Vec3, to: Vec3, thickness: f32) {
    let frame = Frame::from_normal((to - from).normalize());
    let first = mesh.positions.len() as u32;
    for end in [from, to] {
        for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            mesh.positions.push(end + frame.to_world(Vec3::new(a, b, 0.0)) * thickness);
        }
    }
    for k in 0..4 {
        let quad = [k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4].map(|v| first + v);
        mesh.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
    }
    for base in [0, 4] {
        let v = |k: u32| first + base + k;
        mesh.triangles.extend([[v(0), v(1), v(2)], [v(0), v(2), v(3)]]);
    }
}

/// About `triangles` triangles: half of them walls, the rest balls, slats and debris.
pub(crate) fn room(triangles: usize) -> Mesh {
    let edge = (triangles as f32 * 0.5 / 12.0).sqrt() as u32;
    let mut mesh = walls(edge);
    let rings = ((triangles as f32 * 0.3 / 12.0 / 4.0).sqrt() as u32).max(3);
    for k in 0..12 {
        let s = stream(k, 1);
        ball(&mut mesh, triple(&s, 0) * (HALF * 0.75), 0.2 + 0.5 * s.number(Dimension::lobe(1)), rings);
    }
    for k in 0..(triangles / 150).min(400) as u32 {
        let s = stream(k, 2);
        let (a, b) = (triple(&s, 0) * (HALF * 0.9), triple(&s, 1));
        slat(&mut mesh, a, (a + b * 2.0).clamp(Vec3::splat(-HALF * 0.9), Vec3::splat(HALF * 0.9)), 0.004);
    }
    let size = 4.0 / (triangles as f32).sqrt();
    let mut k = 0;
    while mesh.triangles.len() < triangles {
        let s = stream(k, 3);
        let centre = triple(&s, 0) * (HALF * 0.9);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend((1..4).map(|v| centre + triple(&s, v) * size));
        mesh.triangles.push([first, first + 1, first + 2]);
        k += 1;
    }
    mesh
}

/// The room with its trees.
pub(crate) fn world(mesh: Mesh) -> World {
    WorldBuilder { meshes: vec![(mesh, ShapeId(0))], ..WorldBuilder::default() }.build()
}

/// `edge`² camera rays, in tiles of 8 × 8 pixels.
pub(crate) fn primary(edge: u32) -> Vec<Ray> {
    let origin = Vec3::new(-2.9, -3.1, 0.3);
    let frame = Frame::from_normal(Vec3::new(0.9, 1.0, -0.1).normalize());
    let tiles = edge / 8;
    let mut rays = Vec::with_capacity((edge * edge) as usize);
    for tile in 0..tiles * tiles {
        for pixel in 0..64 {
            let (x, y) = (tile % tiles * 8 + pixel % 8, tile / tiles * 8 + pixel / 8);
            let [u, v] = stream(x, y).pair(Dimension::PIXEL);
            let at = |k: u32, u: f32| (k as f32 + u) / edge as f32 * 2.0 - 1.0;
            rays.push(Ray::new(origin, frame.to_world(Vec3::new(at(x, u), at(y, v), 1.0)).normalize()));
        }
    }
    rays
}

/// Where those rays end: one diffuse bounce, and a segment to a light under the ceiling, for each.
pub(crate) fn secondary(world: &World, rays: &[Ray]) -> (Vec<Ray>, Vec<Ray>) {
    let mut bounces = Vec::with_capacity(rays.len());
    let mut shadows = Vec::with_capacity(rays.len());
    for (k, ray) in rays.iter().enumerate() {
        let hit = world.closest(ray).expect("the room is closed");
        let point = world.surface(ray, &hit);
        let normal = if point.normal.dot(ray.direction) > 0.0 { -point.normal } else { point.normal };
        let s = stream(k as u32, 4);
        let wi = Frame::from_normal(normal).to_world(warp::cosine_hemisphere(s.pair(Dimension::direction(0))));
        bounces.push(spawn(point.position, point.error, point.normal, wi));
        let [u, v] = s.pair(Dimension::light_point(0));
        let light = Vec3::new(u * 2.0 - 1.0, v * 2.0 - 1.0, HALF * 0.8);
        shadows.push(segment((point.position, point.error, point.normal), (light, 1e-6, Vec3::NEG_Z)));
    }
    (bounces, shadows)
}
