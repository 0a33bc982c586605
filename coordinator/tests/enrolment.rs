//! Workers from other machines: how they join, what they show, and everything that is tried instead of a good certificate.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{Server, assert_code, run, stderr, stdout};
use gradfarm_proto::v1::enrolment_client::EnrolmentClient;
use gradfarm_proto::v1::farm_client::FarmClient;
use gradfarm_proto::v1::worker_message::Message as Say;
use gradfarm_proto::{COORDINATOR_NAME, WorkerIdentity, WorkerKind, v1, worker_uri};
use gradfarm_worker::{Config, Credential};
use rcgen::{BasicConstraints, CertificateParams, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair, SanType};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use tokio::sync::oneshot;
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};
use tonic::{Code, Status};

const PATIENCE: Duration = Duration::from_secs(120);

/// Issues a join token into a file.
fn join(server: &Server, name: &str, more: &[&str]) -> PathBuf {
    let file = server.data.path().join(name);
    let output = server.run(&[&["join-token", "create", "-o", file.to_str().unwrap()], more].concat());
    assert_code(&output, 0);
    file
}

/// A worker that joins; ends with what became of it.
struct Joined {
    stop: Option<oneshot::Sender<()>>,
    task: tokio::task::JoinHandle<Result<(), gradfarm_worker::Error>>,
}

impl Joined {
    fn start(server: &Server, join: Option<PathBuf>, state: &Path) -> Self {
        let mut config = Config::new(&server.grpc, "far away", 1);
        config.credential = Credential::Enrolment { join, state: state.to_owned() };
        let (stop, stopping) = oneshot::channel::<()>();
        let task = tokio::spawn(gradfarm_worker::run(config, async move { drop(stopping.await) }));
        Self { stop: Some(stop), task }
    }

    /// What it gave up for.
    async fn gives_up(self) -> String {
        let ended = tokio::time::timeout(PATIENCE, self.task).await.expect("it gives up").unwrap();
        ended.unwrap_err().to_string()
    }

    async fn stops(mut self) {
        drop(self.stop.take());
        tokio::time::timeout(PATIENCE, self.task).await.expect("it stops").unwrap().unwrap();
    }
}

/// The workers that have joined, as the command line lists them.
fn enrolled(server: &Server) -> Vec<serde_json::Value> {
    let output = server.run(&["worker", "list", "--json"]);
    assert_code(&output, 0);
    common::last_json(&output)["workers"].as_array().unwrap().clone()
}

async fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let since = Instant::now();
    while !there() {
        assert!(since.elapsed() < PATIENCE, "no sign of {what}");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_joins_works_renews_and_is_thrown_out() {
    let server = Server::start_with(0, &["--tls", "--worker-certificates", "9s"]);
    assert!(server.http.starts_with("https://") && server.grpc.starts_with("https://"));
    let file = join(&server, "north.join", &["--pool", "north"]);
    let state = server.data.path().join("far");
    let worker = Joined::start(&server, Some(file.clone()), &state);
    let (_folder, scene) = common::folder();
    let image = server.data.path().join("a.exr");
    assert_code(&server.run(&["submit", scene.to_str().unwrap(), "--samples", "4", "--wait", "-o", image.to_str().unwrap()]), 0);
    assert!(std::fs::read(&image).unwrap().starts_with(b"\x76\x2f\x31\x01"));
    let listed = enrolled(&server);
    assert_eq!((listed.len(), &listed[0]["pool"], &listed[0]["name"]), (1, &"north".into(), &"far away".into()));
    let id = listed[0]["id"].as_str().unwrap().to_owned();
    #[cfg(unix)]
    for name in ["worker.pem", "authority.pem"] {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(std::fs::metadata(state.join(name)).unwrap().permissions().mode() & 0o777, 0o600, "{name}");
    }

    // The token was for one: whoever found it comes too late.
    let thief = Joined::start(&server, Some(file), &server.data.path().join("thief"));
    assert!(thief.gives_up().await.contains("used already"));
    // One name, one worker.
    assert!(Joined::start(&server, None, &state).gives_up().await.contains("in use by another worker"));

    wait_for("a renewal", || enrolled(&server)[0]["renewed_ms"].is_number()).await;
    worker.stops().await;
    // It comes back without a token, by the same name.
    let worker = Joined::start(&server, None, &state);
    assert_code(&server.run(&["submit", scene.to_str().unwrap(), "--samples", "4", "--seed", "2", "--wait"]), 0);
    assert_eq!(enrolled(&server).len(), 1);

    assert_code(&server.run(&["worker", "revoke", &id]), 0);
    assert!(worker.gives_up().await.contains("was revoked"));
    assert!(Joined::start(&server, None, &state).gives_up().await.contains("was revoked"));
    assert!(enrolled(&server)[0]["revoked_ms"].is_number());
    assert_code(&server.run(&["worker", "revoke", "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11"]), 2);
}

/// A connection that trusts the farm's authority and shows a certificate, or none.
fn channel(server: &Server, papers: Option<(String, String)>) -> Channel {
    let authority = std::fs::read_to_string(server.data.path().join("authority/ca.pem")).unwrap();
    let tls = ClientTlsConfig::new().ca_certificate(Certificate::from_pem(authority)).domain_name(COORDINATOR_NAME);
    let tls = match papers {
        Some((certificate, key)) => tls.identity(Identity::from_pem(certificate, key)),
        None => tls,
    };
    Endpoint::from_shared(server.grpc.clone()).unwrap().tls_config(tls).unwrap().connect_lazy()
}

/// Asks for an asset: what a caller is told who is let in, or not.
async fn knock(server: &Server, papers: Option<(String, String)>) -> Status {
    let request = v1::FetchAssetRequest { digest: vec![0; 32].into() };
    FarmClient::new(channel(server, papers)).fetch_asset(request).await.unwrap_err()
}

/// Says hello as some worker.
async fn greet(server: &Server, papers: (String, String), worker: [u8; 16]) -> Result<(), Status> {
    let hello = v1::Hello { protocol_min: 1, protocol_max: 99, worker: worker.to_vec().into(), ..v1::Hello::default() };
    let hello = v1::WorkerMessage { message: Some(Say::Hello(hello)) };
    let stream = FarmClient::new(channel(server, Some(papers))).work(tokio_stream::iter([hello])).await?;
    stream.into_inner().message().await.map(drop)
}

/// A certificate for a worker, by an authority whose certificate and key lie in a folder.
fn forge(authority: &Path, uri: &str, days: (i64, i64)) -> (String, String) {
    let read = |name: &str| std::fs::read_to_string(authority.join(name)).unwrap();
    let issuer = Issuer::from_ca_cert_pem(&read("ca.pem"), KeyPair::from_pem(&read("ca.key")).unwrap()).unwrap();
    let mut params = CertificateParams::default();
    params.subject_alt_names.push(SanType::URI(uri.try_into().unwrap()));
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
    let day = |days: i64| rcgen::date_time_ymd(1970, 1, 1) + Duration::from_secs((now.as_secs() as i64 + days * 86_400) as u64);
    (params.not_before, params.not_after) = (day(days.0), day(days.1));
    let key = KeyPair::generate().unwrap();
    (params.signed_by(&key, &issuer).unwrap().pem(), key.serialize_pem())
}

/// Another authority, in a folder like ours.
fn other_authority(folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    let key = KeyPair::generate().unwrap();
    let mut params = CertificateParams::default();
    params.distinguished_name.push(rcgen::DnType::CommonName, "another authority");
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    std::fs::write(folder.join("ca.pem"), params.self_signed(&key).unwrap().pem()).unwrap();
    std::fs::write(folder.join("ca.key"), key.serialize_pem()).unwrap();
}

/// Joins by hand: certificate and key.
async fn enrol(server: &Server, join: &Path) -> Result<(String, String), Status> {
    let text = std::fs::read_to_string(join).unwrap();
    let token = text.lines().find(|line| line.starts_with("gfj_")).unwrap().to_owned();
    let key = KeyPair::generate().unwrap();
    let request = CertificateParams::default().serialize_request(&key).unwrap().der().to_vec();
    let asked = v1::EnrolRequest { request: request.into(), token, name: "by hand".into() };
    let reply = EnrolmentClient::new(channel(server, None)).enrol(asked).await?;
    Ok((reply.into_inner().certificate, key.serialize_pem()))
}

fn identity(certificate: &str) -> WorkerIdentity {
    WorkerIdentity::of(&CertificateDer::from_pem_slice(certificate.as_bytes()).unwrap()).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn only_its_own_good_certificate_lets_a_worker_in() {
    let folder = tempfile::tempdir().unwrap();
    let (trusted, stranger) = (folder.path().join("trusted"), folder.path().join("stranger"));
    other_authority(&trusted);
    other_authority(&stranger);
    let server = Server::start_with(0, &["--tls", "--client-ca", trusted.join("ca.pem").to_str().unwrap()]);
    let own = server.data.path().join("authority");
    let nobody = worker_uri(WorkerKind::enrolled([5; 16]), None);

    // Nothing, and what TLS itself refuses: other authorities, certificates that are over or not yet good.
    assert_eq!(knock(&server, None).await.code(), Code::Unauthenticated);
    for (what, papers) in [
        ("another authority", forge(&stranger, &nobody, (-1, 1))),
        ("expired", forge(&own, &nobody, (-2, -1))),
        ("not yet good", forge(&own, &nobody, (1, 2))),
    ] {
        let refused = knock(&server, Some(papers)).await;
        assert!(![Code::NotFound, Code::PermissionDenied].contains(&refused.code()), "{what}: {refused}");
    }
    // Signed by ours, but never enrolled: even whoever stole the authority's key for a moment.
    let refused = knock(&server, Some(forge(&own, &nobody, (-1, 1)))).await;
    assert_eq!(refused.code(), Code::PermissionDenied);
    assert!(refused.message().contains("never enrolled"), "{refused}");
    let nameless = knock(&server, Some(forge(&own, "spiffe://gradfarm/worker/x", (-1, 1)))).await;
    assert!(nameless.message().contains("names no worker"), "{nameless}");

    // A good one, for itself alone.
    let file = join(&server, "one.join", &[]);
    let papers = enrol(&server, &file).await.unwrap();
    let worker = identity(&papers.0).worker;
    assert_eq!(knock(&server, Some(papers.clone())).await.code(), Code::NotFound, "let in");
    greet(&server, papers.clone(), worker).await.unwrap();
    for other in [WorkerKind::enrolled([6; 16]), [1; 16]] {
        let refused = greet(&server, papers.clone(), other).await.unwrap_err();
        assert_eq!(refused.code(), Code::PermissionDenied, "{refused}");
        assert!(refused.message().contains("cannot speak for"), "{refused}");
        let lease = v1::LeaseRef { job: vec![0; 16].into(), unit: 0, epoch: 0 };
        let header = v1::ResultHeader {
            worker: other.to_vec().into(),
            lease: Some(lease),
            digest: vec![0; 32].into(),
            ..v1::ResultHeader::default()
        };
        let chunk = v1::ResultChunk { part: Some(v1::result_chunk::Part::Header(header)) };
        let delivered = FarmClient::new(channel(&server, Some(papers.clone()))).deliver(tokio_stream::iter([chunk])).await;
        assert_eq!(delivered.unwrap_err().code(), Code::PermissionDenied);
    }

    // Join tokens: once, in time, until revoked, and by whoever has a key.
    assert!(enrol(&server, &file).await.unwrap_err().message().contains("used already"));
    let late = join(&server, "late.join", &["--ttl", "1s"]);
    tokio::time::sleep(Duration::from_millis(1100)).await;
    assert!(enrol(&server, &late).await.unwrap_err().message().contains("has expired"));
    let twice = join(&server, "twice.join", &["--uses", "2"]);
    let (first, second) = (enrol(&server, &twice).await.unwrap(), enrol(&server, &twice).await.unwrap());
    assert_ne!(identity(&first.0).worker, identity(&second.0).worker);
    assert!(enrol(&server, &twice).await.is_err());
    let revoked = join(&server, "revoked.join", &[]);
    let listed = server.run(&["join-token", "list", "--json"]);
    let id = common::last_json(&listed)["join_tokens"][0]["id"].as_str().unwrap().to_owned();
    assert!(!stdout(&listed).contains("gfj_"), "a token is shown once");
    assert_code(&server.run(&["join-token", "revoke", &id]), 0);
    assert!(enrol(&server, &revoked).await.is_err());
    let text = std::fs::read_to_string(join(&server, "odd.join", &[])).unwrap();
    let token = text.lines().find(|line| line.starts_with("gfj_")).unwrap().to_owned();
    let mut client = EnrolmentClient::new(channel(&server, None));
    for (request, token, code) in [
        (vec![1, 2, 3], token.clone(), Code::InvalidArgument),
        (vec![0; 60_000], token.clone(), Code::InvalidArgument),
        (vec![], "gfj_wrong".to_owned(), Code::PermissionDenied),
    ] {
        let asked = v1::EnrolRequest { request: request.into(), token, name: "odd".into() };
        assert_eq!(client.enrol(asked).await.unwrap_err().code(), code);
    }
    assert!(enrol(&server, &server.data.path().join("odd.join")).await.is_ok(), "nonsense costs no token");
    let renewal = client.renew(v1::RenewRequest { request: vec![].into() }).await.unwrap_err();
    assert_eq!(renewal.code(), Code::Unauthenticated);

    // Another authority that is trusted names its own workers, and none of ours.
    let theirs = forge(&trusted, "spiffe://studio.example/render/7", (-1, 1));
    let its = identity(&theirs.0);
    greet(&server, theirs.clone(), its.worker).await.unwrap();
    assert_eq!(greet(&server, theirs.clone(), worker).await.unwrap_err().code(), Code::PermissionDenied);
    let posing = knock(&server, Some(forge(&trusted, &worker_uri(worker, None), (-1, 1)))).await;
    assert!(posing.message().contains("only the farm's own authority"), "{posing}");
    let theirs_id = uuid::Uuid::from_bytes(its.worker).to_string();
    assert_code(&server.run(&["worker", "revoke", &theirs_id]), 0);
    assert!(greet(&server, theirs, its.worker).await.unwrap_err().message().contains("was revoked"));

    // A worker of this machine may still use its token, over TLS as well.
    let token = std::fs::read_to_string(server.data.path().join("worker-token")).unwrap();
    let mut request = tonic::Request::new(v1::FetchAssetRequest { digest: vec![0; 32].into() });
    request.metadata_mut().insert("authorization", format!("Bearer {}", token.trim()).parse().unwrap());
    assert_eq!(FarmClient::new(channel(&server, None)).fetch_asset(request).await.unwrap_err().code(), Code::NotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn people_speak_tls_to_a_certificate_that_they_can_check() {
    let folder = tempfile::tempdir().unwrap();
    let key = KeyPair::generate().unwrap();
    let certificate = CertificateParams::new(["127.0.0.1".to_owned()]).unwrap().self_signed(&key).unwrap().pem();
    let (cert, key_file) = (folder.path().join("c.pem"), folder.path().join("k.pem"));
    std::fs::write(&cert, certificate).unwrap();
    std::fs::write(&key_file, key.serialize_pem()).unwrap();
    let (cert, key_file) = (cert.to_str().unwrap(), key_file.to_str().unwrap());

    let own = Server::start_with(1, &["--tls", "--listen", "0.0.0.0:0"]);
    let given = Server::start_with(0, &["--tls-cert", cert, "--tls-key", key_file]);
    let token = own.data.path().join("token");
    // On the same machine the folder tells whom to trust.
    assert_code(&own.run(&["status"]), 0);
    // Without that, a certificate of an authority that nobody knows is refused, and so is everything in the clear.
    let blind = run(&["status", "--server", &own.http, "--token-file", token.to_str().unwrap()]);
    assert_code(&blind, 4);
    assert!(stderr(&blind).contains("certificate"), "{}", stderr(&blind));
    let authority = own.data.path().join("authority/ca.pem");
    let told = run(&["status", "--server", &own.http, "--token-file", token.to_str().unwrap(), "--ca", authority.to_str().unwrap()]);
    assert_code(&told, 0);
    assert!(common::client_with(None).get(own.url("/health").replace("https", "http")).send().await.is_err());
    assert_code(&given.run(&["status"]), 4);
    assert_code(&given.run(&["status", "--ca", cert]), 0);
    // Workers that joined know it by our own certificate all the same.
    let worker = Joined::start(&given, Some(join_with(&given, cert)), &given.data.path().join("far"));
    let (_folder, scene) = common::folder();
    assert_code(&given.run(&["submit", scene.to_str().unwrap(), "--samples", "4", "--wait", "--ca", cert]), 0);
    worker.stops().await;
    // The embedded worker of the other one works over TLS, too.
    assert_code(&own.run(&["submit", scene.to_str().unwrap(), "--samples", "4", "--wait"]), 0);
}

fn join_with(server: &Server, ca: &str) -> PathBuf {
    join(server, "a.join", &["--ca", ca])
}
