//! A coordinator and workers in one process over real gRPC: a scene goes in, a frame comes out, and its bits do not depend on who
//! rendered what.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::path::Path;
use std::time::Duration;

use futures::StreamExt;
use gradfarm::job::{FrameState, JobState};
use gradfarm::service::{self, Config, Frames, Handle, JobEvent, Service, Submission};
use gradfarm_core::lattice::Extent;
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
    service: JoinHandle<Result<(), gradfarm::error::Error>>,
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
        let config = gradfarm_worker::Config::new(&self.url, format!("worker-{}", self.workers.len()), threads);
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
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_rendered_and_its_story_can_be_followed() {
    let folder = tempfile::tempdir().unwrap();
    let mut farm = Farm::open(folder.path()).await;
    farm.hire(2);
    let mut wanted = submission(37);
    wanted.frames = Frames { first: 4, count: 2 };
    let job = farm.handle.submit(wanted).await.unwrap();
    let events: Vec<JobEvent> = tokio::time::timeout(PATIENCE, farm.handle.subscribe(job).await.unwrap().collect()).await.unwrap();
    assert!(matches!(events[0], JobEvent::State { .. }), "{:?}", events[0]);
    assert!(matches!(events.last(), Some(JobEvent::State { state: JobState::Done, error: None })), "{:?}", events.last());
    for number in [4, 5] {
        assert!(events.contains(&JobEvent::Frame { frame: number, state: FrameState::Done }));
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
    let workers = farm.handle.workers().await.unwrap();
    assert_eq!((workers.len(), workers[0].threads, workers[0].delivered, workers[0].failed), (1, 2, 36, 0));
    farm.close().await;
}
