//! There and back again: what comes back is what was there.

use super::*;
use crate::job::tests::windows::{record_with_windows, solved};
use crate::job::tests::{record, record_with_checks, result};
use crate::job::{Attempt, Change, Ending, FileKind, FileRecord, Frame, JobState, Timestamp, Witness, WorkerId};
use crate::postgres::{Server, shared};
use crate::store::Presence;
use crate::store::sql::Value;
use gradfarm_core::accuracy::{Estimate, Point};
use gradfarm_proto::Digest;

/// Jobs of every kind in every state, with something in every table.
async fn fill(store: &StoreUri) {
    let store = store.open(true, &Presence::hidden()).await.unwrap();
    let worker = WorkerId::fresh();
    for (k, mut record) in [record("plain “name”"), record_with_checks(), record_with_windows()].into_iter().enumerate() {
        record.client_token = (k == 1).then(|| "token".into());
        record.priority = -3;
        let job = record.id;
        let error = Estimate { relmse: 1e-300, low: 0.1 + 0.2, high: f64::MAX };
        let point = Point { samples: 8, cpu_seconds: 1.0 / 3.0, wall_seconds: 1.0, check_seconds: 0.0, error };
        let frame = Frame { points: vec![point], choice: Some("l2".into()), ..Frame::waiting(20) };
        let at = Timestamp::from_millis(5);
        let attempt = Attempt { worker, epoch: 1, at, ending: Ending::Failed, reason: "no memory".into() };
        let mut changes = vec![
            Change::Submitted(Box::new(record)),
            Change::Worker { worker, name: "w".into(), version: "1".into(), threads: 2, at },
            Change::Frame { job, position: 0, frame: Box::new(frame) },
            Change::Leased { job, unit: 0, epoch: 1, worker, at },
            Change::Delivered { job, unit: 0, epoch: 1, worker, result: result(0, false) },
            Change::Leased { job, unit: 1, epoch: 1, worker, at },
            Change::Attempt { job, unit: 1, number: 0, attempt },
            Change::Leased { job, unit: 2, epoch: 1, worker, at },
            Change::Witness { job, unit: 2, witness: Witness { epoch: 1, worker, content: Digest::of(b"it") } },
            Change::File { job, position: 0, file: FileRecord { kind: FileKind::Png, blob: Digest::of(b"png"), size: 1 << 40 } },
        ];
        if k == 2 {
            changes.push(Change::Window { job, window: 0, solved: Box::new(solved(3)) });
            changes.push(Change::Job { job, state: JobState::Done, error: None, started: Some(at), finished: Some(at) });
        }
        store.commit(&changes).await.unwrap();
    }
    if let Some(cluster) = store.cluster() {
        cluster.leave().await.unwrap();
    }
}

/// Everything that a store holds, in a fixed order.
async fn contents(store: &StoreUri) -> Vec<(String, Vec<Vec<Value>>)> {
    let mut side = open(store, None).await.unwrap();
    let mut all = Vec::new();
    for table in catalogue::tables(&mut side).await.unwrap() {
        let mut rows = Vec::new();
        let each = |row| {
            rows.push(table.values(&row)?);
            Ok(())
        };
        side.on().each(Statement::of_names(table.select()), each).await.unwrap();
        rows.sort_by_key(|row| format!("{row:?}"));
        all.push((table.name, rows));
    }
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all
}

#[tokio::test]
async fn from_a_file_to_a_server_and_back_nothing_changes() {
    let database = tokio::task::spawn_blocking(|| shared().map(Server::database)).await.unwrap();
    let Some(database) = database else { return };
    let folder = tempfile::tempdir().unwrap();
    let [first, last] = ["first.db", "last.db"].map(|name| StoreUri::Sqlite(folder.path().join(name)));
    let server: StoreUri = database.parse().unwrap();
    fill(&first).await;
    let before = contents(&first).await;
    for name in ["attempts", "files", "frames", "jobs", "leases", "points", "results", "shares", "units", "windows", "witnesses", "workers"]
    {
        assert!(before.iter().any(|(table, rows)| table == name && !rows.is_empty()), "nothing in {name}");
    }
    let there = migrate(&first, &server).await.unwrap();
    let back = migrate(&server, &last).await.unwrap();
    assert_eq!(there.iter().map(|(_, rows)| rows).sum::<u64>(), before.iter().map(|(_, rows)| rows.len() as u64).sum::<u64>());
    assert_eq!(there.len(), back.len());
    assert_eq!(contents(&server).await, before);
    assert_eq!(contents(&last).await, before);
    // A coordinator takes the jobs up that were copied.
    let store = server.open(true, &Presence::hidden()).await.unwrap();
    assert_eq!(store.cluster().unwrap().adopt().await.unwrap().len(), 3);
    let refused = migrate(&server, &last).await.unwrap_err();
    assert!(matches!(refused, MigrateError::InUse { .. }), "{refused}");
    assert!(matches!(migrate(&first, &last).await, Err(MigrateError::NotEmpty { .. })));
}

#[tokio::test]
async fn stores_that_are_not_there_or_in_use_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["from.db", "to.db"].map(|name| StoreUri::Sqlite(folder.path().join(name)));
    assert!(matches!(migrate(&from, &to).await, Err(MigrateError::Absent { .. })));
    assert!(!folder.path().join("to.db").exists());
    fill(&from).await;
    let lock = File::create(folder.path().join("lock")).unwrap();
    lock.try_lock().unwrap();
    assert!(matches!(migrate(&from, &to).await, Err(MigrateError::InUse { .. })));
    drop(lock);
    assert!(migrate(&from, &to).await.is_ok());
}
