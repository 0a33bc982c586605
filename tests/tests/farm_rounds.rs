//! A job in rounds gives the bits of the core alone: for any workers and tiles, and if the coordinator is killed between rounds.

#![cfg(unix)]

use gradfarm_core::plan::{Stop, Technique};
use gradfarm_tests::farm::{Coordinator, Job};

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 80,
    height: 60,
    samples: 128,
    tile: 16,
    rounds: 3,
    technique: Technique::Gpt,
};
/// 5 × 4 tiles; rounds of 42, 42 and 44 samples, of which 42, 12 and 12 are even: 3 + 1 + 1 even passes, 2 + 2 guided ones.
const UNITS: u64 = 20 * 9;

#[test]
fn workers_and_tiles_leave_no_trace() {
    let coordinator = Coordinator::start();
    let mut workers = Vec::new();
    for (count, tile) in [(1, 32), (3, 8)] {
        while workers.len() < count {
            workers.push(coordinator.worker(1));
        }
        let job = coordinator.submit(&Job { tile, ..JOB });
        JOB.reference().assert_same_bits(&coordinator.image(&job));
    }
}

#[test]
fn a_coordinator_killed_between_rounds_goes_on_where_it_stopped() {
    let mut coordinator = Coordinator::start();
    let workers = [coordinator.worker(1), coordinator.worker(1)];
    let job = coordinator.submit(&JOB);
    // While the first guide is made or just after it, and among guided units, whose guides have to be made again.
    for least in [60, 110, 150] {
        let done = coordinator.wait_for_units(&job, least);
        assert!(done < UNITS, "it is killed too late: {done} units are done");
        coordinator.crash_and_restart();
        let after = coordinator.units_done(&job);
        assert!(after >= done, "{done} units were acknowledged, {after} are left");
    }
    let image = coordinator.image(&job);
    assert_eq!(coordinator.units_done(&job), UNITS);
    JOB.reference().assert_same_bits(&image);
    drop(workers);
}

#[test]
fn a_rule_in_rounds_gives_the_same_bits_whoever_renders_and_whoever_dies() {
    let job = Job { width: 48, height: 36, samples: 1000, rounds: 5, ..JOB };
    let rule: &[&str] = &["--error", "0.01"];
    let mut coordinator = Coordinator::start();
    let mut workers = vec![coordinator.worker(1)];
    let alone = coordinator.submit_with(&job, rule);
    let image = coordinator.image(&alone);
    let frame = coordinator.job(&alone)["frames"][0].clone();
    assert_eq!(frame["stopped"], "error", "{frame}");
    let samples = frame["samples_per_pixel"].as_u64().unwrap();
    // Beyond the first round, so a guide was made; as many samples with the curve alone are the same image.
    assert!((80..1000).contains(&samples), "{samples} samples");
    let reference = Job { samples: samples as u32, ..job }.rendered(Stop { curve: true, ..Stop::default() });
    reference.assert_same_bits(&image);

    workers.extend([coordinator.worker(1), coordinator.worker(1)]);
    let together = coordinator.submit_with(&Job { tile: 12, ..job }, rule);
    reference.assert_same_bits(&coordinator.image(&together));

    // Nine units to a pass: killed in the first round, while its guide is made or just after it, and among guided units.
    let hurt = coordinator.submit_with(&job, rule);
    for least in [20, 37, 42] {
        let done = coordinator.wait_for_units(&hurt, least);
        coordinator.crash_and_restart();
        assert!(coordinator.units_done(&hurt) >= done.min(samples / 16 * 9));
    }
    reference.assert_same_bits(&coordinator.image(&hurt));
    drop(workers);
}

#[test]
fn rounds_that_cannot_be_had_are_refused() {
    let coordinator = Coordinator::start();
    let scene = tempfile::NamedTempFile::with_suffix(".json").unwrap();
    std::fs::write(scene.path(), JOB.scene).unwrap();
    let submit = |more: &[&str]| coordinator.ask(&[&["submit", scene.path().to_str().unwrap()], more].concat()).unwrap_err();
    let many = submit(&["--samples", "64", "--rounds", "9"]);
    assert!(many.contains("rounds: found 9, expected 1 to 8 with 64 samples per pixel"), "{many}");
    let wide = submit(&["--rounds", "2", "--tile", "512"]);
    assert!(wide.contains("1 to 256 pixels with several rounds"), "{wide}");
}
