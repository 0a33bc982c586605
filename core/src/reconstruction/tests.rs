//! Solves against oracles: conjugate gradients to the limit, closed forms, and what robust means.

pub(super) mod convergence;
mod odd;

use super::*;
use crate::film::{Features, Gradients, Statistics};
use std::sync::Arc;

fn noise(k: usize, seed: usize) -> f32 {
    let mut z = (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (seed as u64).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z >> 40) as f32) / (1 << 24) as f32 - 0.5
}

/// Every reconstruction, with a plain blur for a denoiser.
fn kinds() -> impl Iterator<Item = ReconstructionKind> {
    struct Blur;
    impl Denoise for Blur {
        fn name(&self) -> String {
            "blur".to_owned()
        }

        fn denoise(&self, colour: &Image, _albedo: &Image, _normal: &Image) -> Result<Image, String> {
            let extent = colour.extent();
            let plane = |c: usize| smooth::smoothed(colour.plane(c), extent.width as usize, extent.height as usize, 1);
            Image::from_planes(extent, 3, (0..3).flat_map(plane).collect()).ok_or_else(|| "size".to_owned())
        }
    }
    let _ = install_denoiser(Box::new(Blur));
    ReconstructionKind::ALL.into_iter()
}

pub(super) fn random(extent: Extent, seed: usize, scale: f32) -> Image {
    let data = (0..extent.pixels() * 3).map(|k| noise(k, seed) * scale).collect();
    Image::from_planes(extent, 3, data).unwrap()
}

/// Links of several displacements, most of those that are possible, with differences of any kind.
pub(super) fn linked(extent: Extent, seed: usize) -> Graph {
    let mut links = Vec::new();
    for (y, x) in (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| (y, x))) {
        for (dx, dy) in [(1, 0), (-1, 1), (0, 1), (1, 1), (-2, 3)] {
            let (tx, ty) = (i64::from(x) + dx, i64::from(y) + dy);
            if extent.contains(tx, ty) && noise(links.len() + 7 * extent.index(x, y), seed) < 0.3 {
                links.push([extent.index(x, y) as u32, extent.index(tx as u32, ty as u32) as u32]);
            }
        }
    }
    let differences = (0..links.len()).map(|k| std::array::from_fn(|c| noise(3 * k + c, seed + 1))).collect();
    Graph { variances: vec![1.0; links.len()], links: Arc::new(links), differences }
}

/// Forward differences of an image.
pub(super) fn differences(image: &Image) -> (Image, Image) {
    let e = image.extent();
    let (mut dx, mut dy) = (Image::new(e, 3), Image::new(e, 3));
    for c in 0..3 {
        for y in 0..e.height {
            for x in 0..e.width {
                if x + 1 < e.width {
                    dx.set(x, y, c, image.at(x + 1, y, c) - image.at(x, y, c));
                }
                if y + 1 < e.height {
                    dy.set(x, y, c, image.at(x, y + 1, c) - image.at(x, y, c));
                }
            }
        }
    }
    (dx, dy)
}

/// A smooth picture with an edge.
pub(super) fn picture(e: Extent) -> Image {
    let mut image = Image::new(e, 3);
    for c in 0..3 {
        for y in 0..e.height {
            for x in 0..e.width {
                let step = if x * 2 > e.width { 1.0 } else { 0.2 };
                image.set(x, y, c, step + 0.3 * (y as f32 / e.height as f32) + 0.1 * c as f32);
            }
        }
    }
    image
}

fn worst(a: &Image, b: &Image) -> f32 {
    a.data().iter().zip(b.data()).fold(0.0, |w, (a, b)| w.max((a - b).abs()))
}

#[test]
fn l2_solves_its_normal_equations() {
    for (w, h) in [(1, 1), (1, 9), (7, 1), (16, 12), (13, 17)] {
        let extent = Extent { width: w, height: h };
        let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
        let m = Measurements::new(&p, &dx, &dy);
        let (image, _) = l2::L2.solve(&m, None, 0.3).unwrap();
        let (gx, gy) = differences(&image);
        for c in 0..3 {
            for y in 0..h {
                for x in 0..w {
                    // α²(I − P) + ∇ᵀ(∇I − G) = 0 at every pixel.
                    let mut sum = 0.09 * f64::from(image.at(x, y, c) - p.at(x, y, c));
                    let rx = |x: u32, y: u32| if x + 1 < w { f64::from(gx.at(x, y, c) - dx.at(x, y, c)) } else { 0.0 };
                    let ry = |x: u32, y: u32| if y + 1 < h { f64::from(gy.at(x, y, c) - dy.at(x, y, c)) } else { 0.0 };
                    sum -= rx(x, y) + ry(x, y);
                    sum += if x > 0 { rx(x - 1, y) } else { 0.0 } + if y > 0 { ry(x, y - 1) } else { 0.0 };
                    assert!(sum.abs() < 2e-6, "{w}×{h} at ({x}, {y}): {sum}");
                }
            }
        }
    }
}

