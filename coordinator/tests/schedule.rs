//! What the schedule does about trouble and for whom, over the real protocol: units that are given up, lying workers, pools, limits, reasons.
#![allow(clippy::unwrap_used)]

mod common;

use std::time::Duration;

use common::puppet::{Bench, Puppet, hello};
use gradfarm::error::Error;
use gradfarm::job::{Ending, FileKind, JobState, Needs};
use gradfarm::service::{JobView, Rules};
use gradfarm_core::output::exr;
use gradfarm_proto::block;
use gradfarm_proto::v1;
use gradfarm_proto::v1::deliver_reply::Outcome;
use gradfarm_proto::v1::worker_message::Message as Say;

async fn until(bench: &Bench, wanted: impl Fn(&JobView) -> bool) -> JobView {
    for _ in 0..3000 {
        let view = bench.handle.get(bench.job).await.unwrap();
        if wanted(&view) {
            return view;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("it never came to that: {:?}", bench.handle.get(bench.job).await.unwrap().summary);
}

/// Renders and delivers the next so many units.
async fn render(bench: &Bench, worker: &mut Puppet, units: usize) {
    for _ in 0..units {
        let lease = worker.lease().await;
        let result = block::encode(&bench.render(&lease)).unwrap();
        assert_eq!(worker.deliver(&lease, &result).await.0, Outcome::Accepted);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tile_that_nobody_can_render_is_named_and_the_frame_is_there_without_it() {
    let bench = Bench::with(Rules::default(), |_| {}).await;
    let mut worker = Puppet::connect(&bench, 1, Vec::new()).await;
    render(&bench, &mut worker, 1).await;
    let poisoned = worker.lease().await;
    for attempt in 0..5 {
        let lease = if attempt == 0 { poisoned.clone() } else { worker.lease().await };
        assert_eq!(lease.unit, poisoned.unit);
        worker.say(Say::Failed(v1::Failed { lease: Some(lease.name), reason: format!("no memory, {attempt}") })).await;
    }
    render(&bench, &mut worker, 6).await;
    let view = until(&bench, |view| view.summary.state.is_final()).await;
    assert_eq!((view.summary.state, view.summary.failed_units, view.summary.units.done), (JobState::Done, 1, 7));
    let [failed] = &view.frames[0].failed[..] else { panic!("{:?}", view.frames[0].failed) };
    assert_eq!((failed.tile, failed.samples, failed.attempts.len()), (poisoned.unit.tile, poisoned.unit.samples, 5));
    assert!(failed.attempts.iter().all(|a| a.attempt.ending == Ending::Failed && a.name.as_deref() == Some("puppet")));
    // The image tells which pixels lack samples, and so does the file beside it.
    let file = bench.handle.frame_file(bench.job, 0, FileKind::Exr).await.unwrap();
    let samples = exr::read_layer(&file, "samples").unwrap();
    assert_eq!((samples.at(poisoned.unit.tile.x, poisoned.unit.tile.y, 0), samples.at(0, 0, 0)), (16.0, 32.0));
    let image = exr::read_layer(&file, "").unwrap();
    assert!(image.data().iter().all(|value| value.is_finite()));
    let told = bench.handle.frame_file(bench.job, 0, FileKind::Statistics).await.unwrap();
    let told: serde_json::Value = serde_json::from_slice(&told).unwrap();
    assert_eq!((told["failed"][0]["x"].as_u64(), told["failed"][0]["attempts"][4]["reason"].as_str()), (Some(12), Some("no memory, 4")));
    // Tried again, it is the image that it would have been.
    bench.handle.retry(bench.job, Some(0)).await.unwrap();
    render(&bench, &mut worker, 1).await;
    let view = until(&bench, |view| view.summary.state.is_final()).await;
    assert_eq!((view.summary.state, view.summary.failed_units, view.summary.units.done), (JobState::Done, 0, 8));
    let whole = bench.handle.frame_file(bench.job, 0, FileKind::Exr).await.unwrap();
    assert!(exr::read_layer(&whole, "samples").is_err(), "all pixels have the same samples");
    let undisturbed = Bench::with(Rules::default(), |_| {}).await;
    let mut worker = Puppet::connect(&undisturbed, 1, Vec::new()).await;
    render(&undisturbed, &mut worker, 8).await;
    until(&undisturbed, |view| view.summary.state == JobState::Done).await;
    let expected = undisturbed.handle.frame_file(undisturbed.job, 0, FileKind::Exr).await.unwrap();
    for layer in ["", "primal", "dx", "dy", "variance", "albedo"] {
        let [found, expected] = [&whole, &expected].map(|file| exr::read_layer(file, layer).unwrap());
        assert!(found.data().iter().zip(expected.data()).all(|(f, e)| f.to_bits() == e.to_bits()), "layer {layer:?}");
    }
    assert!(matches!(bench.handle.retry(bench.job, None).await, Err(Error::NothingFailed(_))));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_lies_is_outvoted_and_named() {
    let bench = Bench::with(Rules { verify: 1.0, ..Rules::default() }, |_| {}).await;
    let mut liar = Puppet::greet(&bench, v1::Hello { name: "liar".into(), ..hello([9; 16], Vec::new()) }).await;
    let mut honest = [Puppet::connect(&bench, 1, Vec::new()).await, Puppet::connect(&bench, 2, Vec::new()).await];
    let lease = liar.lease().await;
    let good = bench.render(&lease);
    let mut lie = good.clone();
    lie.planes[0].1[3] += 1.0;
    assert_eq!(liar.deliver(&lease, &block::encode(&lie).unwrap()).await.0, Outcome::Accepted, "in good form, it is taken in");
    assert_eq!(bench.done().await, 0, "but does not count by itself");
    for (worker, done) in honest.iter_mut().zip([0, 1]) {
        let again = worker.lease().await;
        assert_eq!(again.unit, lease.unit);
        assert_eq!(worker.deliver(&again, &block::encode(&good).unwrap()).await.0, Outcome::Accepted);
        assert_eq!(bench.done().await, done);
    }
    let workers = bench.handle.workers().await.unwrap();
    let named: Vec<(&str, u32, bool)> = workers.iter().map(|w| (w.name.as_str(), w.lies, w.set_aside_until.is_some())).collect();
    assert_eq!(named, [("puppet", 0, false), ("puppet", 0, false), ("liar", 1, true)]);
    // The other units: two of them agree each time.
    let [first, second] = &mut honest;
    for _ in 0..7 {
        render(&bench, first, 1).await;
        render(&bench, second, 1).await;
    }
    assert_eq!(until(&bench, |view| view.summary.state.is_final()).await.summary.state, JobState::Done);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_goes_only_to_workers_that_have_what_it_needs_and_says_why_it_waits() {
    let needs = Needs { pools: ["night".into()].into(), tags: ["gpu".into()].into(), ..Needs::default() };
    let bench = Bench::with(Rules::default(), |job| (job.needs, job.paused) = (needs, true)).await;
    let waits = async || bench.handle.get(bench.job).await.unwrap().waiting.map(|why| why.name());
    assert_eq!(waits().await, Some("paused"));
    bench.handle.resume(bench.job).await.unwrap();
    assert_eq!(waits().await, Some("no_worker"));
    let plain = Puppet::connect(&bench, 1, Vec::new()).await;
    plain.say(Say::Credit(v1::Credit { leases: 4 })).await;
    let why = until(&bench, |view| view.waiting.as_ref().is_some_and(|why| why.name() == "none_fits")).await.waiting;
    assert_eq!(why.unwrap().to_string(), "no worker that is connected has pool night");
    let told = v1::Hello { pool: "night".into(), tags: vec!["gpu".into(), "big".into()], ..hello([2; 16], Vec::new()) };
    let mut fitting = Puppet::greet(&bench, told).await;
    assert_eq!(waits().await, Some("busy"), "nobody who fits asked for work yet");
    render(&bench, &mut fitting, 1).await;
    let lease = fitting.lease().await;
    assert_eq!(waits().await, None);
    let workers = bench.handle.workers().await.unwrap();
    assert_eq!(workers.iter().map(|worker| worker.leases).collect::<Vec<_>>(), [0, 1], "{workers:?}");
    assert_eq!(bench.handle.dry_run(submission(&bench).await).await.unwrap().fitting, 1);
    drop(lease);
}

/// What the bench submitted, as far as a dry run of it goes.
async fn submission(bench: &Bench) -> gradfarm::service::Submission {
    let view = bench.handle.get(bench.job).await.unwrap();
    gradfarm::service::Submission {
        name: "dry".into(),
        description: common::SCENE.into(),
        assets: Default::default(),
        request: Default::default(),
        tile: 12,
        frames: Default::default(),
        priority: 0,
        client_token: None,
        needs: view.needs,
        verify: None,
        paused: false,
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn quotas_and_limits_hold_and_are_told() {
    let rules = Rules { project_leases: [("film".to_owned(), 1)].into(), limits: [("licence".to_owned(), 1)].into(), ..Rules::default() };
    let needs = Needs { project: "film".into(), limits: ["licence".into()].into(), most_workers: Some(1), ..Needs::default() };
    let bench = Bench::with(rules, |job| job.needs = needs).await;
    let mut first = Puppet::connect(&bench, 1, Vec::new()).await;
    let lease = first.lease().await;
    let mut second = Puppet::connect(&bench, 2, Vec::new()).await;
    second.say(Say::Credit(v1::Credit { leases: 1 })).await;
    let why = until(&bench, |view| view.waiting.is_some()).await.waiting.unwrap();
    assert_eq!((why.name(), why.to_string().as_str()), ("limit", "1 workers are at it, and it asked for no more"));
    let result = block::encode(&bench.render(&lease)).unwrap();
    assert_eq!(first.deliver(&lease, &result).await.0, Outcome::Accepted);
    // Its place is free for whoever asked first.
    let next = second.hear().await;
    assert!(matches!(next, gradfarm_proto::v1::coordinator_message::Message::Grant(_)), "{next:?}");
    let unknown = Needs { limits: ["gpus".into()].into(), ..Needs::default() };
    let wrong = gradfarm::service::Submission { needs: unknown, ..submission(&bench).await };
    let refused = bench.handle.submit(wrong).await.unwrap_err();
    assert_eq!(refused.to_string(), "limit is gpus, expected one of licence");
    bench.handle.prioritise(bench.job, 7).await.unwrap();
    assert_eq!(bench.handle.get(bench.job).await.unwrap().summary.priority, 7);
}
