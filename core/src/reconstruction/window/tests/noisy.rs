//! What windows are worth on noisy clips, and whether those that claim no bias have none.

use super::clip::brightening;
use super::*;

/// Mean squared error of images, and mean squared error of their change from moment to moment: flicker.
fn errors(images: &[Image], truth: &[Image]) -> [f64; 2] {
    let values = images[0].data().len();
    let off = |t: usize, i: usize| f64::from(images[t].data()[i]) - f64::from(truth[t].data()[i]);
    let error: f64 = (0..images.len()).flat_map(|t| (0..values).map(move |i| off(t, i).powi(2))).sum();
    let flicker: f64 = (1..images.len()).flat_map(|t| (0..values).map(move |i| (off(t, i) - off(t - 1, i)).powi(2))).sum();
    [error / (images.len() * values) as f64, flicker / ((images.len() - 1) * values) as f64]
}

#[test]
fn a_window_has_less_error_and_less_flicker_than_frames_by_themselves() {
    let extent = Extent { width: 32, height: 24 };
    // A picture that brightens, one that also loses its random numbers in a corner, and one that rests.
    let clips: [(&str, f32, clip::Pixels); 3] =
        [("rests", 0.0, clip::NOWHERE), ("brightens", 0.05, clip::NOWHERE), ("partly new", 0.05, |x, y| x < 12 && y < 12)];
    for (name, pace, fresh) in clips {
        let clip = Clip { fresh, ..Clip::new(brightening(extent, 8, pace)) };
        let moments = clip.moments();
        for kind in kinds().filter(|kind| *kind != ReconstructionKind::None) {
            let together = errors(&images(solve(&refs(&moments), kind, None).unwrap()), &clip.truth);
            let alone: Vec<Image> = moments.iter().flat_map(|moment| images(solve(&[moment], kind, None).unwrap())).collect();
            let alone = errors(&alone, &clip.truth);
            eprintln!("{name}, {}: error {:.3}, flicker {:.3}", kind.name(), together[0] / alone[0], together[1] / alone[1]);
            assert!(together[0] < 0.7 * alone[0] && together[1] < 0.5 * alone[1], "{name}, {}: {together:?} {alone:?}", kind.name());
        }
    }
}

/// The mean of many windows tends to the truth as one over the root of their number, where there is no bias.
#[test]
fn means_of_many_windows_tend_to_the_truth() {
    const RUNS: u64 = 192;
    for kind in [ReconstructionKind::None, ReconstructionKind::L2, ReconstructionKind::WeightedL2] {
        let extent = Extent { width: 10, height: 8 };
        let truth = brightening(extent, 4, 0.2);
        let mut sums = vec![[0.0f64; 2]; 4 * extent.pixels() * 3];
        for seed in 0..RUNS {
            let clip = Clip { seed, samples: 4, fresh: |x, _| x < 4, ..Clip::new(truth.clone()) };
            let moments = clip.moments();
            let solved = images(solve(&refs(&moments), kind, None).unwrap());
            for (sum, v) in sums.iter_mut().zip(solved.iter().flat_map(|image| image.data())) {
                sum[0] += f64::from(*v);
                sum[1] += f64::from(*v).powi(2);
            }
        }
        let n = RUNS as f64;
        let z: Vec<f64> = sums
            .iter()
            .zip(truth.iter().flat_map(|image| image.data()))
            .filter_map(|(sum, truth)| {
                let mean = sum[0] / n;
                let variance = (sum[1] / n - mean * mean) / (n - 1.0);
                (variance > 0.0).then(|| (mean - f64::from(*truth)) / variance.sqrt())
            })
            .collect();
        let square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
        let worst = z.iter().fold(0.0f64, |worst, z| worst.max(z.abs()));
        eprintln!("{}: mean square z {square:.3}, worst {worst:.2} of {}", kind.name(), z.len());
        // Values of one image go together, so the mean square of 960 spreads as that of far fewer: about a hundred, 1 ± 0.15.
        assert!(square < 1.7 && worst < 5.5, "{}: {square}, {worst}", kind.name());
    }
}
