//! What windows of ten moments cost: least squares by cosine transform, the same by conjugate gradients where the picture moves, weighted and
//! robust ones; against ten frames by themselves.
//!
//! `cargo bench -p gradfarm-core --bench window`. Moments have one copy, so that each measures one solve.

use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use gradfarm_core::film::{Features, Film, Gradients, HalfFilm, Image, Statistics};
use gradfarm_core::lattice::Extent;
use gradfarm_core::reconstruction::window::{MomentFilm, solve};
use gradfarm_core::reconstruction::{ReconstructionKind, reconstruct};
use std::hint::black_box;
use std::time::Duration;

const ALPHA: f32 = 0.2;
const MOMENTS: u64 = 10;
const SIZE: Extent = Extent { width: 480, height: 270 };

/// A number in [−½, ½), rarely a large one: what path tracing leaves.
fn noise(k: usize, stream: u64) -> f32 {
    let mut z = (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ stream.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    let u = (z >> 40) as f32 / (1 << 24) as f32;
    if u > 0.995 { 8.0 } else { u - 0.5 }
}

/// Noisy measurements of a chequered wall that moves to the right, a column a moment. Half A has the noise of half B of the moment before.
fn film(extent: Extent, moment: u64, moves: bool) -> Film {
    let (w, h) = (extent.width, extent.height);
    let shift = if moves { moment as u32 } else { 0 };
    let wall = |x: u32, y: u32, c: usize| {
        let tile = if ((x + 10 - shift) * 5 / w + y * 3 / h).is_multiple_of(2) { 0.8 } else { 0.15 };
        tile + 0.3 * y as f32 / h as f32 + 0.1 * c as f32
    };
    let half = |key: u64, back: usize| {
        let mut images = [Image::new(extent, 3), Image::new(extent, 3), Image::new(extent, 3)];
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            let drawn = |plane: u64| noise(extent.index(x, y).wrapping_sub(back), 3 * key + plane);
            for c in 0..3 {
                let here = wall(x, y, c);
                images[0].set(x, y, c, (here * (1.0 + drawn(0))).max(0.0));
                if x + 1 < w {
                    images[1].set(x, y, c, wall(x + 1, y, c) - here + 0.1 * here * drawn(1));
                }
                if y + 1 < h {
                    images[2].set(x, y, c, wall(x, y + 1, c) - here + 0.1 * here * drawn(2));
                }
            }
        }
        let [primal, dx, dy] = images;
        let (mut rgb, mut grey) = (Image::new(extent, 3), Image::new(extent, 1));
        rgb.data_mut().fill(0.1);
        grey.data_mut().fill(0.003);
        let gradients = Some(Gradients { dx, dy, dx_variance: grey.clone(), dy_variance: grey });
        HalfFilm { samples: 1, primal, primal_variance: rgb, direct: Image::new(extent, 3), gradients, graph: None }
    };
    let mut motion = Image::new(extent, 3);
    for (y, x) in (0..h).flat_map(|y| (1..w).map(move |x| (y, x))) {
        motion.set(x, y, 0, -1.0);
        motion.set(x, y, 2, 1.0);
    }
    let features = Features { albedo: Image::new(extent, 3), normal: Image::new(extent, 3), depth: Image::new(extent, 1) };
    let halves = [half(moment, usize::from(moves)), half(moment + 1, 0)];
    Film { extent, halves, counts: None, motion: moves.then_some(motion), features, statistics: Statistics::default() }
}

fn windows(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("window");
    group
        .sampling_mode(SamplingMode::Flat)
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(20));
    let size = format!("{} of {}x{}", MOMENTS, SIZE.width, SIZE.height);
    for moves in [false, true] {
        let films: Vec<Film> = (0..MOMENTS).map(|t| film(SIZE, t, moves)).collect();
        let Ok(moments) = films.iter().map(|film| MomentFilm::new(&[film])).collect::<Result<Vec<_>, _>>() else { return };
        let moments: Vec<&MomentFilm> = moments.iter().collect();
        let name = if moves { "moving" } else { "still" };
        for kind in [ReconstructionKind::L2, ReconstructionKind::WeightedL2, ReconstructionKind::L1] {
            if let Ok(done) = solve(&moments, kind, Some(ALPHA)) {
                eprintln!("{name}, {}: {} iterations, residual {:.1e}", kind.name(), done.report.iterations, done.report.residual);
            }
            let id = BenchmarkId::new(format!("{name}-{}", kind.name()), &size);
            group.bench_function(id, |b| b.iter(|| black_box(solve(&moments, kind, Some(ALPHA)))));
            if !moves {
                let id = BenchmarkId::new(format!("alone-{}", kind.name()), &size);
                group.bench_function(id, |b| b.iter(|| films.iter().map(|film| reconstruct(film, kind, ALPHA)).collect::<Vec<_>>()));
            }
        }
    }
    group.finish();
}

criterion_group!(benches, windows);
criterion_main!(benches);
