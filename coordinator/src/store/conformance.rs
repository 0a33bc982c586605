//! One suite for every store: what holds for one holds for all.

use std::sync::Arc;

use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;

use super::*;
use crate::job::{Attempt, Ending, Frame, FrameState, JobRecord, JobState, Needs, Seconds, StoredUnit, Timestamp, Witness, WorkerId};

use crate::job::tests::windows::{record_with_windows, solved};
use crate::job::tests::{History, record, record_with_checks, result, steps};
use gradfarm_core::accuracy::{Estimate, Point, Reason};
use gradfarm_core::film::Statistics;
use gradfarm_proto::Digest;

/// A store to be tested, and what must outlive it.
struct Subject {
    store: Arc<dyn Store>,
    _folder: Option<tempfile::TempDir>,
}

async fn memory() -> Subject {
    Subject { store: Arc::new(Memory::new()), _folder: None }
}

async fn sqlite() -> Subject {
    let folder = tempfile::tempdir().unwrap();
    let store = Sqlite::open(&folder.path().join("farm.db"), true).await.unwrap();
    Subject { store: Arc::new(store), _folder: Some(folder) }
}

/// On the server that the tests of this process share; nothing where there is none.
async fn postgres() -> Option<Subject> {
    let uri: StoreUri =
        tokio::task::spawn_blocking(|| crate::postgres::shared().map(crate::postgres::Server::database)).await.unwrap()?.parse().unwrap();
    Some(Subject { store: uri.open(true, &Presence::hidden()).await.unwrap(), _folder: None })
}

