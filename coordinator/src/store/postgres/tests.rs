//! What only a database on a server can do: go away, lose an answer, have several writers.

use std::time::Duration;

use sqlx::postgres::PgConnectOptions;

use super::*;
use crate::job::JobRecord;
use crate::job::tests::record;
use crate::postgres::{Server, shared};

async fn database() -> Option<PgConnectOptions> {
    let uri = tokio::task::spawn_blocking(|| shared().map(Server::database)).await.unwrap();
    Some(uri?.parse().unwrap())
}

fn submitted(record: &JobRecord) -> Change {
    Change::Submitted(Box::new(record.clone()))
}

#[tokio::test]
async fn everything_is_kept_over_a_restart_and_the_older_run_is_fenced_off() {
    let Some(options) = database().await else { return };
    let first = Postgres::open(&options).await.unwrap();
    let kept = record("kept");
    first.commit(&[submitted(&kept)]).await.unwrap();
    let second = Postgres::open(&options).await.unwrap();
    assert_eq!(second.jobs().await.unwrap(), first.jobs().await.unwrap());
    let late = record("late");
    for _ in 0..2 {
        assert!(matches!(first.commit(&[submitted(&late)]).await, Err(StoreError::Fenced)));
    }
    second.commit(&[submitted(&record("next"))]).await.unwrap();
    let names: Vec<String> = second.jobs().await.unwrap().into_iter().map(|job| job.record.name).collect();
    assert_eq!(names, ["kept", "next"]);
}

#[tokio::test]
async fn a_commit_whose_answer_was_lost_is_not_made_twice() {
    let Some(options) = database().await else { return };
    let store = Postgres::open(&options).await.unwrap();
    let change = [submitted(&record("once"))];
    for _ in 0..3 {
        // A conflict if it were made twice.
        store.attempt(&mut None, 1, &change).await.unwrap();
    }
    assert_eq!(store.jobs().await.unwrap().len(), 1);
    // Another run may meanwhile have ended this one: what was committed counts all the same, and nothing more is.
    let _other = Postgres::open(&options).await.unwrap();
    store.attempt(&mut None, 1, &change).await.unwrap();
    assert!(matches!(store.attempt(&mut None, 2, &[]).await, Err(StoreError::Fenced)));
}

#[tokio::test]
async fn one_at_a_time_sweeps() {
    let Some(options) = database().await else { return };
    let store = Postgres::open(&options).await.unwrap();
    let alone = store.alone(Singleton::Sweep).await.unwrap();
    assert!(alone.is_some() && store.alone(Singleton::Sweep).await.unwrap().is_none());
    drop(alone);
    // The server notices that the connection is gone a moment later.
    while store.alone(Singleton::Sweep).await.unwrap().is_none() {}
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_goes_away_and_comes_back_costs_nothing_but_time() {
    let Some(server) = tokio::task::spawn_blocking(Server::start).await.unwrap() else { return };
    let store = std::sync::Arc::new(Postgres::open(&server.database().parse().unwrap()).await.unwrap());
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
