//! What a new tree for a mesh that deforms costs, against fitting the boxes of the tree of an earlier moment again, and how much worse the old
//! tree is by then: its expected cost of a ray (surface area heuristic) over that of a new one.
//!
//! `cargo bench -p gradfarm-core --bench refit`.

use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use glam::Vec3A;
use gradfarm_core::geometry::{Mesh, ShapeId, WorldBuilder};
use gradfarm_core::math::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::hint::black_box;
use std::time::Duration;

const TRIANGLES: [u32; 3] = [10_000, 100_000, 1_000_000];
/// How far the limbs have swung when the old tree is judged [rad].
const SWINGS: [f32; 4] = [0.05, 0.2, 0.5, 1.0];
const LIMBS: u32 = 6;

/// A figure: limbs like the fingers of a hand, each a tube that bends by `swing` from its root to its end, every other one the other way.
fn figure(triangles: u32, swing: f32) -> Mesh {
    let columns = ((triangles / LIMBS) as f32 / 16.0).sqrt().max(3.0) as u32;
    let rows = triangles / LIMBS / (2 * columns);
    let mut mesh = Mesh::default();
    for limb in 0..LIMBS {
        let first = mesh.positions.len() as u32;
        let side = if limb.is_multiple_of(2) { 1.0 } else { -1.0 };
        let turn = limb as f32 / LIMBS as f32 * std::f32::consts::TAU;
        for j in 0..=rows {
            let along = j as f32 / rows as f32;
            let bend = side * swing * along;
            let (bent, straight) = libm::sincosf(bend);
            for i in 0..columns {
                let (s, c) = libm::sincosf(i as f32 / columns as f32 * std::f32::consts::TAU);
                let thick = 0.12 - 0.07 * along;
                // In the limb's own plane: x across, y along it.
                let (x, y, z) = (thick * c * straight + along * bent, along * straight - thick * c * bent, thick * s);
                let (ts, tc) = libm::sincosf(turn);
                mesh.positions.push(Vec3::new(x * tc - z * ts + 0.25 * tc, y, x * ts + z * tc + 0.25 * ts));
            }
        }
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let at = |j: u32, i: u32| first + j * columns + i % columns;
            mesh.triangles.push([at(j, i), at(j, i + 1), at(j + 1, i + 1)]);
            mesh.triangles.push([at(j, i), at(j + 1, i + 1), at(j + 1, i)]);
        }
    }
    mesh
}

fn boxes(mesh: &Mesh) -> Vec<Aabb> {
    let corner = |v: u32| Vec3A::from(mesh.positions[v as usize]);
    let around = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        Aabb::new(a.min(b).min(c), a.max(b).max(c))
    };
    mesh.triangles.iter().map(around).collect()
}

/// The binary tree as the renderer has it built.
fn build(boxes: &[Aabb]) -> Bvh2 {
    let items = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Low, boxes, items, SortPrecision::U64, 1);
    ReinsertionOptimizer::default().run(&mut tree, 0.05, None);
    tree
}

fn refit(tree: &mut Bvh2, boxes: &[Aabb]) {
    for k in 0..tree.nodes.len() {
        if tree.nodes[k].is_leaf() {
            let item = tree.primitive_indices[tree.nodes[k].first_index as usize];
            tree.nodes[k].set_aabb(boxes[item as usize]);
        }
    }
    tree.refit_all();
}

/// Boxes that a ray through the whole meets, on average.
fn cost(tree: &Bvh2) -> f64 {
    let areas = tree.nodes.iter().filter(|node| node.valid()).map(|node| f64::from(node.aabb().half_area()));
    areas.sum::<f64>() / f64::from(tree.nodes[0].aabb().half_area())
}

fn trees(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("refit");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    for triangles in TRIANGLES {
        let mut old = build(&boxes(&figure(triangles, 0.0)));
        for swing in SWINGS {
            let now = boxes(&figure(triangles, swing));
            refit(&mut old, &now);
            eprintln!("{triangles} triangles, bent by {swing}: the old tree costs {:.3} of a new one", cost(&old) / cost(&build(&now)));
        }
        let mesh = figure(triangles, SWINGS[3]);
        let now = boxes(&mesh);
        group.bench_function(BenchmarkId::new("binary tree again", triangles), |b| b.iter(|| refit(black_box(&mut old), &now)));
        group.bench_function(BenchmarkId::new("binary tree anew", triangles), |b| b.iter(|| build(black_box(&now))));
        group.bench_function(BenchmarkId::new("all that is built for a mesh", triangles), |b| {
            b.iter(|| WorldBuilder { meshes: vec![(mesh.clone(), ShapeId(0))], ..WorldBuilder::default() }.build());
        });
    }
    group.finish();
}

criterion_group!(benches, trees);
criterion_main!(benches);
