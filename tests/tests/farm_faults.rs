//! Whatever is killed, and whenever: the job ends, and in the same bits as if nothing had happened.

#![cfg(unix)]

use std::time::Duration;

use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Coordinator, Job};

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 80,
    height: 60,
    samples: 128,
    tile: 16,
    rounds: 1,
    technique: Technique::Gpt,
};
/// 5 × 4 tiles, 8 sample ranges each.
const UNITS: u64 = 160;

#[test]
fn a_killed_worker_changes_nothing() {
    let coordinator = Coordinator::start();
    let (mut first, _second) = (coordinator.worker(1), coordinator.worker(1));
    let job = coordinator.submit(&JOB);
    let done = coordinator.wait_for_units(&job, 10);
    first.kill();
    assert!(done < UNITS, "it was killed too late: {done} units were done");
    let _third = coordinator.worker(1);
    let image = coordinator.image(&job);
    assert_eq!(coordinator.units_done(&job), UNITS);
    JOB.reference().assert_same_bits(&image);
}

#[test]
fn a_killed_coordinator_goes_on_where_it_stopped() {
    let mut coordinator = Coordinator::start();
    let _workers = [coordinator.worker(1), coordinator.worker(1)];
    let job = coordinator.submit(&JOB);
    for least in [5, 50] {
        let done = coordinator.wait_for_units(&job, least);
        assert!(done < UNITS, "it is killed too late: {done} units are done");
        coordinator.crash_and_restart();
        let after = coordinator.units_done(&job);
        assert!(after >= done, "{done} units were acknowledged, {after} are left");
    }
    let image = coordinator.image(&job);
    JOB.reference().assert_same_bits(&image);
    coordinator.crash_and_restart();
    assert_eq!(coordinator.image(&job), image, "a finished job stays as it was");
}

#[test]
fn a_worker_told_to_stop_hands_back_what_it_holds() {
    let coordinator = Coordinator::start();
    let mut leaving = coordinator.worker(2);
    let job = coordinator.submit(&JOB);
    coordinator.wait_for_units(&job, 10);
    leaving.signal("TERM");
    assert_eq!(leaving.end(Duration::from_secs(15)).code(), Some(0));
    let _staying = coordinator.worker(2);
    JOB.reference().assert_same_bits(&coordinator.image(&job));
}

#[test]
fn a_worker_that_finds_nobody_waits_and_stops_when_told() {
    let coordinator = Coordinator::start();
    let mut worker = coordinator.worker(1);
    drop(coordinator);
    std::thread::sleep(Duration::from_millis(300));
    worker.signal("INT");
    assert_eq!(worker.end(Duration::from_secs(5)).code(), Some(0));
}
