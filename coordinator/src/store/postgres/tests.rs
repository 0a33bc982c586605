//! What only a database on a server can do: go away, lose an answer, have several writers.

use std::time::Duration;

use sqlx::postgres::PgConnectOptions;

use super::*;
use crate::job::JobRecord;
use crate::job::tests::record;
use crate::postgres::{Server, shared};
use crate::store::Owner;

async fn database() -> Option<PgConnectOptions> {
    let uri = tokio::task::spawn_blocking(|| shared().map(Server::database)).await.unwrap();
    Some(uri?.parse().unwrap())
}

fn submitted(record: &JobRecord) -> Change {
    Change::Submitted(Box::new(record.clone()))
}

/// A coordinator that others can find.
fn presence(port: u16) -> Presence {
    Presence { http: format!("http://127.0.0.1:{port}"), grpc: format!("http://127.0.0.1:{}", port + 1), ..Presence::hidden() }
}

/// A job that belongs to whoever writes it, begun.
fn begun(record: &JobRecord) -> [Change; 3] {
    let (job, worker) = (record.id, crate::job::WorkerId::fresh());
    let at = crate::job::Timestamp::from_millis(0);
    let result = crate::job::tests::result(0, false);
    [submitted(record), Change::Leased { job, unit: 0, epoch: 1, worker, at }, Change::Delivered { job, unit: 0, epoch: 1, worker, result }]
}

#[tokio::test]
async fn everything_is_kept_over_a_restart_and_the_older_run_is_fenced_off() {
    let Some(options) = database().await else { return };
    let presence = presence(1);
    let first = Postgres::open(&options, &presence).await.unwrap();
    let kept = record("kept");
    first.commit(&begun(&kept)).await.unwrap();
    let second = Postgres::open(&options, &presence).await.unwrap();
    let taken = second.adopt().await.unwrap();
    assert_eq!(taken, first.jobs().await.unwrap());
    assert_eq!(taken[0].units.len(), 1);
    let late = record("late");
    for _ in 0..2 {
        assert!(matches!(first.commit(&[submitted(&late)]).await, Err(StoreError::Fenced)));
        assert!(matches!(first.adopt().await, Err(StoreError::Fenced)));
    }
    second.commit(&[submitted(&record("next"))]).await.unwrap();
    let names: Vec<String> = second.jobs().await.unwrap().into_iter().map(|job| job.record.name).collect();
    assert_eq!(names, ["kept", "next"]);
}

#[tokio::test]
async fn every_job_has_one_owner_and_goes_to_another_one_when_that_is_gone() {
    let Some(options) = database().await else { return };
    let [a, b] = [Postgres::open(&options, &presence(1)).await.unwrap(), Postgres::open(&options, &presence(3)).await.unwrap()];
    let mine = JobRecord { client_token: Some("token".into()), ..record("of a") };
    a.commit(&begun(&mine)).await.unwrap();
    let other = record("of b");
    b.commit(&[submitted(&other)]).await.unwrap();
    assert_eq!((a.adopt().await.unwrap(), b.adopt().await.unwrap()), (vec![], vec![]));
    assert_eq!(a.owner(mine.id).await.unwrap(), Some(Owner::Here));
    assert_eq!(b.owner(mine.id).await.unwrap(), Some(Owner::At("http://127.0.0.1:1".into())));
    assert_eq!(b.owner(JobId::fresh()).await.unwrap(), None);
    assert_eq!(b.peers().await.unwrap().into_iter().map(|peer| peer.grpc).collect::<Vec<_>>(), ["http://127.0.0.1:2"]);
    // A token stands for one job, whoever is asked.
    let again = JobRecord { id: JobId::fresh(), ..mine.clone() };
    assert!(matches!(b.commit(&[submitted(&again)]).await, Err(StoreError::Conflict { .. })));
    assert_eq!(b.job_of_token("token").await.unwrap(), Some(mine.clone()));
    // A goes away in an orderly manner.
    a.leave().await.unwrap();
    assert_eq!(b.owner(mine.id).await.unwrap(), Some(Owner::Nobody));
    let taken = b.adopt().await.unwrap();
    assert_eq!((taken.len(), &taken[0].record, taken[0].units.len()), (1, &mine, 1));
    assert_eq!(b.owner(mine.id).await.unwrap(), Some(Owner::Here));
    assert_eq!(b.adopt().await.unwrap(), []);
    assert!(matches!(a.commit(&[]).await, Err(StoreError::Fenced)));
}

