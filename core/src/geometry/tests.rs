//! No leaks, and the same answer as testing everything.

use super::*;
use crate::math::{Ray, Transform, Vec2, Vec3};
use crate::sampling::{Dimension, SampleKey, SampleStream, warp};

fn stream(k: u32) -> SampleStream {
    SampleStream::open(SampleKey { seed: 3, frame: 0, x: k, y: 1, index: k })
}

/// A closed, bumpy ball of `rings` × 2·`rings` quads around a centre.
fn ball(centre: Vec3, radius: f32, rings: u32) -> Mesh {
    let columns = 2 * rings;
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..columns {
            let (theta, phi) = (i as f32 / rings as f32 * std::f32::consts::PI, j as f32 / columns as f32 * std::f32::consts::TAU);
            // Poles are one point: no seam for rounding to open.
            let ring = if i == 0 || i == rings { 0.0 } else { theta.sin() };
            let bump = if ring == 0.0 { 1.0 } else { 1.0 + 0.1 * (5.0 * theta).sin() * (4.0 * phi).cos() };
            mesh.positions.push(centre + Vec3::new(ring * phi.cos(), ring * phi.sin(), theta.cos()) * radius * bump);
        }
    }
    for i in 0..rings {
        for j in 0..columns {
            let at = |i: u32, j: u32| i * columns + j % columns;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

#[test]
fn closed_meshes_do_not_leak() {
    for (centre, radius) in [(Vec3::ZERO, 1.0), (Vec3::new(1e3, -2e3, 500.0), 3.0), (Vec3::ZERO, 1e-6), (Vec3::ZERO, 1e6)] {
        let mesh = ball(centre, radius, 24);
        let vertices = mesh.positions.clone();
        let world = WorldBuilder { meshes: vec![(mesh, ShapeId(0))], ..WorldBuilder::default() }.build();
        for k in 0..65_536u32 {
            let s = stream(k);
            let origin = centre + warp::uniform_sphere(s.pair(Dimension::LENS)) * (0.5 * radius * s.number(Dimension::lobe(0)));
            // A third of the rays aim at vertices, a third at the middle of edges.
            let direction = match k % 3 {
                0 => warp::uniform_sphere(s.pair(Dimension::PIXEL)),
                1 => vertices[k as usize % vertices.len()] - origin,
                _ => (vertices[k as usize % vertices.len()] + vertices[(k as usize + 1) % vertices.len()]) * 0.5 - origin,
            };
            assert!(world.closest(&Ray::new(origin, direction)).is_some(), "leak at {k}: {origin} towards {direction}");
            assert!(world.occluded(&Ray::new(origin, direction)));
        }
    }
}

#[test]
fn trees_find_what_testing_everything_finds() {
    let mut builder = WorldBuilder::default();
    for k in 0..60u32 {
        let s = stream(k);
        let centre = warp::uniform_sphere(s.pair(Dimension::PIXEL)) * 4.0;
        if k % 2 == 0 {
            builder.analytic.push((Sphere { centre, radius: 0.4 }.into(), ShapeId(k)));
        } else {
            builder.meshes.push((ball(centre, 0.4, 5), ShapeId(k)));
        }
    }
    let meshes = builder.meshes.clone();
    let spheres = builder.analytic.clone();
    let world = builder.build();
    let alone: Vec<World> = meshes
        .into_iter()
        .map(|m| WorldBuilder { meshes: vec![m], ..WorldBuilder::default() }.build())
        .chain(spheres.into_iter().map(|s| WorldBuilder { analytic: vec![s], ..WorldBuilder::default() }.build()))
        .collect();
    let mut hits = 0;
    for k in 0..3000u32 {
        let s = stream(1000 + k);
        let origin = warp::uniform_sphere(s.pair(Dimension::PIXEL)) * 6.0;
        let ray = Ray::new(origin, warp::uniform_sphere(s.pair(Dimension::LENS)) * 4.0 - origin);
        let each = alone.iter().filter_map(|w| w.closest(&ray).map(|h| h.t)).fold(f32::INFINITY, f32::min);
        match world.closest(&ray) {
            Some(hit) => {
                hits += 1;
                assert_eq!(hit.t, each);
                assert!(world.occluded(&ray));
                assert!(!world.occluded(&Ray { reach: hit.t * 0.999, ..ray }));
            }
            None => assert_eq!(each, f32::INFINITY),
        }
    }
    assert!(hits > 300);
}

#[test]
fn instances_are_where_their_transform_puts_them() {
    let map = Transform::from_rows([[2.0, 0.0, 0.0, 5.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.5, -2.0]]).unwrap();
    let mesh = ball(Vec3::ZERO, 1.0, 8);
    let baked = WorldBuilder { meshes: vec![(mesh.clone().transformed(&map), ShapeId(0))], ..WorldBuilder::default() }.build();
    let placed = WorldBuilder {
        groups: vec![Group::build(vec![(mesh, ShapeId(0))], Vec::new()).into()],
        instances: vec![Instance { group: 0, to_world: map }],
        ..WorldBuilder::default()
    }
    .build();
    let mut hits = 0;
    for k in 0..2000u32 {
        let s = stream(k);
        let ray = Ray::new(
            Vec3::new(5.0, 1.0, -8.0) + warp::uniform_sphere(s.pair(Dimension::LENS)),
            Vec3::new(0.0, 0.0, 1.0) + warp::uniform_sphere(s.pair(Dimension::PIXEL)) * 0.15,
        );
        match (baked.closest(&ray), placed.closest(&ray)) {
            (Some(a), Some(b)) => {
                hits += 1;
                let (a, b) = (baked.surface(&ray, &a), placed.surface(&ray, &b));
                assert!((a.position - b.position).length() < 1e-4);
                assert!((a.normal - b.normal).length() < 1e-3, "{} {}", a.normal, b.normal);
                assert!(b.uv.cmpge(Vec2::splat(-1e-4)).all());
            }
            (None, None) => {}
            // Rays that graze the silhouette may be decided differently.
            _ => {}
        }
    }
    assert!(hits > 500);
}

#[test]
fn points_do_not_meet_their_own_surface() {
    for scale in [1e-6f32, 1.0, 1e6] {
        let world = WorldBuilder {
            meshes: vec![(ball(Vec3::splat(7.0 * scale), scale, 12), ShapeId(0))],
            analytic: vec![(Sphere { centre: Vec3::splat(-7.0 * scale), radius: scale }.into(), ShapeId(1))],
            ..WorldBuilder::default()
        }
        .build();
        for k in 0..4000u32 {
            let s = stream(k);
            let target = Vec3::splat(if k % 2 == 0 { 7.0 } else { -7.0 } * scale);
            let origin = target + warp::uniform_sphere(s.pair(Dimension::PIXEL)) * (2.0 * scale);
            let ray = Ray::new(origin, (target - origin).normalize());
            let hit = world.closest(&ray).unwrap();
            let point = world.surface(&ray, &hit);
            let away = warp::uniform_sphere(s.pair(Dimension::LENS));
            let outwards = if away.dot(point.normal) < 0.0 { -away } else { away };
            if k % 2 == 1 {
                // A sphere is convex: nothing outside is hidden by it.
                assert!(
                    !world.occluded(&Ray { reach: 5.0 * scale, ..crate::math::spawn(point.position, point.error, point.normal, outwards) })
                );
            } else {
                let back = crate::math::spawn(point.position, point.error, point.normal, -ray.direction);
                assert!(!world.occluded(&Ray { reach: 0.9 * scale, ..back }), "scale {scale}, ray {k}");
            }
        }
    }
}
