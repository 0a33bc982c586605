//! A worker that misbehaves: late, silent, lying, of another version. Spoken by hand, message by message.

#![allow(dead_code, unreachable_pub, clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::time::Duration;

use gradfarm::job::JobId;
use gradfarm::service::{self, Config, Frames, Handle, Rules, Service, Submission};
use gradfarm_core::film::FilmBlock;
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{Plan, Request, Technique, WorkUnit};
use gradfarm_core::render::render_unit;
use gradfarm_core::scene::{NoAssets, Scene, SceneDescription};
use gradfarm_proto::block::EncodedBlock;
use gradfarm_proto::v1;
use gradfarm_proto::v1::coordinator_message::Message as Told;
use gradfarm_proto::v1::deliver_reply::Outcome;
use gradfarm_proto::v1::farm_client::FarmClient;
use gradfarm_proto::v1::result_chunk::Part;
use gradfarm_proto::v1::worker_message::Message as Say;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::Channel;
use tonic::{Request as Call, Status, Streaming};

pub const TTL: Duration = Duration::from_millis(400);

/// A coordinator with one job of 4 tiles × 2 sample ranges, and no workers.
pub struct Bench {
    pub handle: Handle,
    pub url: String,
    pub token: String,
    pub job: JobId,
    pub scene: Scene,
    _folder: tempfile::TempDir,
}

impl Bench {
    pub async fn new() -> Self {
        Self::open(TTL, Rules::default(), |_| {}).await
    }

    /// The same with rules, with something changed about the job, and with leases that nobody lets run out.
    pub async fn with(rules: Rules, change: impl FnOnce(&mut Submission)) -> Self {
        Self::open(50 * TTL, rules, change).await
    }

    async fn open(ttl: Duration, rules: Rules, change: impl FnOnce(&mut Submission)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let listener = service::listen((Ipv4Addr::LOCALHOST, 0).into()).await.unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let mut config = Config::new(folder.path());
        (config.heartbeat, config.lease_ttl) = (ttl / 4, ttl);
        config.rules = rules;
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
            description: super::SCENE.into(),
            assets: BTreeMap::new(),
            request,
            tile: 12,
            frames: Frames::default(),
            priority: 0,
            client_token: None,
            needs: Default::default(),
            verify: None,
            paused: false,
        };
        let mut submission = submission;
        change(&mut submission);
        let job = handle.submit(submission).await.unwrap();
        let description = SceneDescription::from_json(super::SCENE, "scene").unwrap();
        Self { handle, url, token, job, scene: Scene::compile(&description, &NoAssets).unwrap(), _folder: folder }
    }

    pub fn render(&self, lease: &Lease) -> FilmBlock {
        render_unit(&self.scene, &lease.plan, &lease.unit)
    }

    pub async fn done(&self) -> u64 {
        self.handle.get(self.job).await.unwrap().summary.units.done
    }
}

/// A worker that does only what the test says.
pub struct Puppet {
    pub id: [u8; 16],
    pub client: Client,
    pub outbox: mpsc::Sender<v1::WorkerMessage>,
    pub inbox: Streaming<v1::CoordinatorMessage>,
}

/// A lease as granted.
#[derive(Clone)]
pub struct Lease {
    pub name: v1::LeaseRef,
    pub unit: WorkUnit,
    pub plan: Plan,
}

/// Adds the token of a worker to every call.
#[derive(Clone)]
pub struct Bearer(String);

impl Interceptor for Bearer {
    fn call(&mut self, mut request: Call<()>) -> Result<Call<()>, Status> {
        request.metadata_mut().insert("authorization", format!("Bearer {}", self.0).parse().unwrap());
        Ok(request)
    }
}

pub type Client = FarmClient<InterceptedService<Channel, Bearer>>;

impl Bench {
    pub fn client(&self) -> Client {
        let channel = Channel::from_shared(self.url.clone()).unwrap().connect_lazy();
        FarmClient::with_interceptor(channel, Bearer(self.token.clone()))
    }
}

pub async fn open(bench: &Bench, first: Say) -> Result<(mpsc::Sender<v1::WorkerMessage>, Streaming<v1::CoordinatorMessage>), Status> {
    let (outbox, messages) = mpsc::channel(16);
    outbox.send(v1::WorkerMessage { message: Some(first) }).await.unwrap();
    Ok((outbox, bench.client().work(ReceiverStream::new(messages)).await?.into_inner()))
}

pub fn hello(id: [u8; 16], held: Vec<v1::LeaseRef>) -> v1::Hello {
    let (protocol_min, protocol_max) = (1, 1);
    v1::Hello { protocol_min, protocol_max, worker: id.to_vec().into(), name: "puppet".into(), threads: 1, held, ..v1::Hello::default() }
}

impl Puppet {
    pub async fn connect(bench: &Bench, id: u8, held: Vec<v1::LeaseRef>) -> Self {
        Self::greet(bench, hello([id; 16], held)).await
    }

    /// Connects with these words.
    pub async fn greet(bench: &Bench, hello: v1::Hello) -> Self {
        let id = hello.worker.to_vec().try_into().unwrap();
        let (outbox, mut inbox) = open(bench, Say::Hello(hello)).await.unwrap();
        let welcome = inbox.message().await.unwrap().unwrap().message.unwrap();
        assert!(matches!(welcome, Told::Welcome(v1::Welcome { protocol: 1, .. })), "{welcome:?}");
        Self { id, client: bench.client(), outbox, inbox }
    }

    pub async fn say(&self, message: Say) {
        self.outbox.send(v1::WorkerMessage { message: Some(message) }).await.unwrap();
    }

    pub async fn hear(&mut self) -> Told {
        let next = tokio::time::timeout(Duration::from_secs(10), self.inbox.message());
        next.await.expect("the coordinator says something").unwrap().unwrap().message.unwrap()
    }

    /// Asks for one lease.
    pub async fn lease(&mut self) -> Lease {
        self.say(Say::Credit(v1::Credit { leases: 1 })).await;
        let Told::Grant(mut grant) = self.hear().await else { panic!("no grant") };
        assert_eq!((grant.jobs.len(), grant.leases.len()), (1, 1));
        let lease = grant.leases.remove(0);
        let plan = grant.jobs.remove(0).plan.unwrap().try_into().unwrap();
        Lease { name: lease.lease.unwrap(), unit: lease.unit.unwrap().try_into().unwrap(), plan }
    }

    pub async fn deliver(&mut self, lease: &Lease, block: &EncodedBlock) -> (Outcome, String) {
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