/// Runs each case against each store.
macro_rules! suite {
    ($($case:ident),* $(,)?) => {
        mod in_memory {
            $(#[tokio::test] async fn $case() { super::$case(super::memory().await.store.as_ref()).await; })*
        }
        mod in_postgres {
            $(#[tokio::test] async fn $case() {
                if let Some(subject) = super::postgres().await {
                    super::$case(subject.store.as_ref()).await;
                }
            })*
        }
        mod in_sqlite {
            $(#[tokio::test] async fn $case() { let subject = super::sqlite().await; super::$case(subject.store.as_ref()).await; })*
        }
    };
}

suite!(
    records_are_replaced_by_whoever_knows_them,
    jobs_come_back_as_they_were,
    a_token_stands_for_one_job,
    epochs_count_up_by_one,
    a_result_is_written_once_under_its_epoch,
    a_batch_is_kept_whole_or_not_at_all,
    frames_and_files_are_replaced,
    nothing_is_kept_of_unknown_jobs,
    points_come_back_with_their_frame,
    done_jobs_come_without_units,
    windows_are_written_once_and_come_back,
    a_pause_is_kept,
    what_is_forgotten_leaves_nothing,
    what_is_given_up_and_compared_comes_back,
    any_history_reads_the_same,
);

fn submitted(record: &JobRecord) -> Change {
    Change::Submitted(Box::new(record.clone()))
}

fn leased(job: JobId, unit: u32, epoch: u32, worker: WorkerId) -> Change {
    Change::Leased { job, unit, epoch, worker, at: Timestamp::from_millis(7) }
}

fn delivered(job: JobId, unit: u32, epoch: u32) -> Change {
    Change::Delivered { job, unit, epoch, worker: WorkerId::from_bytes([7; 16]), result: result(unit, false) }
}

async fn refused(store: &dyn Store, change: Change) {
    let before = store.jobs().await.unwrap();
    let outcome = store.commit(std::slice::from_ref(&change)).await;
    assert!(matches!(outcome, Err(StoreError::Conflict { .. })), "{change:?} gave {outcome:?}");
    assert_eq!(store.jobs().await.unwrap(), before);
}

async fn jobs_come_back_as_they_were(store: &dyn Store) {
    let mut records = [record("first"), record("second, with “quotes”; DROP TABLE jobs")];
    records[1].priority = -5;
    records[1].plan.seed = u64::MAX;
    records[1].client_token = Some("token".into());
    for record in &records {
        store.commit(&[submitted(record)]).await.unwrap();
        refused(store, submitted(record)).await;
    }
    let change = Change::Job {
        job: records[0].id,
        state: JobState::Failed,
        error: Some("no light".into()),
        started: Some(Timestamp::from_millis(10)),
        finished: Some(Timestamp::from_millis(20)),
    };
    store.commit(&[change]).await.unwrap();
    let jobs = store.jobs().await.unwrap();
    assert_eq!(jobs.iter().map(|job| job.record.clone()).collect::<Vec<_>>(), records);
    assert_eq!((jobs[0].state, jobs[0].error.as_deref()), (JobState::Failed, Some("no light")));
    assert_eq!((jobs[0].started, jobs[0].finished), (Some(Timestamp::from_millis(10)), Some(Timestamp::from_millis(20))));
    assert_eq!((jobs[1].state, jobs[1].started), (JobState::Queued, None));
}

async fn a_token_stands_for_one_job(store: &dyn Store) {
    let [mut a, mut b] = [record("a"), record("b")];
    a.client_token = Some("token".into());
    b.client_token = Some("token".into());
    store.commit(&[submitted(&a)]).await.unwrap();
    refused(store, submitted(&b)).await;
    b.client_token = None;
    store.commit(&[submitted(&b), submitted(&record("c"))]).await.unwrap();
}

async fn epochs_count_up_by_one(store: &dyn Store) {
    let record = record("epochs");
    let (job, worker) = (record.id, WorkerId::fresh());
    store.commit(&[submitted(&record)]).await.unwrap();
    refused(store, leased(job, 0, 2, worker)).await;
    store.commit(&[leased(job, 0, 1, worker)]).await.unwrap();
    refused(store, leased(job, 0, 1, worker)).await;
    refused(store, leased(job, 0, 3, worker)).await;
    store.commit(&[Change::Freed { job, unit: 0, failures: 2, losses: 1, given_up: false }]).await.unwrap();
    let freed = StoredUnit { unit: 0, epoch: 1, failures: 2, losses: 1, given_up: false, lease: None, result: None, worker: None };
    assert_eq!(store.jobs().await.unwrap()[0].units, [freed]);
    let other = WorkerId::fresh();
    store.commit(&[leased(job, 0, 2, other), leased(job, 9, 1, worker)]).await.unwrap();
    let units = store.jobs().await.unwrap().remove(0).units;
    assert_eq!(units[0], StoredUnit { epoch: 2, lease: Some(other), ..freed });
    assert_eq!((units[1].unit, units[1].epoch, units[1].lease), (9, 1, Some(worker)));
    refused(store, Change::Freed { job, unit: 5, failures: 0, losses: 0, given_up: false }).await;
}

async fn a_result_is_written_once_under_its_epoch(store: &dyn Store) {
    let record = record("results");
    let (job, worker) = (record.id, WorkerId::fresh());
    store.commit(&[submitted(&record), leased(job, 3, 1, worker)]).await.unwrap();
    refused(store, delivered(job, 3, 2)).await;
    refused(store, delivered(job, 4, 1)).await;
    store.commit(&[leased(job, 3, 2, worker)]).await.unwrap();
    refused(store, delivered(job, 3, 1)).await;
    store.commit(&[delivered(job, 3, 2)]).await.unwrap();
    refused(store, delivered(job, 3, 2)).await;
    refused(store, leased(job, 3, 3, worker)).await;
    let unit = store.jobs().await.unwrap()[0].units[0];
    assert_eq!((unit.lease, unit.result), (None, Some(result(3, false))));
    store.commit(&[leased(job, 1, 1, worker), delivered(job, 1, 1), leased(job, 2, 1, worker)]).await.unwrap();
    assert_eq!(store.results(job, 0..4).await.unwrap(), [(1, result(1, false)), (3, result(3, false))]);
    assert_eq!(store.results(job, 2..3).await.unwrap(), []);
    assert_eq!(store.results(job, 3..3).await.unwrap(), []);
    assert_eq!(store.results(JobId::fresh(), 0..4).await.unwrap(), []);
}

async fn a_batch_is_kept_whole_or_not_at_all(store: &dyn Store) {
    let record = record("whole");
    let (job, worker) = (record.id, WorkerId::fresh());
    store.commit(&[submitted(&record)]).await.unwrap();
    let batch = [leased(job, 0, 1, worker), delivered(job, 0, 1), leased(job, 0, 2, worker)];
    assert!(matches!(store.commit(&batch).await, Err(StoreError::Conflict { .. })));
    assert_eq!(store.jobs().await.unwrap()[0].units, []);
    store.commit(&batch[..2]).await.unwrap();
    store.commit(&[]).await.unwrap();
}

fn frame(state: FrameState) -> Frame {
    Frame {
        state,
        started: Some(Timestamp::from_millis(12)),
        units: 8,
        samples: 1 << 40,
        seconds: Seconds { load: 0.1, compile: 0.2, render: 0.3, render_span: 0.4, stitch: 0.5, reconstruct: 0.6, write: 0.7 },
        estimated_relmse: None,
        choice: None,
        statistics: Statistics::from_counts(&[1, 2, u64::MAX]),
        goal: 20,
        stopped: None,
        failed_units: 0,
        suspect_units: 0,
        failure: None,
        points: Vec::new(),
    }
}

async fn frames_and_files_are_replaced(store: &dyn Store) {
    let record = record("frames");
    let job = record.id;
    let file = |text: &str| FileRecord { kind: FileKind::Png, blob: Digest::of(text.as_bytes()), size: 1 << 33 };
    store.commit(&[submitted(&record), Change::Frame { job, position: 1, frame: Box::new(frame(FrameState::Rendering)) }]).await.unwrap();
    let done = Frame { estimated_relmse: Some(1e-3), choice: Some("l2: least".into()), ..frame(FrameState::Done) };
    let changes = [
        Change::Frame { job, position: 1, frame: Box::new(done.clone()) },
        Change::Frame { job, position: 0, frame: Box::new(frame(FrameState::Assembling)) },
        Change::File { job, position: 1, file: file("old") },
        Change::File { job, position: 1, file: file("new") },
        Change::Worker { worker: WorkerId::fresh(), name: "w".into(), version: "1".into(), threads: 2, at: Timestamp::from_millis(1) },
    ];
    store.commit(&changes).await.unwrap();
    store.commit(&changes[4..]).await.unwrap();
    assert_eq!(store.jobs().await.unwrap()[0].frames, [(0, frame(FrameState::Assembling)), (1, done)]);
    assert_eq!(store.file(job, 1, FileKind::Png).await.unwrap(), Some(file("new")));
    assert_eq!(store.file(job, 1, FileKind::Exr).await.unwrap(), None);
    assert_eq!(store.file(job, 0, FileKind::Png).await.unwrap(), None);
    // Every kind of file can be kept.
    for kind in FileKind::ALL {
        let file = FileRecord { kind, ..file("any") };
        store.commit(&[Change::File { job, position: 0, file }]).await.unwrap();
        assert_eq!(store.file(job, 0, kind).await.unwrap(), Some(file));
    }
}

async fn points_come_back_with_their_frame(store: &dyn Store) {
    let record = record("points");
    let job = record.id;
    let point = |samples: u32| Point {
        samples,
        cpu_seconds: f64::from(samples) / 3.0,
        wall_seconds: 1e9,
        check_seconds: 0.0,
        error: Estimate { relmse: 1e-3, low: 0.0, high: f64::MAX },
    };
    let keep = |position, frame: &Frame| Change::Frame { job, position, frame: Box::new(frame.clone()) };
    let first = Frame { goal: 64, points: vec![point(32)], ..frame(FrameState::Rendering) };
    store.commit(&[submitted(&record), keep(1, &first), keep(0, &frame(FrameState::Waiting))]).await.unwrap();
    assert_eq!(store.jobs().await.unwrap()[0].frames, [(0, frame(FrameState::Waiting)), (1, first.clone())]);
    for stopped in Reason::ALL {
        let last = Frame { goal: 96, stopped: Some(stopped), points: vec![point(32), point(64), point(96)], ..first.clone() };
        store.commit(&[keep(1, &last)]).await.unwrap();
        assert_eq!(store.jobs().await.unwrap()[0].frames[1], (1, last));
    }
}

async fn nothing_is_kept_of_unknown_jobs(store: &dyn Store) {
    let job = JobId::fresh();
    refused(store, Change::Job { job, state: JobState::Running, error: None, started: None, finished: None }).await;
    refused(store, Change::Frame { job, position: 0, frame: Box::new(frame(FrameState::Done)) }).await;
    let file = FileRecord { kind: FileKind::Exr, blob: Digest::of(b""), size: 0 };
    refused(store, Change::File { job, position: 0, file }).await;
    refused(store, delivered(job, 0, 1)).await;
    assert!(store.commit(&[leased(job, 0, 1, WorkerId::fresh())]).await.is_err());
}

async fn windows_are_written_once_and_come_back(store: &dyn Store) {
    let record = record_with_windows();
    let job = record.id;
    let window = |window: u32, moments: u32| Change::Window { job, window, solved: Box::new(solved(moments)) };
    refused(store, window(0, 3)).await;
    store.commit(&[submitted(&record), window(1, 3)]).await.unwrap();
    refused(store, window(1, 3)).await;
    store.commit(&[window(0, 2)]).await.unwrap();
    let stored = store.jobs().await.unwrap().remove(0);
    assert_eq!(stored.record, record, "moments come back");
    assert_eq!(stored.windows, [(0, solved(2)), (1, solved(3))]);
}

async fn what_is_given_up_and_compared_comes_back(store: &dyn Store) {
    let mut record = record("schedule");
    record.needs = Needs { project: "film".into(), tags: ["gpu".into()].into(), most_workers: Some(3), verify: 0.25, ..Needs::default() };
    let (job, worker, at) = (record.id, WorkerId::fresh(), Timestamp::from_millis(9));
    store.commit(&[submitted(&record), leased(job, 0, 1, worker), leased(job, 1, 1, worker)]).await.unwrap();
    store.commit(&[Change::Priority { job, priority: -3 }]).await.unwrap();
    record.priority = -3;
    for (number, ending) in (0..).zip(Ending::ALL) {
        let attempt = Attempt { worker, epoch: 1, at, ending, reason: "no memory".into() };
        store.commit(&[Change::Attempt { job, unit: 0, number, attempt: attempt.clone() }]).await.unwrap();
        refused(store, Change::Attempt { job, unit: 0, number, attempt }).await;
    }
    let witness = Witness { epoch: 1, worker, content: Digest::of(b"it") };
    store.commit(&[Change::Witness { job, unit: 1, witness }]).await.unwrap();
    refused(store, Change::Witness { job, unit: 1, witness }).await;
    refused(store, Change::Witness { job, unit: 1, witness: Witness { epoch: 2, ..witness } }).await;
    store.commit(&[Change::Freed { job, unit: 0, failures: 5, losses: 0, given_up: true }]).await.unwrap();
    let failed = Frame { failed_units: 1, suspect_units: 2, failure: Some("no light".into()), ..frame(FrameState::Failed) };
    store.commit(&[Change::Frame { job, position: 0, frame: Box::new(failed.clone()) }]).await.unwrap();
    let stored = store.jobs().await.unwrap().remove(0);
    assert_eq!(stored.record, record);
    assert_eq!(stored.frames, [(0, failed)]);
    assert_eq!(stored.attempts.iter().map(|(unit, attempt)| (*unit, attempt.ending)).collect::<Vec<_>>(), Ending::ALL.map(|e| (0, e)));
    assert_eq!(stored.witnesses, [(1, witness)]);
    assert_eq!((stored.units[0].given_up, stored.units[1].lease), (true, None));
    // Done without that unit: its evidence stays, and it can be tried again.
    store.commit(&[Change::Job { job, state: JobState::Done, error: None, started: None, finished: None }]).await.unwrap();
    assert_eq!(store.jobs().await.unwrap()[0].units.len(), 2);
    // A result is taken back under a new epoch.
    store.commit(&[leased(job, 2, 1, worker), delivered(job, 2, 1), Change::Withdrawn { job, unit: 2, epoch: 2 }]).await.unwrap();
    assert_eq!(store.results(job, 2..3).await.unwrap(), []);
    refused(store, delivered(job, 2, 1)).await;
    store.commit(&[leased(job, 2, 3, worker), delivered(job, 2, 3)]).await.unwrap();
    let unit = store.jobs().await.unwrap()[0].units[2];
    assert_eq!((unit.epoch, unit.worker, unit.result), (3, Some(WorkerId::from_bytes([7; 16])), Some(result(2, false))));
    store.commit(&[Change::Freed { job, unit: 1, failures: 0, losses: 0, given_up: true }]).await.unwrap();
    assert_eq!(store.jobs().await.unwrap()[0].witnesses, []);
}

async fn a_pause_is_kept(store: &dyn Store) {
    let record = record("paused");
    let job = record.id;
    refused(store, Change::Paused { job, paused: true }).await;
    store.commit(&[submitted(&record)]).await.unwrap();
    for paused in [true, true, false] {
        store.commit(&[Change::Paused { job, paused }]).await.unwrap();
        assert_eq!(store.jobs().await.unwrap()[0].paused, paused);
    }
}

async fn what_is_forgotten_leaves_nothing(store: &dyn Store) {
    let mut record = record_with_windows();
    record.client_token = Some("token".into());
    let (job, worker) = (record.id, WorkerId::fresh());
    let point =
        Point { samples: 8, cpu_seconds: 1.0, wall_seconds: 1.0, check_seconds: 0.0, error: Estimate { relmse: 1.0, low: 0.0, high: 2.0 } };
    let file = FileRecord { kind: FileKind::Png, blob: Digest::of(b"png"), size: 3 };
    let other = record_with_windows();
    let of_other = FileRecord { blob: Digest::of(b"other"), ..file };
    store.commit(&[submitted(&other), Change::File { job: other.id, position: 0, file: of_other }]).await.unwrap();
    let rows = [
        submitted(&record),
        Change::Frame { job, position: 0, frame: Box::new(Frame { points: vec![point], ..frame(FrameState::Rendering) }) },
        leased(job, 0, 1, worker),
        delivered(job, 0, 1),
        leased(job, 1, 1, worker),
        Change::File { job, position: 0, file },
        Change::Window { job, window: 0, solved: Box::new(solved(3)) },
    ];
    store.commit(&rows).await.unwrap();
    refused(store, Change::Forgotten { job }).await;
    assert_eq!(store.files().await.unwrap().len(), 2);
    let over = Change::Job { job, state: JobState::Cancelled, error: None, started: None, finished: Some(Timestamp::from_millis(9)) };
    store.commit(&[over, Change::Forgotten { job }]).await.unwrap();
    refused(store, Change::Forgotten { job }).await;
    assert_eq!(store.jobs().await.unwrap().into_iter().map(|job| job.record).collect::<Vec<_>>(), [other]);
    assert_eq!(store.files().await.unwrap(), [of_other.blob]);
    assert_eq!((store.results(job, 0..9).await.unwrap(), store.file(job, 0, FileKind::Png).await.unwrap()), (vec![], None));
    store.commit(&[submitted(&record)]).await.unwrap();
}

async fn done_jobs_come_without_units(store: &dyn Store) {
    let record = record("done");
    let (job, worker) = (record.id, WorkerId::fresh());
    store.commit(&[submitted(&record), leased(job, 0, 1, worker), delivered(job, 0, 1)]).await.unwrap();
    assert_eq!(store.jobs().await.unwrap()[0].units.len(), 1);
    store.commit(&[Change::Job { job, state: JobState::Done, error: None, started: None, finished: None }]).await.unwrap();
    assert_eq!(store.jobs().await.unwrap()[0].units, []);
    assert_eq!(store.results(job, 0..9).await.unwrap().len(), 1);
}

/// What the machine does in random histories reads the same from this store as from the twin in memory.
async fn any_history_reads_the_same(store: &dyn Store) {
    let mut runner = TestRunner::deterministic();
    for kind in (0..3).cycle().take(21) {
        let steps = steps().new_tree(&mut runner).unwrap().current();
        // The history waits for its own store, which must not be done on this thread's runtime.
        let (changes, expected) = tokio::task::spawn_blocking(move || {
            let records = [record("history"), record_with_checks(), record_with_windows()];
            let mut history = History::of(records[kind].clone());
            steps.iter().for_each(|step| history.step(step));
            (history.changes.clone(), history.stored())
        })
        .await
        .unwrap();
        for batch in &changes {
            store.commit(batch).await.unwrap();
        }
        let found = store.jobs().await.unwrap().into_iter().find(|job| job.record.id == expected.record.id);
        assert_eq!(found, Some(expected));
    }
}

#[tokio::test]
async fn sqlite_keeps_everything_over_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("farm.db");
    let record = record("restart");
    let (job, worker) = (record.id, WorkerId::fresh());
    let before = {
        let store = Sqlite::open(&file, true).await.unwrap();
        store.commit(&[submitted(&record), leased(job, 0, 1, worker), delivered(job, 0, 1), leased(job, 1, 1, worker)]).await.unwrap();
        store.jobs().await.unwrap()
    };
    let store = Sqlite::open(&file, true).await.unwrap();
    assert_eq!(store.jobs().await.unwrap(), before);
    refused(&store, delivered(job, 0, 1)).await;
}

