//! Kills and pauses at random moments, many of them: no accepted job and no acknowledged unit is lost, nothing counts twice, and every image
//! has the bits that it has undisturbed.
//!
//! `GRADFARM_CHAOS=1000` disturbs so often, `GRADFARM_CHAOS_SEED=7` otherwise.

#![cfg(unix)]

use std::time::{Duration, Instant};

use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Coordinator, Job, Process};

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 64,
    height: 48,
    samples: 96,
    tile: 16,
    rounds: 1,
    technique: Technique::Gpt,
};
/// 4 × 3 tiles, 6 sample ranges each.
const UNITS: u64 = 72;
/// Longer than a lease is good without a word from its worker.
const PAST_THE_LEASE: Duration = Duration::from_secs(17);

#[derive(Clone, Copy, Debug)]
enum Disturbance {
    KillCoordinator,
    PauseCoordinator(Duration),
    KillWorker(usize),
    PauseWorker(usize, Duration),
}

/// Which disturbances come when; the same for the same seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % most
    }

    fn millis(&mut self, most: u64) -> Duration {
        Duration::from_millis(self.below(most))
    }

    fn disturbance(&mut self, workers: usize) -> Disturbance {
        let worker = self.below(workers as u64) as usize;
        match self.below(8) {
            0 | 1 => Disturbance::KillCoordinator,
            2 => Disturbance::PauseCoordinator(self.millis(1000)),
            3 | 4 => Disturbance::PauseWorker(worker, self.millis(1000)),
            _ => Disturbance::KillWorker(worker),
        }
    }
}

/// A number from the environment.
fn setting(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text} is no number")))
}

/// An accepted job, and how many of its units were acknowledged.
struct Accepted {
    id: String,
    done: u64,
}

struct Chaos {
    coordinator: Coordinator,
    workers: Vec<Process>,
    accepted: Vec<Accepted>,
}

impl Chaos {
    fn disturb(&mut self, disturbance: Disturbance) {
        match disturbance {
            Disturbance::KillCoordinator => self.coordinator.crash_and_restart(),
            Disturbance::PauseCoordinator(time) => {
                self.coordinator.signal("STOP");
                std::thread::sleep(time);
                self.coordinator.signal("CONT");
            }
            Disturbance::KillWorker(worker) => {
                self.workers[worker].kill();
                self.workers[worker] = self.coordinator.worker(1);
            }
            Disturbance::PauseWorker(worker, time) => {
                self.workers[worker].signal("STOP");
                std::thread::sleep(time);
                self.workers[worker].signal("CONT");
            }
        }
    }

    /// Looks at every job that is not over; how many there are.
    fn look(&mut self) -> usize {
        let mut open = 0;
        for job in self.accepted.iter_mut().filter(|job| job.done < UNITS) {
            let done = self.coordinator.units_done(&job.id);
            assert!(done >= job.done, "{} units of job {} were acknowledged, {done} are left", job.done, job.id);
            assert!(done <= UNITS, "{done} units of job {} count, which has {UNITS}", job.id);
            job.done = done;
            open += usize::from(done < UNITS);
        }
        open
    }
}

#[test]
fn nothing_is_lost_and_no_bit_changes() {
    let (disturbances, seed) = (setting("GRADFARM_CHAOS", 20), setting("GRADFARM_CHAOS_SEED", 1));
    println!("to see this again: GRADFARM_CHAOS={disturbances} GRADFARM_CHAOS_SEED={seed} cargo test -p gradfarm-tests --test farm_chaos");
    let mut dice = Dice(seed);
    let coordinator = Coordinator::start();
    let workers = (0..2).map(|_| coordinator.worker(1)).collect();
    // One is as if dead until its leases are long over, and then delivers what it held.
    let sleeper = coordinator.worker(1);
    let mut chaos = Chaos { coordinator, workers, accepted: Vec::new() };
    let started = Instant::now();
    let mut asleep = None;
    for _ in 0..disturbances {
        while chaos.look() < 2 {
            let id = chaos.coordinator.submit(&JOB);
            chaos.accepted.push(Accepted { id, done: 0 });
        }
        std::thread::sleep(dice.millis(400));
        if asleep.is_none() && started.elapsed() > Duration::from_secs(1) {
            sleeper.signal("STOP");
            asleep = Some(Instant::now());
        }
        let disturbance = dice.disturbance(chaos.workers.len());
        chaos.disturb(disturbance);
    }
    if let Some(since) = asleep {
        std::thread::sleep(PAST_THE_LEASE.saturating_sub(since.elapsed()));
        sleeper.signal("CONT");
    }
    for job in &chaos.accepted {
        let image = chaos.coordinator.image(&job.id);
        assert_eq!(chaos.coordinator.units_done(&job.id), UNITS);
        JOB.reference().assert_same_bits(&image);
    }
    println!("{} jobs over {disturbances} disturbances in {:.0} s", chaos.accepted.len(), started.elapsed().as_secs_f64());
}
