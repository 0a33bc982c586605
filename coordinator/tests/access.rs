//! Who is let in where: every address and every call with no credential, a wrong one, one that is over, and each role.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::collections::BTreeMap;

use common::{Server, assert_code, client_with, gradfarm, run, stderr, stdout};
use gradfarm::access::Role;
use gradfarm::api::roles::{Needs, TABLE};
use gradfarm_proto::v1;
use gradfarm_proto::v1::farm_client::FarmClient;
use reqwest::{Client, Method, StatusCode};
use serde_json::{Value, json};
use tonic::transport::Channel;
use tonic::{Code, Request};

/// Asks for an address of the table with nothing in its body; its status, and what sort of problem it is.
async fn ask(client: &Client, server: &Server, method: &str, path: &str) -> (StatusCode, String) {
    let id = "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11";
    let digest = "0".repeat(64);
    let path =
        path.replace("{job}", id).replace("{frame}", "0").replace("{digest}", &digest).replace("{token}", "none").replace("{worker}", id);
    assert!(!path.contains('{'), "this test knows no value for a part of {path}");
    let response = client.request(Method::from_bytes(method.as_bytes()).unwrap(), server.url(&path)).send().await.unwrap();
    let status = response.status();
    if status == StatusCode::UNAUTHORIZED {
        assert!(response.headers()["www-authenticate"].to_str().unwrap().starts_with("Bearer"));
    }
    // Streams never end, and problems are no streams.
    let text = match response.headers().get("content-type").is_some_and(|kind| kind == "application/problem+json") {
        true => response.text().await.unwrap(),
        false => String::new(),
    };
    let kind = serde_json::from_str::<Value>(&text).ok().and_then(|problem| Some(problem["type"].as_str()?.to_owned()));
    (status, kind.unwrap_or_default().rsplit(':').next().unwrap().to_owned())
}

async fn issue(server: &Server, role: Role, more: Value) -> String {
    let mut body = json!({ "name": format!("a {role}"), "role": role.name() });
    body.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let response = server.client().post(server.url("/tokens")).json(&body).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::CREATED);
    assert_eq!(response.headers()["cache-control"], "no-store");
    response.json::<Value>().await.unwrap()["token"].as_str().unwrap().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_address_wants_a_good_token_with_its_role() {
    let server = Server::start(0);
    let expired = issue(&server, Role::Admin, json!({ "ttl_seconds": 0 })).await;
    let revoked = issue(&server, Role::Admin, json!({})).await;
    let tokens: Value = server.client().get(server.url("/tokens")).send().await.unwrap().json().await.unwrap();
    let id = tokens["tokens"][0]["id"].as_str().unwrap();
    assert_eq!(tokens["tokens"][0]["token"], Value::Null, "a token is shown once");
    assert_eq!(server.client().delete(server.url(&format!("/tokens/{id}"))).send().await.unwrap().status(), StatusCode::OK);

    let strangers = [None, Some("gft_wrong"), Some(expired.as_str()), Some(revoked.as_str())].map(client_with);
    let mut roles = BTreeMap::new();
    for role in Role::ALL {
        roles.insert(role.name(), client_with(Some(&issue(&server, role, json!({})).await)));
    }
    for entry in TABLE {
        let Needs::Role(needed) = entry.needs else {
            for client in strangers.iter().chain(roles.values()) {
                assert_eq!(ask(client, &server, entry.method, entry.path).await.0, StatusCode::OK, "{}", entry.path);
            }
            continue;
        };
        for client in &strangers {
            let (status, kind) = ask(client, &server, entry.method, entry.path).await;
            assert_eq!(status, StatusCode::UNAUTHORIZED, "{} {}", entry.method, entry.path);
            assert!(kind == "unauthorised" || entry.method == "HEAD", "{kind}");
        }
        for role in Role::ALL {
            let (status, _) = ask(&roles[role.name()], &server, entry.method, entry.path).await;
            let refused = [StatusCode::UNAUTHORIZED, StatusCode::FORBIDDEN].contains(&status);
            assert_eq!(refused, !role.covers(needed), "{} {} with the role {role}: {status}", entry.method, entry.path);
            assert!(refused || status != StatusCode::METHOD_NOT_ALLOWED, "{} {} is not there", entry.method, entry.path);
        }
    }
    // A flood is borne for a while, and health answers through it.
    let mut flood = futures::future::join_all((0..600).map(|_| ask(&strangers[1], &server, "GET", "/jobs"))).await;
    flood.retain(|(status, _)| *status == StatusCode::TOO_MANY_REQUESTS);
    assert!(flood.len() > 100 && flood[0].1 == "too-often", "{}", flood.len());
    assert_eq!(ask(&strangers[0], &server, "GET", "/health").await.0, StatusCode::OK);
    // Others are not held up by it.
    assert_eq!(ask(&roles["viewer"], &server, "GET", "/jobs").await.0, StatusCode::OK);
    tokio::time::sleep(std::time::Duration::from_secs(1)).await;
    // Strangers cannot even tell what is there from what is not.
    for (method, path) in [("GET", "/nothing"), ("PUT", "/jobs"), ("DELETE", "/health"), ("GET", "/../token")] {
        assert_eq!(ask(&strangers[0], &server, method, path).await.0, StatusCode::UNAUTHORIZED, "{method} {path}");
    }
    let admin = &roles["admin"];
    assert_eq!(ask(admin, &server, "GET", "/nothing").await, (StatusCode::NOT_FOUND, "not-found".to_owned()));
    assert_eq!(ask(admin, &server, "PUT", "/jobs").await, (StatusCode::METHOD_NOT_ALLOWED, "method".to_owned()));
}