#[tokio::test]
async fn a_damaged_database_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("farm.db");
    std::fs::write(&file, b"this is no database, and it is long enough to be read as one page of it ...").unwrap();
    assert!(Sqlite::open(&file, true).await.is_err());
}

async fn records_are_replaced_by_whoever_knows_them(store: &dyn Store) {
    let replace = |key: &'static str, old: Option<&'static [u8]>, new: Option<&'static [u8]>| store.replace_record("kind", key, old, new);
    assert!(replace("b", None, Some(b"1")).await.unwrap());
    assert!(!replace("b", None, Some(b"2")).await.unwrap(), "something is there");
    assert!(!replace("b", Some(b"2"), Some(b"3")).await.unwrap(), "something else is there");
    assert!(!replace("a", Some(b"1"), Some(b"2")).await.unwrap(), "nothing is there");
    assert!(replace("b", Some(b"1"), Some(b"2\0\xff")).await.unwrap());
    assert_eq!(store.record("kind", "b").await.unwrap().as_deref(), Some(&b"2\0\xff"[..]));
    assert_eq!(store.record("other", "b").await.unwrap(), None);
    for key in ["a", "c", "B"] {
        assert!(replace(key, None, Some(b"")).await.unwrap());
    }
    assert!(store.replace_record("other", "z", None, Some(b"x")).await.unwrap());
    let keys = |rows: Vec<(String, Vec<u8>)>| rows.into_iter().map(|(key, _)| key).collect::<Vec<_>>();
    assert_eq!(keys(store.records("kind", None, 10).await.unwrap()), ["c", "b", "a", "B"]);
    assert_eq!(keys(store.records("kind", Some("c"), 2).await.unwrap()), ["b", "a"]);
    assert!(replace("c", Some(b""), None).await.unwrap() && replace("c", None, None).await.unwrap());
    assert_eq!(keys(store.records("kind", None, 1).await.unwrap()), ["b"]);
    // Of many who take the same thing, one gets it.
    assert!(replace("once", None, Some(b"whole")).await.unwrap());
    let takers = (0..8).map(|_| replace("once", Some(b"whole"), Some(b"taken")));
    let taken = futures::future::join_all(takers).await.into_iter().filter(|taken| *taken.as_ref().unwrap());
    assert_eq!(taken.count(), 1);
}
