//! Rays per second: camera rays, diffuse bounces and occlusion, in closed rooms of 10⁴ to 10⁶ triangles, on one core and on all.
//!
//! `cargo bench -p gradfarm-core --bench traverse`.

#[allow(clippy::expect_used)]
mod room;

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use gradfarm_core::geometry::World;
use gradfarm_core::math::Ray;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Duration;

const TRIANGLES: [usize; 3] = [10_000, 100_000, 1_000_000];
/// Rays of a run, squared.
const EDGE: u32 = 256;

/// Traces all rays and counts those that meet something.
type Run = fn(&World, &[Ray]) -> usize;

fn closest(world: &World, rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| world.closest(black_box(ray)).is_some()).count()
}

fn occluded(world: &World, rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| world.occluded(black_box(ray))).count()
}

fn traverse(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("traverse");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements(u64::from(EDGE * EDGE)));
    for triangles in TRIANGLES {
        let world = room::world(room::room(triangles));
        let primary = room::primary(EDGE);
        let (bounces, shadows) = room::secondary(&world, &primary);
        let kinds: [(&str, &[Ray], Run); 3] =
            [("primary", &primary, closest), ("bounce", &bounces, closest), ("occlusion", &shadows, occluded)];
        for (name, rays, run) in kinds {
            group.bench_function(BenchmarkId::new(format!("{name}/one core"), triangles), |b| b.iter(|| run(&world, rays)));
            group.bench_function(BenchmarkId::new(format!("{name}/all cores"), triangles), |b| {
                b.iter(|| rays.par_chunks(1024).map(|chunk| run(&world, chunk)).sum::<usize>());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, traverse);
criterion_main!(benches);