#[test]
fn l2_keeps_the_mean_and_consistent_images() {
    let extent = Extent { width: 21, height: 14 };
    let image = picture(extent);
    let (dx, dy) = differences(&image);
    let m = Measurements::new(&image, &dx, &dy);
    assert!(worst(&l2::L2.solve(&m, None, 0.2).unwrap().0, &image) < 1e-5);
    let noisy = random(extent, 5, 1.0);
    let (gx, gy) = (random(extent, 6, 1.0), random(extent, 7, 1.0));
    let m = Measurements::new(&noisy, &gx, &gy);
    let (solved, _) = l2::L2.solve(&m, None, 0.2).unwrap();
    for c in 0..3 {
        let sum = |i: &Image| i.plane(c).iter().map(|v| f64::from(*v)).sum::<f64>();
        assert!((sum(&solved) - sum(&noisy)).abs() < 1e-4);
    }
}

#[test]
fn l1_ignores_an_outlier_that_l2_spreads() {
    let extent = Extent { width: 24, height: 24 };
    let image = picture(extent);
    let (mut dx, dy) = differences(&image);
    dx.set(5, 12, 0, 40.0);
    let m = Measurements::new(&image, &dx, &dy);
    let (l2, _) = l2::L2.solve(&m, None, 0.2).unwrap();
    let (l1, report) = l1::L1.solve(&m, None, 0.2).unwrap();
    assert!(worst(&l2, &image) > 1.0);
    assert!(worst(&l1, &image) < 0.02, "{}", worst(&l1, &image));
    assert!(report.residual <= 1e-3);
    assert!(l1::objective(&m, &l1, 0.2) < l1::objective(&m, &l2, 0.2));
}

#[test]
fn l1_is_near_its_minimum() {
    let extent = Extent { width: 12, height: 10 };
    let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
    let m = Measurements::new(&p, &dx, &dy);
    let (image, _) = l1::L1.solve(&m, None, 0.4).unwrap();
    let best = l1::objective(&m, &image, 0.4);
    // The objective is convex: no small step in any direction may lower it by more than rounding and the last ε allow.
    for seed in 0..50 {
        for step in [0.1, 0.01] {
            let mut moved = image.clone();
            for (k, v) in moved.data_mut().iter_mut().enumerate() {
                *v += step * noise(k, 100 + seed);
            }
            assert!(l1::objective(&m, &moved, 0.4) > best * (1.0 - 1e-3));
        }
    }
}

/// An operator whose weights jump by a factor of a thousand from edge to edge.
fn jumping(w: usize, h: usize) -> stencil::Stencil {
    let mut stencil = stencil::Stencil::new(w, h);
    let jump = |k: usize| if noise(k, 9) > 0.0 { 1.0 } else { 1e-3 };
    stencil.screen.fill(0.01);
    for y in 0..h {
        for x in 0..w {
            let i = y * w + x;
            stencil.wx[i] = if x + 1 < w { jump(i) } else { 0.0 };
            stencil.wy[i] = if y > 0 { jump(i + w * h) } else { 0.0 };
        }
    }
    stencil
}

#[test]
fn multigrid_converges_fast_where_weights_jump() {
    for (w, h) in [(96, 64), (67, 41), (1, 130), (130, 1), (2, 2)] {
        let stencil = jumping(w, h);
        let b = field::Field::from_image(&random(Extent { width: w as u32, height: h as u32 }, 3, 1.0));
        let solve = |multigrid: bool, most| {
            let mut hierarchy = multigrid::Hierarchy::new(w, h);
            hierarchy.adapt(&stencil);
            let mut x = field::Field::new(w, h);
            let mut cycle = multigrid::Cycle { stencil: &stencil, hierarchy: &mut hierarchy };
            let cycle: Option<&mut dyn solver::Precondition> = if multigrid { Some(&mut cycle) } else { None };
            let solved = solver::ConjugateGradients::new(w, h).solve(&stencil, cycle, &b, &mut x, 1e-5, most);
            (x, solved)
        };
        let (x, solved) = solve(true, 200);
        assert!(solved.residual <= 1e-5 && solved.iterations < 80, "{w}×{h}: {solved:?}");
        let (reference, plain) = solve(false, 5000);
        assert!(plain.residual <= 1e-5);
        assert!(w * h < 1000 || solved.iterations * 2 < plain.iterations, "{w}×{h}: {solved:?} against {plain:?}");
        for c in 0..3 {
            for y in 0..h {
                assert!(x.row(y, c).iter().zip(reference.row(y, c)).all(|(a, b)| (a - b).abs() < 2e-2), "{w}×{h}");
            }
        }
    }
}

