//! A coordinator and workers in one process over real gRPC: a scene goes in, a frame comes out, and its bits do not depend on who
//! rendered what.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::path::Path;
use std::time::Duration;

use futures::StreamExt;
use gradfarm::error::Error;
use gradfarm::job::{FileKind, FrameState, JobId, JobState};
use gradfarm::service::{self, Config, Frames, Handle, JobEvent, JobView, Service, Submission};
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::exr;
use gradfarm_core::plan::{Request, Technique};
use tokio::sync::watch;
use tokio::task::JoinHandle;

mod common;
const PATIENCE: Duration = Duration::from_secs(120);

/// A running coordinator with workers, all in this process.
struct Farm {
    handle: Handle,
    url: String,
    stop: watch::Sender<bool>,
    service: JoinHandle<Result<(), Error>>,
    workers: Vec<Hired>,
}

/// A worker of a farm.
struct Hired {
    stop: watch::Sender<bool>,
    task: JoinHandle<Result<(), gradfarm_worker::Error>>,
}

async fn told(mut stop: watch::Receiver<bool>) {
    let _ = stop.wait_for(|stop| *stop).await;
}

impl Farm {
    async fn open(state: &Path) -> Self {
        let listener = service::listen((Ipv4Addr::LOCALHOST, 0).into()).await.unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let mut config = Config::new(state);
        (config.heartbeat, config.lease_ttl) = (Duration::from_millis(200), Duration::from_secs(2));
        let service = Service::open(config).await.unwrap();
        let handle = service.handle();
        let (stop, stopping) = watch::channel(false);
        let service = tokio::spawn(service.run(listener, told(stopping)));
        Self { handle, url, stop, service, workers: Vec::new() }
    }

    fn hire(&mut self, threads: usize) {
        let (stop, stopping) = watch::channel(false);
        let mut config = gradfarm_worker::Config::new(&self.url, format!("worker-{}", self.workers.len()), threads);
        config.credential = gradfarm_worker::Credential::Token(self.handle.gate().in_process_worker().expose().to_owned());
        self.workers.push(Hired { stop, task: tokio::spawn(gradfarm_worker::run(config, told(stopping))) });
    }

    async fn close(self) {
        for Hired { stop, task } in self.workers {
            stop.send_replace(true);
            task.await.unwrap().unwrap();
        }
        self.stop.send_replace(true);
        self.service.await.unwrap().unwrap();
    }
}

fn submission(tile: u32) -> Submission {
    Submission {
        name: "room".into(),
        description: common::SCENE.into(),
        assets: BTreeMap::new(),
        request: Request {
            technique: Some(Technique::Gpt),
            samples: Some(40),
            extent: Some(Extent { width: 100, height: 70 }),
            seed: 3,
            ..Request::default()
        },
        tile,
        frames: Frames::default(),
        priority: 0,
        client_token: None,
        needs: Default::default(),
        verify: None,
        paused: false,
    }
}

