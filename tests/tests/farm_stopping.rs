//! Jobs that stop by their error give the same samples and bits for any workers and tiles, and if the coordinator is killed on the way. Jobs
//! that stop by time tell their samples, and as many samples give the same bits.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use gradfarm_core::output::exr;
use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Coordinator, Job};
use serde_json::Value;

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 64,
    height: 48,
    samples: 1000,
    tile: 16,
    rounds: 1,
    technique: Technique::Gpt,
};
/// Not reached at the first check, and long before the samples are used.
const TARGET: &[&str] = &["--error", "0.02"];

/// The first frame of a job.
fn frame(coordinator: &Coordinator, job: &str) -> Value {
    coordinator.job(job)["frames"][0].clone()
}

/// Samples per pixel of a frame that should have stopped for this reason.
fn stopped(coordinator: &Coordinator, job: &str, reason: &str) -> u32 {
    let frame = frame(coordinator, job);
    assert_eq!(frame["stopped"], reason, "{frame}");
    frame["samples_per_pixel"].as_u64().unwrap() as u32
}

#[test]
fn an_error_is_reached_with_the_same_bits_whoever_renders_and_whoever_dies() {
    let mut coordinator = Coordinator::start();
    let mut workers = vec![coordinator.worker(1)];
    let alone = coordinator.submit_with(&JOB, TARGET);
    let image = coordinator.image(&alone);
    let samples = stopped(&coordinator, &alone, "error");
    assert!(samples > 32 && samples < JOB.samples, "{samples} samples");
    // Half as many samples again would be a surprise; the curve has a point at each check, the last one at the end.
    let curve: Value = serde_json::from_str(&coordinator.ask(&["accuracy", &alone, "--json"]).unwrap()).unwrap();
    let points = curve["points"].as_array().unwrap();
    assert_eq!((points[0]["samples"].as_u64(), points.last().unwrap()["samples"].as_u64()), (Some(32), Some(u64::from(samples))));
    assert_eq!(curve["reached"], true);
    // As many samples without a target are the same image.
    let reference = Job { samples, ..JOB }.reference();
    reference.assert_same_bits(&image);

    workers.extend([coordinator.worker(1), coordinator.worker(1)]);
    let together = coordinator.submit_with(&Job { tile: 8, ..JOB }, TARGET);
    reference.assert_same_bits(&coordinator.image(&together));
    assert_eq!(stopped(&coordinator, &together, "error"), samples);

    // Twelve units to a pass: killed before, about and after the first check, and later.
    let hurt = coordinator.submit_with(&JOB, TARGET);
    let mut errors = Vec::new();
    for least in [10, 24, 30, 50] {
        let done = coordinator.wait_for_units(&hurt, least);
        coordinator.crash_and_restart();
        assert!(coordinator.units_done(&hurt) >= done.min(u64::from(samples / 16 * 12)));
        errors.push(frame(&coordinator, &hurt)["error"].clone());
    }
    reference.assert_same_bits(&coordinator.image(&hurt));
    assert_eq!(stopped(&coordinator, &hurt, "error"), samples);
    assert!(errors[3].is_object(), "there was a check to remember: {errors:?}");
    drop(workers);
}

#[test]
fn what_time_decided_can_be_had_again() {
    let coordinator = Coordinator::start();
    let _worker = coordinator.worker(2);
    let job = Job { samples: 1_000_000, ..JOB };
    let timed = coordinator.submit_with(&job, &["--seconds", "4"]);
    let image = coordinator.image(&timed);
    let samples = stopped(&coordinator, &timed, "seconds");
    assert!(samples >= 16 && samples.is_multiple_of(16), "{samples} samples");
    let again = coordinator.submit(&Job { samples, ..JOB });
    let again = coordinator.image(&again);
    for layer in ["", "primal", "dx", "error"] {
        let [one, other] = [&image, &again].map(|file| exr::read_layer(file, layer).unwrap());
        assert!(one.data().iter().zip(other.data()).all(|(a, b)| a.to_bits() == b.to_bits()), "layer `{layer}`");
    }
    let progress = frame(&coordinator, &timed)["progress"].clone();
    assert_eq!(progress["samples"]["done"], progress["samples"]["total"], "{progress}");
}

#[test]
fn what_cannot_be_reached_ends_with_the_best_image_and_says_so() {
    let coordinator = Coordinator::start();
    let _worker = coordinator.worker(2);
    let job = coordinator.submit_with(&Job { samples: 40, ..JOB }, &["--error", "1e-6"]);
    coordinator.image(&job);
    assert_eq!(stopped(&coordinator, &job, "samples"), 40);
    let told = coordinator.ask(&["accuracy", &job]).unwrap();
    assert!(told.contains("NOT reached: all samples were used; by the law it takes"), "{told}");
}
