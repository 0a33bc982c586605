//! The farm on a database server and an S3 storage: the same bits as on files, whatever goes away for a while.

#![cfg(unix)]

use std::path::Path;
use std::time::{Duration, SystemTime};

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

/// How long the database is away: a few seconds, or as many as `GRADFARM_AWAY` says.
fn away() -> Duration {
    Duration::from_secs(std::env::var("GRADFARM_AWAY").ok().and_then(|seconds| seconds.parse().ok()).unwrap_or(4))
}

fn with(database: &str, storage: &s3::Server, more: &[&str]) -> With {
    let blobs = format!("s3://{}/farm", s3::Server::BUCKET);
    let arguments = ["--store", database, "--blobs", &blobs].into_iter().chain(more.iter().copied()).map(str::to_owned).collect();
    With { arguments, environment: storage.environment().into() }
}

#[test]
fn a_database_and_a_storage_that_go_away_cost_nothing_but_time() {
    let Some(mut database) = postgres::Server::start() else { return };
    let storage = s3::Server::start();
    let mut coordinator = Coordinator::start_with(with(&database.database(), &storage, &[]));
    let _workers = [coordinator.worker(1), coordinator.worker(1)];
    let job = coordinator.submit(&JOB);
    let done = coordinator.wait_for_units(&job, 10);
    assert!(done < UNITS, "{done} units were done before anything went away");
    database.stop();
    std::thread::sleep(away());
    database.restart();
    coordinator.wait_for_units(&job, 30);
    storage.fail(20);
    storage.lose_answers(3);
    wait_for("the faults of the storage", PATIENCE, || (storage.faults_left() == 0).then_some(()));
    coordinator.wait_for_units(&job, 60);
    coordinator.crash_and_restart();
    let image = coordinator.image(&job);
    JOB.reference().assert_same_bits(&image);
    assert_eq!(coordinator.units_done(&job), UNITS);
    coordinator.crash_and_restart();
    assert_eq!(coordinator.image(&job), image, "a finished job stays as it was");
}

#[test]
fn what_nobody_needs_is_removed_from_the_storage_and_the_database() {
    let storage = s3::Server::start();
    let Some(database) = postgres::shared() else { return };
    let with = with(&database.database(), &storage, &["--blob-grace", "20m", "--keep-jobs", "1ms"]);
    let mut coordinator = Coordinator::start_with(with);
    let worker = coordinator.worker(2);
    let job = coordinator.submit(&Job { samples: 16, ..JOB });
    coordinator.image(&job);
    drop(worker);
    // Folders go with the last object in them.
    let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let objects = || entries(&storage.folder().join("farm")).flat_map(|folder| entries(&folder).collect::<Vec<_>>()).collect::<Vec<_>>();
    assert!(objects().len() > 5, "results, a description, a manifest, three files");
    let yesterday = SystemTime::now() - Duration::from_secs(86_400);
    wait_for("the end of everything", PATIENCE, || {
        for object in objects() {
            // It may be removed meanwhile.
            let _gone = std::fs::File::options().write(true).open(object).and_then(|file| file.set_modified(yesterday));
        }
        // What is over for long is forgotten, and what nobody names is removed, first thing after a start.
        coordinator.crash_and_restart();
        wait_for("a while", PATIENCE, || (objects().is_empty() || coordinator.ask(&["status", &job]).is_err()).then_some(()));
        objects().is_empty().then_some(())
    });
    assert!(coordinator.ask(&["status", &job]).is_err());
}
