//! The protocol with a worker that misbehaves: late, silent, lying, of another version.
#![allow(clippy::unwrap_used)]

mod common;

use std::time::Duration;

use common::puppet::{Bench, Puppet, TTL, hello, open};
use gradfarm::job::JobId;
use gradfarm_core::film::FilmBlock;
use gradfarm_proto::block::{self, EncodedBlock};
use gradfarm_proto::v1::coordinator_message::Message as Told;
use gradfarm_proto::v1::deliver_reply::Outcome;
use gradfarm_proto::v1::worker_message::Message as Say;
use gradfarm_proto::{Manifest, v1};
use tonic::Code;

#[tokio::test(flavor = "multi_thread")]
async fn expiry_is_no_judgement_but_a_new_grant_is() {
    let bench = Bench::new().await;
    let mut first = Puppet::connect(&bench, 1, Vec::new()).await;
    let lease = first.lease().await;
    let result = block::encode(&bench.render(&lease)).unwrap();
    tokio::time::sleep(TTL * 2).await;
    assert_eq!(bench.handle.workers().await.unwrap()[0].leases, 0, "it ran out");
    assert_eq!(first.deliver(&lease, &result).await.0, Outcome::Accepted, "late, but nobody else has it");
    assert_eq!(first.deliver(&lease, &result).await.0, Outcome::Accepted, "the answer was lost, and it sends again");
    assert_eq!(bench.done().await, 1, "it counts once");

    let lease = first.lease().await;
    let result = block::encode(&bench.render(&lease)).unwrap();
    tokio::time::sleep(TTL * 2).await;
    let mut second = Puppet::connect(&bench, 2, Vec::new()).await;
    let again = second.lease().await;
    assert_eq!((again.unit, again.name.epoch), (lease.unit, lease.name.epoch + 1));
    assert_eq!(first.deliver(&lease, &result).await.0, Outcome::Superseded);
    assert_eq!(bench.done().await, 1);
    first.say(Say::Heartbeat(v1::Heartbeat { held: vec![lease.name.clone()], ..v1::Heartbeat::default() })).await;
    let told = first.hear().await;
    assert!(matches!(&told, Told::Revoke(revoke) if revoke.leases == [lease.name.clone()]), "{told:?}");
    assert_eq!(second.deliver(&again, &result).await.0, Outcome::Accepted);
    assert_eq!(bench.done().await, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn heartbeats_keep_a_lease_and_coming_back_reclaims_it() {
    let bench = Bench::new().await;
    let mut worker = Puppet::connect(&bench, 1, Vec::new()).await;
    let lease = worker.lease().await;
    for _ in 0..8 {
        tokio::time::sleep(TTL / 4).await;
        worker.say(Say::Heartbeat(v1::Heartbeat { held: vec![lease.name.clone()], ..v1::Heartbeat::default() })).await;
    }
    assert_eq!(bench.handle.workers().await.unwrap()[0].leases, 1, "kept alive for twice its time");
    drop(worker);
    while !bench.handle.workers().await.unwrap().is_empty() {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let mut worker = Puppet::connect(&bench, 1, vec![lease.name.clone()]).await;
    assert_eq!(bench.handle.workers().await.unwrap()[0].leases, 1, "reclaimed");
    let other = worker.lease().await;
    assert_ne!(other.unit, lease.unit, "what it holds is not granted again");
    // Coming back without it gives it up.
    drop(worker);
    let mut worker = Puppet::connect(&bench, 1, vec![other.name.clone()]).await;
    let again = worker.lease().await;
    assert_eq!((again.unit, again.name.epoch), (lease.unit, lease.name.epoch + 1));
}

/// Something wrong about a block, and the word by which the coordinator names it.
fn lies(good: &FilmBlock) -> Vec<(EncodedBlock, &'static str)> {
    let spoiled = |spoil: fn(&mut FilmBlock)| {
        let mut block = good.clone();
        spoil(&mut block);
        block::encode(&block).unwrap()
    };
    let honest = block::encode(good).unwrap();
    let mut flipped = honest.compressed.to_vec();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    vec![
        (spoiled(|block| block.tile.x += 1), "the unit is"),
        (spoiled(|block| block.planes[0].1[0] = f32::INFINITY), "not finite"),
        (spoiled(|block| drop(block.planes.pop())), "the plan lists"),
        (EncodedBlock { compressed: flipped.into(), ..honest.clone() }, "block"),
        (EncodedBlock { size: 1 << 40, ..honest }, "expected at most"),
    ]
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_wrong_is_refused_and_goes_to_somebody_else() {
    let bench = Bench::new().await;
    let mut honest = Puppet::connect(&bench, 1, Vec::new()).await;
    let mut units = 0;
    // Five lies by as many liars, then three by one: that one is set aside.
    for (liar, which) in [(10, 0), (11, 1), (12, 2), (13, 3), (14, 4), (50, 0), (50, 1), (50, 2)] {
        let mut liar = Puppet::connect(&bench, liar, Vec::new()).await;
        let lease = liar.lease().await;
        let good = bench.render(&lease);
        let (lie, named) = &lies(&good)[which];
        let (outcome, reason) = liar.deliver(&lease, lie).await;
        assert_eq!(outcome, Outcome::Refused, "lie {which}");
        assert!(reason.contains(named), "lie {which}: {reason}");
        let workers = bench.handle.workers().await.unwrap();
        let seen = workers.iter().find(|worker| worker.id.to_bytes() == liar.id).unwrap();
        assert_eq!((seen.failed, seen.set_aside_until.is_some()), (1, units == 7), "{seen:?}");
        let again = honest.lease().await;
        assert_eq!(again.unit, lease.unit, "the unit goes to the other worker");
        assert_eq!(honest.deliver(&again, &block::encode(&good).unwrap()).await.0, Outcome::Accepted);
        units += 1;
        assert_eq!(bench.done().await, units);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn strangers_are_told_what_is_wrong() {
    let bench = Bench::new().await;
    let newer = v1::Hello { protocol_min: 7, protocol_max: 9, ..hello([1; 16], Vec::new()) };
    let refused = open(&bench, Say::Hello(newer)).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
    assert!(refused.message().contains("versions 7 to 9"), "{refused}");
    let mute = open(&bench, Say::Credit(v1::Credit { leases: 1 })).await.unwrap_err();
    assert_eq!((mute.code(), mute.message()), (Code::InvalidArgument, "the first message must be a hello"));
    let nameless = v1::Hello { worker: vec![1, 2].into(), ..hello([1; 16], Vec::new()) };
    assert!(open(&bench, Say::Hello(nameless)).await.unwrap_err().message().contains("hello.worker is 2 bytes"));
    let mut client = bench.client();
    let absent = client.fetch_asset(v1::FetchAssetRequest { digest: vec![0; 32].into() }).await.unwrap_err();
    assert_eq!(absent.code(), Code::NotFound);
    let scene = bench.handle.get(bench.job).await.unwrap().scene;
    let mut chunks = client.fetch_asset(v1::FetchAssetRequest { digest: scene.to_bytes() }).await.unwrap().into_inner();
    let manifest = Manifest::decode(chunks.message().await.unwrap().unwrap().data).unwrap();
    assert_eq!(manifest.description, gradfarm_proto::Digest::of(common::SCENE.as_bytes()));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_whose_lease_names_no_job_is_told_to_drop_it() {
    let bench = Bench::new().await;
    let unknown = v1::LeaseRef { job: JobId::fresh().to_bytes().to_vec().into(), unit: 0, epoch: 1 };
    let mut worker = Puppet::connect(&bench, 1, vec![unknown.clone()]).await;
    let told = worker.hear().await;
    assert!(matches!(&told, Told::Revoke(revoke) if revoke.leases == [unknown]), "{told:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lease_that_is_handed_back_is_ready_at_once_and_blames_nobody() {
    let bench = Bench::with(Default::default(), |_| {}).await;
    let mut first = Puppet::connect(&bench, 1, Vec::new()).await;
    let mut second = Puppet::connect(&bench, 2, Vec::new()).await;
    let mut epoch = 0;
    // More often than a unit may fail or be lost.
    for _ in 0..20 {
        let lease = first.lease().await;
        assert_eq!((lease.name.unit, lease.name.epoch), (0, epoch + 1));
        epoch = lease.name.epoch;
        first.say(Say::Returned(v1::Returned { leases: vec![lease.name] })).await;
    }
    // The two streams are not in step.
    while bench.handle.workers().await.unwrap().iter().any(|worker| worker.leases > 0) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let lease = second.lease().await;
    assert_eq!((lease.name.unit, lease.name.epoch), (0, epoch + 1));
    let workers = bench.handle.workers().await.unwrap();
    assert!(workers.iter().all(|worker| worker.failed == 0 && worker.set_aside_until.is_none()), "{workers:?}");
    let text = bench.handle.scrape().await.unwrap();
    for line in
        ["gradfarm_grants_total 21", "gradfarm_returned_total 20", "gradfarm_units{state=\"leased\"} 1", "gradfarm_completions_total 0"]
    {
        assert!(text.lines().any(|told| told == line), "{line}: {text}");
    }
    assert!(!text.lines().any(|line| line.starts_with("gradfarm_attempts_total{") && !line.ends_with(" 0")), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_coordinator_that_drains_grants_nothing_and_takes_in_what_is_delivered() {
    let bench = Bench::with(Default::default(), |_| {}).await;
    let mut first = Puppet::connect(&bench, 1, Vec::new()).await;
    let lease = first.lease().await;
    assert_eq!(bench.handle.unready().await, Vec::<String>::new());
    bench.handle.drain().await.unwrap();
    let told = first.hear().await;
    assert!(matches!(told, Told::Drain(_)), "{told:?}");
    let reasons = bench.handle.unready().await;
    assert!(reasons.len() == 1 && reasons[0].contains("about to stop"), "{reasons:?}");
    let second = Puppet::connect(&bench, 2, Vec::new()).await;
    second.say(Say::Credit(v1::Credit { leases: 1 })).await;
    let result = block::encode(&bench.render(&lease)).unwrap();
    assert_eq!(first.deliver(&lease, &result).await.0, Outcome::Accepted);
    let held: u64 = bench.handle.workers().await.unwrap().iter().map(|worker| worker.leases).sum();
    assert_eq!((bench.done().await, held), (1, 0));
    bench.handle.idle().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_rests_gets_nothing_until_it_is_resumed() {
    let bench = Bench::with(Default::default(), |_| {}).await;
    let mut first = Puppet::connect(&bench, 1, Vec::new()).await;
    let held = first.lease().await;
    let mut second = Puppet::connect(&bench, 2, Vec::new()).await;
    let id = gradfarm::job::WorkerId::from_bytes(first.id);
    bench.handle.rest(id, true).await.unwrap();
    first.say(Say::Credit(v1::Credit { leases: 1 })).await;
    let result = block::encode(&bench.render(&held)).unwrap();
    assert_eq!(first.deliver(&held, &result).await.0, Outcome::Accepted, "what it holds it finishes");
    let other = second.lease().await;
    assert_ne!(other.name.unit, held.name.unit);
    let resting = bench.handle.workers().await.unwrap();
    let first_view = resting.iter().find(|worker| worker.id == id).unwrap();
    assert!(first_view.draining && first_view.leases == 0, "{first_view:?}");
    assert!(bench.handle.scrape().await.unwrap().contains("gradfarm_workers{state=\"draining\",pool=\"\"} 1"));
    bench.handle.rest(id, false).await.unwrap();
    assert!(matches!(first.hear().await, Told::Grant(_)), "the credit that it gave still stands");
    let nobody = gradfarm::job::WorkerId::from_bytes([9; 16]);
    assert!(bench.handle.rest(nobody, true).await.is_err());
}
