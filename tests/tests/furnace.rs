//! Scenes with closed forms, through every technique and every reconstruction that applies to it.
//!
//! Significance: each of some hundred comparisons fails correct code with probability 10⁻⁵, so all together with about 10⁻³.

#![allow(clippy::unwrap_used)]

use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{ReconstructionKind, Request, Technique};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_tests::frame::render;
use gradfarm_tests::scenes::{ClosedForm, closed_forms, plan};
use gradfarm_tests::statistics::{Comparison, Estimate, student_tail};

const LEVEL: f64 = 1e-5;
const EXTENT: Extent = Extent { width: 6, height: 6 };
const SEEDS: u64 = 16;
const SAMPLES: u32 = 96;
/// What f32 may add to a closed form, relative.
const ROUNDING: f64 = 1e-5;
/// L1 follows the median more than the mean, and regression the window; this much they may be off, relative to the frame's mean.
const BIAS: f64 = 0.02;

/// Images by seed, planes one after the other, for each reconstruction that applies.
fn images(form: &ClosedForm, technique: Technique, max_depth: u32) -> Vec<(ReconstructionKind, Vec<Vec<f64>>)> {
    let kinds = ReconstructionKind::ALL.into_iter().filter(|kind| technique.takes(*kind) && kind.is_reproducible());
    let films: Vec<_> = (0..SEEDS)
        .map(|seed| {
            let request = Request {
                technique: Some(technique),
                samples: Some(SAMPLES),
                extent: Some(EXTENT),
                max_depth: Some(max_depth),
                reuse_edge: Some(3),
                seed,
                ..Request::default()
            };
            render(&form.scene, &plan(&form.description, &request)).unwrap()
        })
        .collect();
    kinds
        .map(|kind| {
            let image = |film| reconstruct(film, kind, 0.2).unwrap().image.data().iter().map(|v| f64::from(*v)).collect();
            (kind, films.iter().map(image).collect())
        })
        .collect()
}

fn check(form: &ClosedForm, technique: Technique, max_depth: u32) {
    let mut expected = vec![0.0; 3 * EXTENT.pixels()];
    for (x, y) in (0..EXTENT.height).flat_map(|y| (0..EXTENT.width).map(move |x| (x, y))) {
        for (channel, value) in form.pixel(EXTENT, max_depth, x, y).into_iter().enumerate() {
            expected[channel * EXTENT.pixels() + EXTENT.index(x, y)] = value;
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    for (kind, runs) in images(form, technique, max_depth) {
        let what = format!("{}, {} and {}, at most {max_depth} edges", form.name, technique.name(), kind.name());
        let biased = if kind.is_unbiased() { 0.0 } else { BIAS };
        let known = |value: f64| Estimate::known(value, (ROUNDING + biased) * value);
        let frames = Estimate::of(&runs.iter().map(|run| mean(run)).collect::<Vec<_>>());
        let whole = frames.t(&known(mean(&expected)));
        let pixels = Comparison::of(expected.iter().enumerate().map(|(k, value)| {
            let measured: Vec<f64> = runs.iter().map(|run| run[k]).collect();
            (Estimate::of(&measured), known(*value))
        }));
        eprintln!("{what}: mean {:.6} of {:.6}, t {:.2?}; worst |t| of a pixel {:.2}", frames.mean, mean(&expected), whole, pixels.worst);
        assert!(whole.is_none_or(|(t, freedom)| student_tail(t, freedom) > LEVEL), "{what}: the frame's mean");
        assert!(pixels.agrees(LEVEL), "{what}: pixel value {} has a chance of {:e}", pixels.place, pixels.chance);
        assert_eq!(pixels.still, 0.0, "{what}: values that never vary");
    }
}

#[test]
fn closed_forms_hold_for_every_technique_and_reconstruction() {
    for form in closed_forms().unwrap() {
        for technique in Technique::ALL {
            for max_depth in form.depths {
                check(&form, technique, *max_depth);
            }
        }
    }
}