#[tokio::test(flavor = "multi_thread")]
async fn the_workers_port_wants_the_token_of_a_worker() {
    let server = Server::start(0);
    let admin = server.token();
    let expired = issue(&server, Role::Worker, json!({ "ttl_seconds": 0 })).await;
    let worker = std::fs::read_to_string(server.data.path().join("worker-token")).unwrap();
    let cases = [
        (None, Code::Unauthenticated),
        (Some("Bearer gft_wrong".to_owned()), Code::Unauthenticated),
        (Some(format!("Basic {}", worker.trim())), Code::Unauthenticated),
        (Some(format!("Bearer {expired}")), Code::Unauthenticated),
        (Some(format!("Bearer {admin}")), Code::PermissionDenied),
    ];
    let channel = Channel::from_shared(server.grpc.clone()).unwrap().connect().await.unwrap();
    let mut client = FarmClient::new(channel);
    let with = |value: &Option<String>| {
        let value = value.clone();
        move |mut request: Request<()>| {
            if let Some(value) = &value {
                request.metadata_mut().insert("authorization", value.parse().unwrap());
            }
            request.metadata().clone()
        }
    };
    for (value, code) in &cases {
        let metadata = with(value)(Request::new(()));
        let dress = |metadata: &tonic::metadata::MetadataMap| metadata.clone();
        let mut asset = Request::new(v1::FetchAssetRequest { digest: vec![0; 32].into() });
        *asset.metadata_mut() = dress(&metadata);
        assert_eq!(client.fetch_asset(asset).await.unwrap_err().code(), *code, "{value:?}");
        let mut deliver = Request::new(tokio_stream::iter(Vec::<v1::ResultChunk>::new()));
        *deliver.metadata_mut() = dress(&metadata);
        assert_eq!(client.deliver(deliver).await.unwrap_err().code(), *code, "{value:?}");
        let mut work = Request::new(tokio_stream::iter(Vec::<v1::WorkerMessage>::new()));
        *work.metadata_mut() = dress(&metadata);
        assert_eq!(client.work(work).await.unwrap_err().code(), *code, "{value:?}");
    }
    let mut asset = Request::new(v1::FetchAssetRequest { digest: vec![0; 32].into() });
    asset.metadata_mut().insert("authorization", format!("Bearer {}", worker.trim()).parse().unwrap());
    assert_eq!(client.fetch_asset(asset).await.unwrap_err().code(), Code::NotFound, "let in");

    // A token cannot speak for a worker that has a name of its own.
    let enrolled = gradfarm_proto::WorkerKind::enrolled([7; 16]);
    let hello = v1::Hello { protocol_min: 1, protocol_max: 1, worker: enrolled.to_vec().into(), ..v1::Hello::default() };
    let hello = v1::WorkerMessage { message: Some(v1::worker_message::Message::Hello(hello)) };
    let mut work = Request::new(tokio_stream::iter([hello]));
    work.metadata_mut().insert("authorization", format!("Bearer {}", worker.trim()).parse().unwrap());
    let refused = client.work(work).await.unwrap_err();
    assert_eq!(refused.code(), Code::PermissionDenied, "{refused}");
}