#[test]
fn l1_falls_with_each_reweighting_and_ends_near_the_long_way() {
    let extent = Extent { width: 40, height: 33 };
    let truth = picture(extent);
    let (mut dx, mut dy) = differences(&truth);
    let mut p = truth.clone();
    for (k, v) in p.data_mut().iter_mut().enumerate() {
        *v += noise(k, 1) + if k % 97 == 0 { 8.0 } else { 0.0 };
    }
    for (k, v) in dx.data_mut().iter_mut().chain(dy.data_mut()).enumerate() {
        *v += 0.05 * noise(k, 2) + if k % 61 == 0 { 3.0 * noise(k, 4) } else { 0.0 };
    }
    let m = Measurements::new(&p, &dx, &dy);
    let mut course = Vec::new();
    let effort = l1::Effort { reweightings: 24, iterations: 2, settled: 0.0, multigrid: true };
    l1::minimise(&m, &l1::Alike { alpha: 0.2 }, 0.2, &effort, |objective| course.push(objective)).unwrap();
    assert!(course.len() > 10 && course.windows(2).all(|w| w[1] <= w[0] * (1.0 + 1e-6)), "{course:?}");
    // The long way: plain conjugate gradients, every system to the end.
    let long = l1::Effort { reweightings: 24, iterations: 2000, settled: 0.0, multigrid: false };
    let (reference, _) = l1::minimise(&m, &l1::Alike { alpha: 0.2 }, 0.2, &long, |_| {}).unwrap();
    let (image, report) = l1::L1.solve(&m, None, 0.2).unwrap();
    assert!(report.iterations > 0 && report.residual.is_finite());
    let least = l1::objective(&m, &reference, 0.2);
    let start = l1::objective(&m, &l2::L2.solve(&m, None, 0.2).unwrap().0, 0.2);
    let reached = l1::objective(&m, &image, 0.2);
    assert!(reached - least < 0.1 * (start - least), "{start} → {reached}, least {least}");
}

/// Image of the least squares by dense Gaussian elimination in f64.
fn dense(m: &Measurements, channel: usize, alpha: f64) -> Vec<f64> {
    let (w, h) = (m.extent.width as usize, m.extent.height as usize);
    let n = w * h;
    let mut rows = vec![vec![0.0f64; n + 1]; n];
    let mut measure = |terms: &[(usize, f64)], value: f64| {
        for (i, a) in terms {
            for (j, b) in terms {
                rows[*i][*j] += a * b;
            }
            rows[*i][n] += a * value;
        }
    };
    for y in 0..h {
        for x in 0..w {
            let i = y * w + x;
            measure(&[(i, alpha)], alpha * f64::from(m.primal.plane(channel)[i]));
            if x + 1 < w {
                measure(&[(i, -1.0), (i + 1, 1.0)], f64::from(m.dx.plane(channel)[i]));
            }
            if y + 1 < h {
                measure(&[(i, -1.0), (i + w, 1.0)], f64::from(m.dy.plane(channel)[i]));
            }
        }
    }
    // Positive definite, so no pivoting.
    for k in 0..n {
        for i in k + 1..n {
            let factor = rows[i][k] / rows[k][k];
            for j in k..=n {
                rows[i][j] -= factor * rows[k][j];
            }
        }
    }
    let mut solution = vec![0.0; n];
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| rows[k][j] * solution[j]).sum();
        solution[k] = (rows[k][n] - rest) / rows[k][k];
    }
    solution
}

