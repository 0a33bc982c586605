//! What reconstructions cost: L2, L1 and least squares over links against plain conjugate gradients, the usual way to an approximate L2.
//!
//! `cargo bench -p gradfarm-core --bench reconstruct`. Before the times of a size stand the errors that plain iterations leave, over time. The films have one half only, so that each measures one solve.

use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use gradfarm_core::film::{Features, Film, Gradients, Graph, HalfFilm, Image, Statistics};
use gradfarm_core::lattice::Extent;
use gradfarm_core::reconstruction::{ReconstructionKind, reconstruct};
use std::hint::black_box;
use std::time::{Duration, Instant};

const ALPHA: f32 = 0.2;
const SIZES: [Extent; 3] = [Extent { width: 512, height: 512 }, Extent { width: 1920, height: 1080 }, Extent { width: 3840, height: 2160 }];

/// A number in [−½, ½), rarely a large one: what path tracing leaves.
fn noise(k: usize, stream: u64) -> f32 {
    let mut z = (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ stream.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    let u = (z >> 40) as f32 / (1 << 24) as f32;
    if u > 0.995 { 8.0 } else { u - 0.5 }
}

/// Noisy measurements of a chequered wall.
fn film(extent: Extent) -> Film {
    let (w, h) = (extent.width, extent.height);
    let wall = |x: u32, y: u32, c: usize| {
        let tile = if (x * 5 / w + y * 3 / h).is_multiple_of(2) { 0.8 } else { 0.15 };
        tile + 0.3 * y as f32 / h as f32 + 0.1 * c as f32
    };
    let (mut primal, mut dx, mut dy) = (Image::new(extent, 3), Image::new(extent, 3), Image::new(extent, 3));
    for y in 0..h {
        for x in 0..w {
            let i = extent.index(x, y);
            for c in 0..3 {
                let here = wall(x, y, c);
                primal.set(x, y, c, (here * (1.0 + noise(i, 1))).max(0.0));
                if x + 1 < w {
                    dx.set(x, y, c, wall(x + 1, y, c) - here + 0.1 * here * noise(i, 2));
                }
                if y + 1 < h {
                    dy.set(x, y, c, wall(x, y + 1, c) - here + 0.1 * here * noise(i, 3));
                }
            }
        }
    }
    let (rgb, grey) = (Image::new(extent, 3), Image::new(extent, 1));
    let graph = Some(links(extent, &dx, &dy));
    let gradients = Gradients { dx, dy, dx_variance: grey.clone(), dy_variance: grey.clone() };
    let half = HalfFilm { samples: 1, primal, primal_variance: rgb.clone(), direct: rgb.clone(), gradients: Some(gradients), graph };
    let empty = HalfFilm {
        samples: 0,
        primal: rgb.clone(),
        primal_variance: rgb.clone(),
        direct: rgb.clone(),
        gradients: Some(Gradients { dx: rgb.clone(), dy: rgb.clone(), dx_variance: grey.clone(), dy_variance: grey.clone() }),
        graph: None,
    };
    let features = Features { albedo: rgb.clone(), normal: rgb, depth: grey };
    Film { extent, halves: [half, empty], counts: None, motion: None, features, statistics: Statistics::default() }
}

/// The differences within a field of the chequered wall, as links to direct neighbours.
fn links(extent: Extent, dx: &Image, dy: &Image) -> Graph {
    let field = |x: u32, y: u32| (x * 5 / extent.width, y * 3 / extent.height);
    let (mut links, mut differences) = (Vec::new(), Vec::new());
    for y in 0..extent.height {
        for x in 0..extent.width {
            for (tx, ty, measured) in [(x + 1, y, dx), (x, y + 1, dy)] {
                if tx < extent.width && ty < extent.height && field(x, y) == field(tx, ty) {
                    links.push([extent.index(x, y) as u32, extent.index(tx, ty) as u32]);
                    differences.push(std::array::from_fn(|c| measured.at(x, y, c)));
                }
            }
        }
    }
    Graph { variances: vec![0.0; links.len()], links: links.into(), differences }
}

/// (α² + ∇ᵀ∇) x of one channel.
fn apply(extent: Extent, x: &[f32], out: &mut [f32]) {
    let (w, h) = (extent.width as usize, extent.height as usize);
    for row in 0..h {
        for column in 0..w {
            let i = row * w + column;
            let mut sum = ALPHA * ALPHA * x[i];
            sum += if column + 1 < w { x[i] - x[i + 1] } else { 0.0 };
            sum += if column > 0 { x[i] - x[i - 1] } else { 0.0 };
            sum += if row + 1 < h { x[i] - x[i + w] } else { 0.0 };
            sum += if row > 0 { x[i] - x[i - w] } else { 0.0 };
            out[i] = sum;
        }
    }
}

/// So many iterations from the primal on, single precision, one thread a channel.
fn plain_conjugate_gradients(film: &Film, iterations: u32) -> Vec<Vec<f32>> {
    let half = &film.halves[0];
    let Some(gradients) = &half.gradients else { return Vec::new() };
    let extent = film.extent;
    let (w, h) = (extent.width as usize, extent.height as usize);
    let channel = |c: usize| {
        let (p, dx, dy) = (half.primal.plane(c), gradients.dx.plane(c), gradients.dy.plane(c));
        let mut x = p.to_vec();
        let mut ax = vec![0.0; x.len()];
        apply(extent, &x, &mut ax);
        let mut r: Vec<f32> = (0..x.len()).map(|i| ALPHA * ALPHA * p[i] - ax[i]).collect();
        for i in 0..r.len() {
            if i % w + 1 < w {
                r[i] -= dx[i];
                r[i + 1] += dx[i];
            }
            if i / w + 1 < h {
                r[i] -= dy[i];
                r[i + w] += dy[i];
            }
        }
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
        let mut direction = r.clone();
        let mut rr = dot(&r, &r);
        for _ in 0..iterations {
            apply(extent, &direction, &mut ax);
            let step = (rr / dot(&direction, &ax)) as f32;
            for i in 0..x.len() {
                x[i] += step * direction[i];
                r[i] -= step * ax[i];
            }
            let next = dot(&r, &r);
            let beta = (next / rr) as f32;
            rr = next;
            direction.iter_mut().zip(&r).for_each(|(d, r)| *d = r + beta * *d);
        }
        x
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..3).map(|c| scope.spawn(move || channel(c))).collect();
        threads.into_iter().filter_map(|t| t.join().ok()).collect()
    })
}

