//! What each reconstruction does to the mean of many frames: without bias it tends to the truth as 1/√K, with bias it stops short.

use super::*;

/// Samples of each half.
const SAMPLES: usize = 8;
/// Frames.
const FRAMES: usize = 256;
const EXTENT: Extent = Extent { width: 18, height: 13 };

/// A uniform number in [0, 1) for one sample of one value of one frame.
fn number(frame: usize, plane: usize, value: usize, sample: usize) -> f32 {
    noise(value * 64 + sample, 1 + 31 * plane + 1_000 * frame) + 0.5
}

/// Means and variances of the means over the samples of one half, where a sample is `sample(value, number)`.
fn measured(extent: Extent, frame: usize, plane: usize, sample: impl Fn(usize, f32) -> f32) -> (Image, Image) {
    let (mut means, mut variances) = (Image::new(extent, 3), Image::new(extent, 3));
    for k in 0..means.data().len() {
        let samples: Vec<f32> = (0..SAMPLES).map(|s| sample(k, number(frame, plane, k, s))).collect();
        let mean = samples.iter().sum::<f32>() / SAMPLES as f32;
        means.data_mut()[k] = mean;
        variances.data_mut()[k] = samples.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / (SAMPLES * (SAMPLES - 1)) as f32;
    }
    (means, variances)
}

fn summed(variances: &Image) -> Image {
    let mut sum = Image::new(variances.extent(), 1);
    for c in 0..3 {
        sum.data_mut().iter_mut().zip(variances.plane(c)).for_each(|(sum, v)| *sum += v);
    }
    sum
}

/// A frame of a picture. Samples are skewed as those of paths are: most are dark, so that mean and variance go together.
pub(in crate::reconstruction) fn frame(truth: &Image, frame: usize) -> Film {
    let extent = truth.extent();
    let half = |half: usize| {
        let planes = 3 * (2 * frame + half);
        let spike = |value: f32, number: f32| if number < 0.25 { 4.0 * value } else { 0.0 };
        let (primal, primal_variance) = measured(extent, 0, planes, |k, number| spike(truth.data()[k], number));
        let (gx, gy) = differences(truth);
        let pixels = extent.pixels();
        let around = |g: &Image, k: usize, number: f32, there: bool| {
            if there { g.data()[k] + 0.3 * (spike(truth.data()[k], number) - truth.data()[k]) } else { 0.0 }
        };
        let width = extent.width as usize;
        let (dx, dx_variance) = measured(extent, 0, planes + 1, |k, number| around(&gx, k, number, (k % pixels) % width + 1 < width));
        let (dy, dy_variance) =
            measured(extent, 0, planes + 2, |k, number| around(&gy, k, number, (k % pixels) / width + 1 < extent.height as usize));
        HalfFilm {
            samples: SAMPLES as u32,
            primal,
            primal_variance,
            direct: Image::new(extent, 3),
            gradients: Some(Gradients { dx, dy, dx_variance: summed(&dx_variance), dy_variance: summed(&dy_variance) }),
            graph: Some(differences_along_links(truth, planes)),
        }
    };
    Film { extent, halves: [half(0), half(1)], counts: None, motion: None, features: features(extent), statistics: Statistics::default() }
}

/// Links of a picture, with noise.
fn differences_along_links(truth: &Image, seed: usize) -> Graph {
    let mut graph = linked(truth.extent(), 4);
    for (k, ([i, j], difference)) in graph.links.iter().zip(&mut graph.differences).enumerate() {
        *difference = std::array::from_fn(|c| {
            let plane = truth.plane(c);
            plane[*j as usize] - plane[*i as usize] + 0.2 * noise(3 * k + c, 77 + seed)
        });
    }
    graph
}

/// Features that know of the picture's edge but not of its shading; what lies above the middle escaped.
pub(super) fn features(extent: Extent) -> Features {
    let (mut albedo, mut normal, mut depth) = (Image::new(extent, 3), Image::new(extent, 3), Image::new(extent, 1));
    for (x, y) in (extent.height / 8..extent.height).flat_map(|y| (0..extent.width).map(move |x| (x, y))) {
        (0..3).for_each(|c| albedo.set(x, y, c, if x * 2 > extent.width { 0.8 } else { 0.3 }));
        normal.set(x, y, 1, 1.0);
        depth.set(x, y, 0, 3.0 + y as f32);
    }
    Features { albedo, normal, depth }
}

/// How far the mean of frames is from the truth, squared and summed over values, over what the frames' spread lets expect.
struct Course {
    /// By number of frames: 16, 64, 256.
    distances: [f64; 3],
    /// What is expected of all frames.
    expected: f64,
    /// Squared bias over the truth's square.
    bias: f64,
}

fn course(kind: ReconstructionKind) -> Course {
    let truth = picture(EXTENT);
    let images: Vec<Image> = (0..FRAMES).map(|k| reconstruct(&frame(&truth, k), kind, 0.2).unwrap().image).collect();
    let values = truth.data().len();
    let mean = |k: usize, frames: usize| images[..frames].iter().map(|image| f64::from(image.data()[k])).sum::<f64>() / frames as f64;
    let distance = |frames: usize| (0..values).map(|k| (mean(k, frames) - f64::from(truth.data()[k])).powi(2)).sum::<f64>();
    let spread = |k: usize| {
        let mean = mean(k, FRAMES);
        images.iter().map(|image| (f64::from(image.data()[k]) - mean).powi(2)).sum::<f64>() / (FRAMES * (FRAMES - 1)) as f64
    };
    let expected = (0..values).map(spread).sum::<f64>();
    let distances = [FRAMES / 16, FRAMES / 4, FRAMES].map(distance);
    let square: f64 = truth.data().iter().map(|v| f64::from(*v).powi(2)).sum();
    Course { distances, expected, bias: (distances[2] - expected) / square }
}

#[test]
fn the_mean_of_frames_tends_to_the_truth_unless_the_method_is_biased() {
    for kind in kinds() {
        let Course { distances, expected, bias } = course(kind);
        let ratio = distances[2] / expected;
        eprintln!("{}: squared distances {distances:.3?}, {ratio:.2} of what is expected, relative squared bias {bias:.1e}", kind.name());
        if kind.is_unbiased() {
            // Low frequencies have most of the distance, and so it varies as a sum of few squares: some twenty of them.
            assert!((0.3..2.2).contains(&ratio), "{}", kind.name());
            assert!(distances[0] > 4.0 * distances[2], "{}", kind.name());
        } else {
            assert!(bias < 0.03, "{}: {bias}", kind.name());
        }
    }
}
