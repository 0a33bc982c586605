//! Links between similar pixels give the bits of the core alone, whichever workers find them and however the film is cut.

use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Coordinator, Job};

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 80,
    height: 60,
    samples: 32,
    tile: 64,
    rounds: 1,
    technique: Technique::Graph,
};

#[test]
fn workers_threads_and_tiles_leave_no_trace() {
    let coordinator = Coordinator::start();
    let mut workers = Vec::new();
    for (count, threads, tile) in [(1, 1, 64), (2, 2, 13)] {
        while workers.len() < count {
            workers.push(coordinator.worker(threads));
        }
        let job = coordinator.submit(&Job { tile, ..JOB });
        JOB.reference().assert_same_bits(&coordinator.image(&job));
    }
}