/// How far plain iterations are from the exact solution, and how long they and the exact solve take.
fn errors(film: &Film, size: &str) {
    let start = Instant::now();
    let Ok(exact) = reconstruct(film, ReconstructionKind::L2, ALPHA) else { return };
    eprintln!("{size}: l2 is exact to rounding after {:.3} s", start.elapsed().as_secs_f64());
    // The film has one half, so that its image is the half's.
    let scale = exact.image.data().iter().fold(0.0f32, |most, v| most.max(v.abs()));
    for iterations in [10, 25, 50, 100, 200] {
        let start = Instant::now();
        let planes = plain_conjugate_gradients(film, iterations);
        let seconds = start.elapsed().as_secs_f64();
        let (mut square, mut worst) = (0.0f64, 0.0f32);
        for (c, plane) in planes.iter().enumerate() {
            for (value, exact) in plane.iter().zip(exact.image.plane(c)) {
                let off = (value - exact).abs() / scale;
                square += f64::from(off * off);
                worst = worst.max(off);
            }
        }
        let rms = (square / exact.image.data().len() as f64).sqrt();
        eprintln!(
            "{size}: {iterations} plain iterations leave {rms:.1e} (rms) and {worst:.1e} (worst) of the brightest value after {seconds:.3} s"
        );
    }
}

fn reconstructions(c: &mut Criterion) {
    let mut group = c.benchmark_group("reconstruct");
    group.sample_size(10).sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_millis(500));
    for extent in SIZES {
        let film = film(extent);
        let size = format!("{}x{}", extent.width, extent.height);
        errors(&film, &size);
        for kind in [ReconstructionKind::L2, ReconstructionKind::L1, ReconstructionKind::Graph] {
            group.bench_with_input(BenchmarkId::new(kind.name(), &size), &film, |b, film| {
                b.iter(|| black_box(reconstruct(film, kind, ALPHA)))
            });
        }
        group.bench_with_input(BenchmarkId::new("plain-cg-50", &size), &film, |b, film| {
            b.iter(|| black_box(plain_conjugate_gradients(film, 50)))
        });
    }
    group.finish();
}

criterion_group!(benches, reconstructions);
criterion_main!(benches);