#[test]
fn l2_agrees_with_dense_elimination() {
    for (w, h) in [(1, 1), (1, 7), (11, 1), (7, 5), (8, 8), (13, 11)] {
        let extent = Extent { width: w, height: h };
        let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
        let m = Measurements::new(&p, &dx, &dy);
        for alpha in [0.05f32, 0.2, 3.0] {
            let mut poisson = l2::Poisson::new(&m, alpha);
            for c in 0..3 {
                let solved = poisson.channel(c);
                let expected = dense(&m, c, f64::from(alpha));
                assert!(solved.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9), "{w}×{h}, alpha {alpha}");
            }
        }
    }
}

#[test]
fn l2_tends_to_the_primal_as_alpha_grows() {
    let extent = Extent { width: 10, height: 6 };
    let (p, dx, dy) = (random(extent, 1, 2.0), random(extent, 2, 0.5), random(extent, 3, 0.5));
    let m = Measurements::new(&p, &dx, &dy);
    let distance = |alpha| worst(&l2::L2.solve(&m, None, alpha).unwrap().0, &p);
    let distances = [1.0, 10.0, 1000.0].map(distance);
    assert!(distances[0] > 0.2 && distances[1] < 0.1 && distances[2] < 1e-5, "{distances:?}");
}

#[test]
fn noise_decides_the_weight_of_the_primal() {
    let extent = Extent { width: 30, height: 20 };
    let full = |channels: usize, value: f32| Image::from_planes(extent, channels, vec![value; channels * 600]).unwrap();
    let (p, d) = (full(3, 0.5), full(3, 0.0));
    let bare = Measurements::new(&p, &d, &d);
    assert_eq!(l2::L2.alpha(&bare), noise::TYPICAL);
    // The last column and row hold nothing; of the differences that there are each has a variance of 0.03, the primal one of 0.75.
    let (primal, mut dx, mut dy) = (full(3, 0.25), full(1, 0.03), full(1, 0.03));
    (0..20).for_each(|y| dx.set(29, y, 0, 0.0));
    (0..30).for_each(|x| dy.set(x, 19, 0, 0.0));
    let m = Measurements { variance: Some(Variance { primal: &primal, dx: &dx, dy: &dy }), ..bare };
    // The ratio of deviations is 0.2, and the weight half-way to the usual one.
    assert!((l2::L2.alpha(&m) - 0.06f32.sqrt()).abs() < 1e-5, "{}", l2::L2.alpha(&m));
    let silent = full(1, 0.0);
    let m = Measurements { variance: Some(Variance { primal: &primal, dx: &silent, dy: &silent }), ..bare };
    assert_eq!(l2::L2.alpha(&m), noise::TYPICAL);
}

/// White noise of known strength: the weight that noise calls for beats those beside it.
#[test]
fn the_weight_by_noise_is_the_best_one() {
    let extent = Extent { width: 64, height: 48 };
    let truth = picture(extent);
    let (dx, dy) = differences(&truth);
    let spoil = |image: &Image, sigma: f32, seed: usize| {
        let (mut image, unit) = (image.clone(), random(extent, seed, sigma * 12f32.sqrt()));
        image.data_mut().iter_mut().zip(unit.data()).for_each(|(v, n)| *v += n);
        image
    };
    let (p, dx, dy) = (spoil(&truth, 0.3, 1), spoil(&dx, 0.09, 2), spoil(&dy, 0.09, 3));
    let full = |channels: usize, value: f32| Image::from_planes(extent, channels, vec![value; channels * extent.pixels()]).unwrap();
    let (primal, grey) = (full(3, 0.09), full(1, 3.0 * 0.0081));
    let m = Measurements { variance: Some(Variance { primal: &primal, dx: &grey, dy: &grey }), ..Measurements::new(&p, &dx, &dy) };
    let alpha = l2::L2.alpha(&m);
    let error = |alpha| {
        let (image, _) = l2::L2.solve(&m, None, alpha).unwrap();
        image.data().iter().zip(truth.data()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
    };
    let best = error(alpha);
    assert!(best < error(0.5 * alpha) && best < error(2.0 * alpha), "{alpha}: {best}, {}, {}", error(0.5 * alpha), error(2.0 * alpha));
}

#[test]
fn clamping_touches_negative_values_alone() {
    let film = film([3, 2], true);
    let mut done = reconstruct(&film, ReconstructionKind::L2, 0.2).unwrap();
    let before = done.image.clone();
    assert!(before.data().iter().any(|v| *v < 0.0));
    done.clamp();
    assert!(done.image.data().iter().zip(before.data()).all(|(a, b)| *a == b.max(0.0)));
}

#[test]
fn l1_solves_odd_films() {
    for (w, h) in [(1, 1), (1, 40), (40, 1), (2, 2), (31, 5)] {
        let extent = Extent { width: w, height: h };
        let full = |f: &dyn Fn(usize) -> f32| Image::from_planes(extent, 3, (0..3 * extent.pixels()).map(f).collect()).unwrap();
        for truth in [full(&|_| 0.0), full(&|_| 7.0), full(&|k| (k % 2) as f32), full(&|k| 10f32.powi((k % 31) as i32 - 15))] {
            let (dx, dy) = differences(&truth);
            let (image, _) = l1::L1.solve(&Measurements::new(&truth, &dx, &dy), None, 0.2).unwrap();
            let largest = truth.data().iter().fold(0.0f32, |a, b| a.max(*b));
            assert!(worst(&image, &truth) <= 1e-4 * largest, "{w}×{h}: {}", worst(&image, &truth));
        }
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let film = convergence::frame(&picture(Extent { width: 61, height: 47 }), 0);
    for kind in kinds() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| reconstruct(&film, kind, 0.2).unwrap())
        };
        assert_eq!(run(1), run(2));
        assert_eq!(run(1), run(5));
    }
}

