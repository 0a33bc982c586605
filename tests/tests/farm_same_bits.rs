//! The same job gives the same bits for any number of worker processes, any number of threads, any tile size: those of the core alone.

use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Coordinator, Job};

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 100,
    height: 70,
    samples: 48,
    tile: 64,
    rounds: 1,
    technique: Technique::Gpt,
};

#[test]
fn workers_threads_and_tiles_leave_no_trace() {
    let coordinator = Coordinator::start();
    let mut workers = Vec::new();
    for (count, threads, tile) in [(1, 1, 64), (2, 1, 16), (3, 2, 37)] {
        while workers.len() < count {
            workers.push(coordinator.worker(threads));
        }
        let job = coordinator.submit(&Job { tile, ..JOB });
        JOB.reference().assert_same_bits(&coordinator.image(&job));
    }
}
