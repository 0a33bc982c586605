//! The protocol with a worker that misbehaves: late, silent, lying, of another version. Spoken by hand, message by message.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::time::Duration;

use gradfarm::job::JobId;
use gradfarm::service::{self, Config, Frames, Handle, Service, Submission};
use gradfarm_core::film::FilmBlock;
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{Plan, Request, Technique, WorkUnit};
use gradfarm_core::render::render_unit;
use gradfarm_core::scene::{NoAssets, Scene, SceneDescription};
use gradfarm_proto::block::{self, EncodedBlock};
use gradfarm_proto::v1::coordinator_message::Message as Told;
use gradfarm_proto::v1::deliver_reply::Outcome;
use gradfarm_proto::v1::farm_client::FarmClient;
use gradfarm_proto::v1::result_chunk::Part;
use gradfarm_proto::v1::worker_message::Message as Say;
use gradfarm_proto::{Manifest, v1};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::Channel;
use tonic::{Code, Request as Call, Status, Streaming};

const TTL: Duration = Duration::from_millis(400);

/// A coordinator with one job of 4 tiles × 2 sample ranges, and no workers.
struct Bench {
    handle: Handle,
    url: String,
    token: String,
    job: JobId,
    scene: Scene,
    _folder: tempfile::TempDir,
}

impl Bench {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let listener = service::listen((Ipv4Addr::LOCALHOST, 0).into()).await.unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let mut config = Config::new(folder.path());
        (config.heartbeat, config.lease_ttl) = (TTL / 4, TTL);
        let service = Service::open(config).await.unwrap();
        let handle = service.handle();
        let token = handle.gate().in_process_worker().expose().to_owned();
        tokio::spawn(service.run(listener, std::future::pending()));
        let request = Request {
            technique: Some(Technique::Gpt),
            samples: Some(32),
            extent: Some(Extent { width: 24, height: 16 }),
            ..Request::default()
        };
        let submission = Submission {
            name: "protocol".into(),
            description: common::SCENE.into(),
            assets: BTreeMap::new(),
            request,
            tile: 12,
            frames: Frames::default(),
            priority: 0,
            client_token: None,
        };
        let job = handle.submit(submission).await.unwrap();
        let description = SceneDescription::from_json(common::SCENE, "scene").unwrap();
        Self { handle, url, token, job, scene: Scene::compile(&description, &NoAssets).unwrap(), _folder: folder }
    }

    fn render(&self, lease: &Lease) -> FilmBlock {
        render_unit(&self.scene, &lease.plan, &lease.unit)
    }

    async fn done(&self) -> u64 {
        self.handle.get(self.job).await.unwrap().summary.units.done
    }
}

/// A worker that does only what the test says.
struct Puppet {
    id: [u8; 16],
    client: Client,
    outbox: mpsc::Sender<v1::WorkerMessage>,
    inbox: Streaming<v1::CoordinatorMessage>,
}

/// A lease as granted.
#[derive(Clone)]
struct Lease {
    name: v1::LeaseRef,
    unit: WorkUnit,
    plan: Plan,
}

/// Adds the token of a worker to every call.
#[derive(Clone)]
struct Bearer(String);

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Call<()>) -> Result<Call<()>, Status> {
        request.metadata_mut().insert("authorization", format!("Bearer {}", self.0).parse().unwrap());
        Ok(request)
    }
}

type Client = FarmClient<InterceptedService<Channel, Bearer>>;

impl Bench {
    fn client(&self) -> Client {
        let channel = Channel::from_shared(self.url.clone()).unwrap().connect_lazy();
        FarmClient::with_interceptor(channel, Bearer(self.token.clone()))
    }
}

async fn open(bench: &Bench, first: Say) -> Result<(mpsc::Sender<v1::WorkerMessage>, Streaming<v1::CoordinatorMessage>), Status> {
    let (outbox, messages) = mpsc::channel(16);
    outbox.send(v1::WorkerMessage { message: Some(first) }).await.unwrap();
    Ok((outbox, bench.client().work(ReceiverStream::new(messages)).await?.into_inner()))
}

fn hello(id: [u8; 16], held: Vec<v1::LeaseRef>) -> v1::Hello {
    let (protocol_min, protocol_max) = (1, 1);
    v1::Hello { protocol_min, protocol_max, worker: id.to_vec().into(), name: "puppet".into(), threads: 1, held, ..v1::Hello::default() }
}

impl Puppet {
    async fn connect(bench: &Bench, id: u8, held: Vec<v1::LeaseRef>) -> Self {
        let id = [id; 16];
        let (outbox, mut inbox) = open(bench, Say::Hello(hello(id, held))).await.unwrap();
        let welcome = inbox.message().await.unwrap().unwrap().message.unwrap();
        assert!(matches!(welcome, Told::Welcome(v1::Welcome { protocol: 1, lease_ttl_ms: 400, .. })), "{welcome:?}");
        Self { id, client: bench.client(), outbox, inbox }
    }

    async fn say(&self, message: Say) {
        self.outbox.send(v1::WorkerMessage { message: Some(message) }).await.unwrap();
    }

    async fn hear(&mut self) -> Told {
        let next = tokio::time::timeout(Duration::from_secs(10), self.inbox.message());
        next.await.expect("the coordinator says something").unwrap().unwrap().message.unwrap()
    }

    /// Asks for one lease.
    async fn lease(&mut self) -> Lease {
        self.say(Say::Credit(v1::Credit { leases: 1 })).await;
        let Told::Grant(mut grant) = self.hear().await else { panic!("no grant") };
        assert_eq!((grant.jobs.len(), grant.leases.len()), (1, 1));
        let lease = grant.leases.remove(0);
        let plan = grant.jobs.remove(0).plan.unwrap().try_into().unwrap();
        Lease { name: lease.lease.unwrap(), unit: lease.unit.unwrap().try_into().unwrap(), plan }
    }

    async fn deliver(&mut self, lease: &Lease, block: &EncodedBlock) -> (Outcome, String) {
        let header = v1::ResultHeader {
            worker: self.id.to_vec().into(),
            lease: Some(lease.name.clone()),
            digest: block.digest.to_bytes(),
            size: block.size,
            compressed_size: block.compressed.len() as u64,
            load_seconds: 0.0,
            compile_seconds: 0.0,
            render_seconds: 0.1,
        };
        let half = block.compressed.len() / 2;
        let parts = [Part::Header(header), Part::Data(block.compressed.slice(..half)), Part::Data(block.compressed.slice(half..))];
        let chunks = tokio_stream::iter(parts.map(|part| v1::ResultChunk { part: Some(part) }));
        let reply = self.client.deliver(chunks).await.unwrap().into_inner();
        (reply.outcome(), reply.reason)
    }
}

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
    first.say(Say::Heartbeat(v1::Heartbeat { held: vec![lease.name.clone()], scenes: Vec::new() })).await;
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
        worker.say(Say::Heartbeat(v1::Heartbeat { held: vec![lease.name.clone()], scenes: Vec::new() })).await;
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