pub(super) fn film(samples: [u32; 2], gradients: bool) -> Film {
    let extent = Extent { width: 9, height: 8 };
    let half = |seed: usize, samples: u32| HalfFilm {
        samples,
        primal: random(extent, seed, 1.0),
        primal_variance: Image::new(extent, 3),
        direct: random(extent, seed + 1, 1.0),
        gradients: gradients.then(|| Gradients {
            dx: random(extent, seed + 2, 1.0),
            dy: random(extent, seed + 3, 1.0),
            dx_variance: Image::new(extent, 1),
            dy_variance: Image::new(extent, 1),
        }),
        graph: None,
    };
    let features = Features { albedo: Image::new(extent, 3), normal: Image::new(extent, 3), depth: Image::new(extent, 1) };
    Film {
        extent,
        halves: [half(10, samples[0]), half(20, samples[1])],
        counts: None,
        motion: None,
        features,
        statistics: Statistics::default(),
    }
}

#[test]
fn halves_give_the_error_and_linear_methods_their_mean() {
    let film = film([3, 2], true);
    let done = reconstruct(&film, ReconstructionKind::L2, 0.2).unwrap();
    let both = film.combined();
    let nothing = Image::new(film.extent, 3);
    let m = measurements(&both, &film.features, &nothing, ReconstructionKind::L2).unwrap();
    let (solved, _) = l2::L2.solve(&m, None, 0.2).unwrap();
    let direct = zip(&solved, &both.direct, |p, d| p + d);
    assert!(worst(&done.image, &direct) < 1e-6);
    let [a, b] = done.halves.unwrap();
    let e = done.error.unwrap();
    // Three samples and two: 6 / 25 of the squared difference.
    assert!((e.squared.at(2, 3, 1) - 0.24 * (a.at(2, 3, 1) - b.at(2, 3, 1)).powi(2)).abs() < 1e-6 * e.squared.at(2, 3, 1));
    assert!(e.relmse > 0.0 && e.bias == 0.0);
}

#[test]
fn missing_parts_are_named() {
    let wanted = |r: Result<Reconstructed, ReconstructError>| r.unwrap_err().to_string();
    assert!(wanted(reconstruct(&film([2, 2], false), ReconstructionKind::L1, 0.2)).contains("needs gradients"));
    assert!(wanted(reconstruct(&film([2, 2], true), ReconstructionKind::L2, 0.0)).contains("alpha"));
    let one = reconstruct(&film([1, 0], true), ReconstructionKind::L2, 0.2).unwrap();
    assert!(one.error.is_none() && one.halves.is_none());
    assert!(reconstruct(&film([2, 2], false), ReconstructionKind::None, 0.2).is_ok());
    // One half alone does not tell noise from picture, and nothing else takes its place.
    for kind in [ReconstructionKind::Nfor, ReconstructionKind::Regularised] {
        assert!(kind.needs_halves() && wanted(reconstruct(&film([1, 0], true), kind, 0.2)).contains("by two halves"));
    }
    let image = film([1, 0], true).halves[0].primal.clone();
    let alone = |kind| solve(&Measurements::new(&image, &image, &image), kind, None).unwrap_err().to_string();
    assert!(alone(ReconstructionKind::Auto).contains("`auto`") && alone(ReconstructionKind::Nfor).contains("`nfor`"));
}