#[test]
fn the_command_line_finds_its_token_or_says_where_it_looked() {
    let server = Server::start(0);
    let data = server.data.path().to_str().unwrap();
    // The folder tells address and token.
    assert_code(&run(&["status", "--data", data]), 0);
    let lost = run(&["status", "--server", &server.http]);
    assert_code(&lost, 2);
    for said in ["no token was sent", "--token-file", "gradfarm-data"] {
        assert!(stderr(&lost).contains(said), "{said}: {}", stderr(&lost));
    }
    let file = server.data.path().join("anna.token");
    let create = ["token", "create", "--name", "anna", "--role", "viewer", "--ttl", "2h", "-o", file.to_str().unwrap()];
    let created = server.run(&create);
    assert_code(&created, 0);
    let token = std::fs::read_to_string(&file).unwrap();
    assert!(!stdout(&created).contains(token.trim()), "it is in the file alone");
    assert_code(&server.run(&create), 2);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        for name in ["anna.token", "token", "token.header", "worker-token"] {
            let mode = std::fs::metadata(server.data.path().join(name)).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{name}");
        }
    }
    let with =
        |arguments: &[&str]| gradfarm().args(arguments).args(["--server", &server.http]).env("GRADFARM_TOKEN", &token).output().unwrap();
    assert_code(&with(&["status"]), 0);
    let refused = with(&["token", "list"]);
    assert_code(&refused, 2);
    assert!(stderr(&refused).contains("needs the role admin"), "{}", stderr(&refused));
    let listed = server.run(&["token", "list"]);
    assert_code(&listed, 0);
    let line = stdout(&listed).lines().find(|line| line.contains("anna")).unwrap().to_owned();
    assert!(line.contains("viewer") && line.contains("for 1") && !line.contains("never"), "{line}");
    assert_code(&server.run(&["token", "revoke", line.split_whitespace().next().unwrap()]), 0);
    assert!(stderr(&with(&["status"])).contains("was revoked"));
    assert_code(&server.run(&["token", "revoke", "nobody"]), 2);

    // What was changed, and by whom, is remembered; so is what was refused.
    let audit = server.run(&["audit", "--json"]);
    assert_code(&audit, 0);
    let entries = common::last_json(&audit)["entries"].as_array().unwrap().clone();
    let told = |what: &str, outcome: &str| {
        entries.iter().any(|entry| entry["what"].as_str().unwrap().starts_with(what) && entry["outcome"] == outcome && entry["who"] != "")
    };
    assert!(told("POST /api/v1/tokens", "201") && told("DELETE /api/v1/tokens/", "200"), "{entries:?}");
    assert!(told("DELETE /api/v1/tokens/nobody", "404"), "{entries:?}");
    assert!(!stdout(&audit).contains(token.trim()));

    // Whoever restarts it keeps the tokens.
    let before = server.token();
    let mut server = server;
    server.crash_and_restart(0);
    assert_eq!(server.token(), before);
    assert_code(&server.run(&["status"]), 0);
    // The database holds no token.
    for entry in std::fs::read_dir(server.data.path()).unwrap() {
        let path = entry.unwrap().path();
        if path.file_name().unwrap().to_str().unwrap().starts_with("farm.db") {
            let bytes = std::fs::read(&path).unwrap();
            assert!(!bytes.windows(before.len()).any(|window| window == before.as_bytes()), "{}", path.display());
        }
    }
}