async fn finished(handle: &Handle, job: JobId) -> JobView {
    let mut events = handle.subscribe(job).await.unwrap();
    let follow = async { while events.next().await.is_some() {} };
    tokio::time::timeout(PATIENCE, follow).await.expect("the job ends in time");
    handle.get(job).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_rendered_and_its_story_can_be_followed() {
    let folder = tempfile::tempdir().unwrap();
    let mut farm = Farm::open(folder.path()).await;
    farm.hire(2);
    let mut wanted = Submission { description: common::moving_scene(), ..submission(37) };
    wanted.frames = Frames { first: 4, count: 2 };
    wanted.request.temporal = Some(false);
    let job = farm.handle.submit(wanted).await.unwrap();
    let events: Vec<JobEvent> = tokio::time::timeout(PATIENCE, farm.handle.subscribe(job).await.unwrap().collect()).await.unwrap();
    assert!(matches!(events[0], JobEvent::State { .. }), "{:?}", events[0]);
    assert!(matches!(events.last(), Some(JobEvent::State { state: JobState::Done, error: None })), "{:?}", events.last());
    for number in [4, 5] {
        assert!(events.contains(&JobEvent::Frame { frame: number, end: number + 1, state: FrameState::Done }));
    }
    let view = farm.handle.get(job).await.unwrap();
    assert_eq!((view.summary.units.done, view.summary.units.total), (2 * 6 * 3, 2 * 6 * 3));
    assert_eq!(view.summary.samples.done, 2 * 100 * 70 * 40);
    assert_eq!(view.summary.samples.done, view.statistics.get(gradfarm_core::film::Counter::Samples));
    assert!(view.seconds.render > 0.0 && view.seconds.render_span > 0.0 && view.seconds.compile > 0.0 && view.seconds.stitch > 0.0);
    assert!(view.frames.iter().all(|frame| frame.estimated_relmse.is_some_and(|e| e > 0.0 && e < 1.0)), "{:?}", view.frames);
    let tiles = farm.handle.tiles(job, 5).await.unwrap();
    assert!(tiles.len() == 6 && tiles.iter().all(|tile| tile.units.done == 3));
    assert!(farm.handle.tiles(job, 6).await.is_err());
    let exr = farm.handle.frame_file(job, 4, FileKind::Exr).await.unwrap();
    let png = farm.handle.frame_file(job, 4, FileKind::Png).await.unwrap();
    assert_eq!((&exr[..4], &png[1..4]), (&[0x76, 0x2f, 0x31, 0x01][..], &b"PNG"[..]));
    let workers = farm.handle.workers().await.unwrap();
    assert_eq!((workers.len(), workers[0].threads, workers[0].delivered, workers[0].failed), (1, 2, 36, 0));
    farm.close().await;
}

/// The pixels of every layer that a test of bits looks at.
async fn bits(handle: &Handle, job: JobId) -> Vec<u32> {
    let exr = handle.frame_file(job, 0, FileKind::Exr).await.unwrap();
    let layer = |name| exr::read_layer(&exr, name).unwrap();
    let layers = ["", "primal", "dx", "dy", "variance", "error", "albedo"].map(layer);
    layers.iter().flat_map(|image| image.data().iter().map(|value| value.to_bits())).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_bits_depend_on_neither_workers_nor_threads_nor_tiles() {
    let mut first = None;
    for (workers, threads, tile) in [(1, 1, 64), (2, 1, 16), (3, 1, 37), (1, 2, 16), (2, 2, 64)] {
        let folder = tempfile::tempdir().unwrap();
        let mut farm = Farm::open(folder.path()).await;
        (0..workers).for_each(|_| farm.hire(threads));
        let job = farm.handle.submit(submission(tile)).await.unwrap();
        assert_eq!(finished(&farm.handle, job).await.summary.state, JobState::Done);
        let found = bits(&farm.handle, job).await;
        assert!(found.iter().any(|bits| *bits != 0));
        assert!(first.get_or_insert_with(|| found.clone()) == &found, "{workers} workers, {threads} threads, tiles of {tile}");
        farm.close().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_comes_late_or_goes_early_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut farm = Farm::open(folder.path()).await;
    farm.hire(1);
    let undisturbed = farm.handle.submit(submission(16)).await.unwrap();
    finished(&farm.handle, undisturbed).await;
    let disturbed = farm.handle.submit(submission(16)).await.unwrap();
    let mut events = farm.handle.subscribe(disturbed).await.unwrap();
    let mut tiles = 0;
    while let Some(event) = events.next().await {
        if let JobEvent::Tile { .. } = event {
            tiles += 1;
            if tiles % 10 == 1 && farm.workers.len() < 4 {
                farm.hire(1);
                // Dropped in the middle of its work, connection and all.
                farm.workers.remove(0).task.abort();
            }
        }
    }
    assert!(tiles >= 35 * 3, "{tiles} tiles");
    assert_eq!(farm.handle.get(disturbed).await.unwrap().summary.state, JobState::Done);
    assert!(bits(&farm.handle, undisturbed).await == bits(&farm.handle, disturbed).await);
    farm.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_waits_over_a_restart_and_a_token_stands_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::open(folder.path()).await;
    let mut wanted = submission(64);
    wanted.client_token = Some("once".into());
    let job = farm.handle.submit(wanted.clone()).await.unwrap();
    assert!(matches!(Service::open(Config::new(folder.path())).await, Err(Error::InUse(_))), "one service at a time");
    farm.close().await;
    let mut farm = Farm::open(folder.path()).await;
    assert_eq!(farm.handle.submit(wanted.clone()).await.unwrap(), job);
    wanted.tile = 16;
    assert!(matches!(farm.handle.submit(wanted).await, Err(Error::TokenReused { job: known, .. }) if known == job));
    farm.hire(2);
    assert_eq!(finished(&farm.handle, job).await.summary.state, JobState::Done);
    assert!(matches!(farm.handle.cancel(job).await, Err(Error::Over { .. })));
    farm.close().await;
    let farm = Farm::open(folder.path()).await;
    let view = farm.handle.get(job).await.unwrap();
    assert_eq!((view.summary.state, view.summary.units.done), (JobState::Done, 12));
    assert!(farm.handle.tiles(job, 0).await.unwrap().iter().all(|tile| tile.units.done == tile.units.total));
    assert!(!bits(&farm.handle, job).await.is_empty());
    farm.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cancelling_frees_the_workers_and_is_final() {
    let folder = tempfile::tempdir().unwrap();
    let mut farm = Farm::open(folder.path()).await;
    let mut long = submission(16);
    long.request.samples = Some(100_000);
    let long = farm.handle.submit(long).await.unwrap();
    farm.hire(1);
    let mut events = farm.handle.subscribe(long).await.unwrap();
    while !matches!(events.next().await.unwrap(), JobEvent::Tile { .. }) {}
    farm.handle.cancel(long).await.unwrap();
    farm.handle.cancel(long).await.unwrap();
    let short = farm.handle.submit(submission(64)).await.unwrap();
    assert_eq!(finished(&farm.handle, short).await.summary.state, JobState::Done);
    let view = farm.handle.get(long).await.unwrap();
    assert_eq!(view.summary.state, JobState::Cancelled);
    assert!(view.summary.units.done < view.summary.units.total);
    assert!(matches!(farm.handle.frame_file(long, 0, FileKind::Exr).await, Err(Error::NotReady { .. })));
    farm.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn submissions_are_checked_before_they_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::open(folder.path()).await;
    let (description, mesh) = common::scene_with_mesh();
    let unlisted = Submission { description, ..submission(64) };
    match farm.handle.submit(unlisted.clone()).await {
        Err(Error::Unlisted { names }) => assert_eq!(names, ["models/wedge.obj"]),
        other => panic!("{other:?}"),
    }
    let digest = gradfarm_proto::Digest::of(mesh.as_bytes());
    let listed = Submission { assets: [("models/wedge.obj".to_owned(), digest)].into(), ..unlisted };
    match farm.handle.submit(listed.clone()).await {
        Err(Error::MissingAssets { digests }) => assert_eq!(digests, [digest]),
        other => panic!("{other:?}"),
    }
    assert_eq!(farm.handle.missing_assets(&[digest]).await.unwrap(), [digest]);
    assert_eq!(farm.handle.put_asset(mesh.into()).await.unwrap(), digest);
    assert_eq!(farm.handle.missing_assets(&[digest]).await.unwrap(), []);
    farm.handle.submit(listed).await.unwrap();
    let wrong = [
        Submission { tile: 0, ..submission(64) },
        Submission { frames: Frames { first: 0, count: 0 }, ..submission(64) },
        Submission { description: "{}".into(), ..submission(64) },
        Submission { client_token: Some(String::new()), ..submission(64) },
    ];
    for wrong in wrong {
        assert!(farm.handle.submit(wrong.clone()).await.is_err(), "{wrong:?}");
    }
    assert_eq!(farm.handle.list().await.unwrap().len(), 1);
    assert!(matches!(service::listen("0.0.0.0:0".parse().unwrap()).await, Err(Error::NotLoopback(_))));
    farm.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_that_no_worker_can_compile_fails_its_job_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let mut farm = Farm::open(folder.path()).await;
    let (description, _) = common::scene_with_mesh();
    let digest = farm.handle.put_asset("f 1 2 99".into()).await.unwrap();
    let broken = Submission { description, assets: [("models/wedge.obj".to_owned(), digest)].into(), ..submission(64) };
    let job = farm.handle.submit(broken).await.unwrap();
    farm.hire(1);
    farm.hire(1);
    let view = finished(&farm.handle, job).await;
    assert_eq!(view.summary.state, JobState::Failed);
    let error = view.summary.error.unwrap();
    assert!(error.contains("failed 5 times") && error.contains("wedge.obj"), "{error}");
    farm.close().await;
}