#[tokio::test]
async fn who_is_silent_is_dead_after_a_while_and_jobs_are_shared_out_once() {
    let Some(options) = database().await else { return };
    let silent = Postgres::open(&options, &presence(1)).await.unwrap();
    let records: Vec<JobRecord> = (0..40).map(|k| record(&format!("job {k}"))).collect();
    silent.commit(&records.iter().map(submitted).collect::<Vec<_>>()).await.unwrap();
    let heirs = [Postgres::open(&options, &presence(3)).await.unwrap(), Postgres::open(&options, &presence(5)).await.unwrap()];
    let begun = std::time::Instant::now();
    let mut taken = Vec::new();
    while taken.len() < records.len() {
        let [a, b] = tokio::join!(heirs[0].adopt(), heirs[1].adopt()).into();
        taken.extend(a.unwrap().into_iter().chain(b.unwrap()).map(|job| job.record.name));
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    println!("40 jobs of a silent coordinator were taken over after {:?}", begun.elapsed());
    assert!(begun.elapsed() >= Duration::from_millis(cluster::DEAD.unsigned_abs()), "nobody is dead at once");
    taken.sort();
    let mut expected: Vec<String> = records.iter().map(|record| record.name.clone()).collect();
    expected.sort();
    assert_eq!(taken, expected, "each job once");
    assert!(matches!(silent.commit(&[]).await, Err(StoreError::Fenced)));
    assert!(matches!(silent.adopt().await, Err(StoreError::Fenced)));
}

#[tokio::test]
async fn a_commit_whose_answer_was_lost_is_not_made_twice() {
    let Some(options) = database().await else { return };
    let store = Postgres::open(&options, &Presence::hidden()).await.unwrap();
    let change = [submitted(&record("once"))];
    for _ in 0..3 {
        // A conflict if it were made twice.
        store.attempt(&mut None, 1, &change).await.unwrap();
    }
    assert_eq!(store.jobs().await.unwrap().len(), 1);
    // This run may have ended meanwhile: what was committed counts all the same, and nothing more is.
    store.leave().await.unwrap();
    store.attempt(&mut None, 1, &change).await.unwrap();
    assert!(matches!(store.attempt(&mut None, 2, &[]).await, Err(StoreError::Fenced)));
}

#[tokio::test]
async fn one_at_a_time_sweeps() {
    let Some(options) = database().await else { return };
    let store = Postgres::open(&options, &Presence::hidden()).await.unwrap();
    let alone = store.alone(Singleton::Sweep).await.unwrap();
    assert!(alone.is_some() && store.alone(Singleton::Sweep).await.unwrap().is_none());
    drop(alone);
    // The server notices that the connection is gone a moment later.
    while store.alone(Singleton::Sweep).await.unwrap().is_none() {}
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_goes_away_and_comes_back_costs_nothing_but_time() {
    let Some(server) = tokio::task::spawn_blocking(Server::start).await.unwrap() else { return };
    let store = std::sync::Arc::new(Postgres::open(&server.database().parse().unwrap(), &Presence::hidden()).await.unwrap());
    let writer = store.clone();
    let records: Vec<JobRecord> = (0..300).map(|k| record(&format!("job {k}"))).collect();
    let submitting = records.clone();
    let (tell, mut told) = tokio::sync::watch::channel(0);
    let writing = tokio::spawn(async move {
        for (count, record) in submitting.iter().enumerate() {
            writer.commit(&[submitted(record)]).await.unwrap();
            tell.send_replace(count + 1);
        }
    });
    let (server, reading) = (std::sync::Mutex::new(server), store.clone());
    for least in [10, 100] {
        told.wait_for(|count| *count >= least).await.unwrap();
        tokio::task::block_in_place(|| server.lock().unwrap().stop());
        // A read that begins while the server is away waits for it, too.
        let patient = tokio::spawn({
            let store = reading.clone();
            async move { store.jobs().await.unwrap().len() }
        });
        tokio::time::sleep(Duration::from_millis(500)).await;
        tokio::task::block_in_place(|| server.lock().unwrap().restart());
        assert!(patient.await.unwrap() >= least);
    }
    writing.await.unwrap();
    let found: Vec<JobRecord> = store.jobs().await.unwrap().into_iter().map(|job| job.record).collect();
    assert!(found == records, "every acknowledged job, once and in order");
}
