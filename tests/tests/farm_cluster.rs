//! Two coordinators on one database and one storage: whichever dies, the other one goes on with all jobs, to the same bits.

#![cfg(unix)]

use std::time::{Duration, Instant};

use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Coordinator, Job, PATIENCE, With, wait_for};
use gradfarm_tests::{postgres, s3};

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

/// Two coordinators that share everything.
fn pair(storage: &s3::Server) -> Option<[Coordinator; 2]> {
    let database = postgres::shared()?.database();
    let blobs = format!("s3://{}/farm", s3::Server::BUCKET);
    let arguments = ["--store", &database, "--blobs", &blobs].map(str::to_owned).into();
    let with = With { arguments, environment: storage.environment().into() };
    Some([Coordinator::start_with(with.clone()), Coordinator::start_with(with)])
}

/// How long a job that was another's takes to be answered for.
fn takeover(survivor: &Coordinator, job: &str, since: Instant) -> Duration {
    wait_for("a new owner of the job", PATIENCE, || survivor.ask(&["status", job, "--json"]).ok());
    since.elapsed()
}

#[test]
fn a_killed_coordinator_is_replaced_by_the_other_one_and_the_bits_are_the_same() {
    let storage = s3::Server::start();
    let Some([mut first, second]) = pair(&storage) else { return };
    let _workers = [Coordinator::worker_of(&[&first, &second], 1), Coordinator::worker_of(&[&second, &first], 1)];
    let job = first.submit(&JOB);
    let done = second.wait_for_units(&job, 10);
    assert!(done < UNITS, "it is killed too late: {done} units are done");
    assert!(second.ask(&["status", "--json"]).unwrap().contains(&job), "the list has jobs of all coordinators");
    first.kill();
    println!("takeover after a kill: {:?}", takeover(&second, &job, Instant::now()));
    assert!(second.units_done(&job) >= done, "{done} units were acknowledged, {} are left", second.units_done(&job));
    let image = second.image(&job);
    JOB.reference().assert_same_bits(&image);
    assert_eq!(second.units_done(&job), UNITS);
}

#[test]
fn a_coordinator_that_hung_is_fenced_off_and_one_that_stops_hands_over() {
    let storage = s3::Server::start();
    let Some([mut first, mut second]) = pair(&storage) else { return };
    let _workers = [Coordinator::worker_of(&[&first, &second], 1), Coordinator::worker_of(&[&first, &second], 1)];
    let job = first.submit(&JOB);
    first.wait_for_units(&job, 10);
    first.signal("STOP");
    println!("takeover from one that hangs: {:?}", takeover(&second, &job, Instant::now()));
    first.signal("CONT");
    assert_eq!(first.end(PATIENCE).code(), Some(1), "it finds out that others hold it for dead, and ends");
    second.wait_for_units(&job, 60);
    // It comes back as a new run and takes over from the other one, which is told to stop.
    first.restart();
    second.signal("TERM");
    assert_eq!(second.end(PATIENCE).code(), Some(0));
    println!("takeover from one that stops: {:?}", takeover(&first, &job, Instant::now()));
    let image = first.image(&job);
    JOB.reference().assert_same_bits(&image);
}

#[test]
fn a_token_stands_for_one_job_at_all_coordinators_and_any_of_them_answers() {
    let storage = s3::Server::start();
    let Some([first, second]) = pair(&storage) else { return };
    let token = ["--client-token", "only once"];
    let small = Job { samples: 16, ..JOB };
    let job = first.submit_with(&small, &token);
    assert_eq!(second.submit_with(&small, &token), job);
    assert_eq!(first.submit_with(&small, &token), job);
    second.ask(&["pause", &job]).unwrap();
    assert_eq!(first.job(&job)["paused"], true);
    second.ask(&["resume", &job]).unwrap();
    let _worker = Coordinator::worker_of(&[&second, &first], 2);
    assert_eq!(second.image(&job), first.image(&job));
    let other = second.submit_with(&small, &["--client-token", "another"]);
    for coordinator in [&first, &second] {
        let list = coordinator.ask(&["status", "--json"]).unwrap();
        assert!(list.contains(&job) && list.contains(&other), "{list}");
    }
}
