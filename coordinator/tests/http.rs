//! The HTTP interface over a real socket: a server process with two workers, spoken to as any client would.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::time::Duration;

use common::{SCENE, Server, assert_code, stdout};
use futures::StreamExt;
use reqwest::multipart::{Form, Part};
use reqwest::{Client, Response, StatusCode};
use serde_json::{Value, json};

fn file(name: &str, bytes: impl Into<Vec<u8>>) -> Part {
    Part::bytes(bytes.into()).file_name(name.to_owned())
}

async fn body(response: Response, status: StatusCode) -> Value {
    let found = response.status();
    let text = response.text().await.unwrap();
    assert_eq!(found, status, "{text}");
    serde_json::from_str(&text).unwrap()
}

/// Checks that an answer is a problem of this sort, and returns it.
async fn problem(response: Response, status: StatusCode, kind: &str) -> Value {
    assert_eq!(response.headers()["content-type"], "application/problem+json");
    let problem = body(response, status).await;
    assert_eq!(problem["type"], format!("urn:gradfarm:problem:{kind}"), "{problem}");
    assert_eq!(problem["status"], status.as_u16());
    assert!(!problem["detail"].as_str().unwrap().is_empty());
    problem
}

/// All events of a job until its stream ends, as (name, data).
async fn events(client: &Client, url: String) -> Vec<(String, Value)> {
    let response = client.get(url).send().await.unwrap();
    assert_eq!(response.headers()["content-type"], "text/event-stream");
    let text = response.text().await.unwrap();
    let blocks = text.split("\n\n").filter(|block| block.contains("data:"));
    let field = |block: &str, name: &str| block.lines().find_map(|line| line.strip_prefix(name)).unwrap().trim().to_owned();
    blocks.map(|block| (field(block, "event:"), serde_json::from_str(&field(block, "data:")).unwrap())).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_form_becomes_an_image() {
    let server = Server::start(2);
    let client = server.client();
    let (scene, mesh) = common::scene_with_mesh();
    let form = Form::new()
        .part("scene", file("wedge.json", scene))
        .part("asset", file("models/wedge.obj", mesh))
        .part("asset", file("unused.obj", ""))
        .text("samples", "40")
        .text("technique", "gpt")
        .text("reconstruction", "l2")
        .text("tile", "8")
        .text("name", "7");
    let response = client.post(server.url("/jobs")).multipart(form).send().await.unwrap();
    let location = response.headers()["location"].to_str().unwrap().to_owned();
    let job = body(response, StatusCode::CREATED).await;
    let id = job["id"].as_str().unwrap();
    assert_eq!(location, format!("/api/v1/jobs/{id}"));
    assert_eq!((&job["name"], &job["tile"], &job["plan"]["samples"]), (&json!("7"), &json!(8), &json!(40)));
    assert_eq!(job["progress"]["samples"]["total"], 24 * 16 * 40);

    let events = events(&client, server.url(&format!("/jobs/{id}/events?tiles=true"))).await;
    assert_eq!(events.first().unwrap().0, "state");
    assert_eq!(events.last().unwrap(), &("state".to_owned(), json!({ "state": "done", "error": null })));

    let job = body(client.get(server.url(&format!("/jobs/{id}"))).send().await.unwrap(), StatusCode::OK).await;
    assert_eq!((&job["state"], &job["frames"][0]["state"]), (&json!("done"), &json!("done")));
    assert_eq!(job["progress"]["samples"]["done"], 24 * 16 * 40);
    assert_eq!(job["statistics"]["samples"], 24 * 16 * 40);
    let tiles = body(client.get(server.url(&format!("/jobs/{id}/frames/0/tiles"))).send().await.unwrap(), StatusCode::OK).await;
    let tiles = tiles["tiles"].as_array().unwrap();
    assert_eq!(tiles.len(), 3 * 2);
    assert!(tiles.iter().all(|tile| tile["units"]["done"] == tile["units"]["total"] && tile["leased"] == 0), "{tiles:?}");

    for (kind, media_type, magic) in [("exr", "image/x-exr", &b"\x76\x2f\x31\x01"[..]), ("png", "image/png", &b"\x89PNG"[..])] {
        let address = job["frames"][0]["files"][kind].as_str().unwrap();
        let image = client.get(format!("{}{address}", server.http)).send().await.unwrap();
        assert_eq!(image.headers()["content-type"], media_type);
        assert!(image.bytes().await.unwrap().starts_with(magic), "{kind}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn uploaded_files_are_known_by_content() {
    let server = Server::start(1);
    let client = server.client();
    let (scene, mesh) = common::scene_with_mesh();
    let scene: Value = serde_json::from_str(&scene).unwrap();
    let uploaded = client.post(server.url("/assets")).body(mesh).send().await.unwrap();
    let location = uploaded.headers()["location"].to_str().unwrap().to_owned();
    let asset = body(uploaded, StatusCode::CREATED).await;
    assert_eq!(asset["bytes"], mesh.len());
    assert_eq!(asset["digest"], blake3::hash(mesh.as_bytes()).to_hex().as_str());
    assert_eq!(client.head(format!("{}{location}", server.http)).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    let absent = blake3::hash(b"absent").to_hex();
    assert_eq!(client.head(server.url(&format!("/assets/{absent}"))).send().await.unwrap().status(), StatusCode::NOT_FOUND);

    let post = |body: Value| client.post(server.url("/jobs")).json(&body).send();
    let request = json!({ "scene": scene, "assets": { "models/wedge.obj": asset["digest"] }, "options": { "samples": 2 } });
    let job = body(post(request).await.unwrap(), StatusCode::CREATED).await;
    let last = events(&client, server.url(&format!("/jobs/{}/events", job["id"].as_str().unwrap()))).await.pop().unwrap();
    assert_eq!(last.1["state"], "done");

    let unlisted = problem(post(json!({ "scene": scene })).await.unwrap(), StatusCode::UNPROCESSABLE_ENTITY, "missing-assets").await;
    assert_eq!(unlisted["missing"], json!(["models/wedge.obj"]));
    let request = json!({ "scene": scene, "assets": { "models/wedge.obj": absent.as_str() } });
    let missing = problem(post(request).await.unwrap(), StatusCode::UNPROCESSABLE_ENTITY, "missing-assets").await;
    assert_eq!(missing["missing"], json!([absent.as_str()]));
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_are_listed_in_pages_and_called_off() {
    // Without a worker nothing ever happens to a job: what is seen below is all there is to see.
    let server = Server::start(0);
    let client = server.client();
    let mut ids = Vec::new();
    for name in ["a", "b", "c", "d", "e"] {
        let request = json!({ "scene": serde_json::from_str::<Value>(SCENE).unwrap(), "options": { "name": name } });
        let job = body(client.post(server.url("/jobs")).json(&request).send().await.unwrap(), StatusCode::CREATED).await;
        assert_eq!(job["state"], "queued");
        ids.insert(0, job["id"].as_str().unwrap().to_owned());
    }
    let mut seen = Vec::new();
    let mut next = Some(String::new());
    while let Some(cursor) = next {
        let page = body(client.get(server.url(&format!("/jobs?limit=2{cursor}"))).send().await.unwrap(), StatusCode::OK).await;
        let jobs = page["jobs"].as_array().unwrap();
        assert!(jobs.len() <= 2);
        seen.extend(jobs.iter().map(|job| job["id"].as_str().unwrap().to_owned()));
        next = page["next"].as_str().map(|next| format!("&cursor={next}"));
    }
    assert_eq!(seen, ids);

    let (listener, address) = (client.clone(), server.url(&format!("/jobs/{}/events", ids[0])));
    let listening = tokio::spawn(async move { events(&listener, address).await });
    let cancelled = client.post(server.url(&format!("/jobs/{}/cancel", ids[0]))).send().await.unwrap();
    assert_eq!(body(cancelled, StatusCode::OK).await["state"], "cancelled");
    assert_eq!(listening.await.unwrap().pop().unwrap().1["state"], "cancelled");
    let again = client.delete(server.url(&format!("/jobs/{}", ids[0]))).send().await.unwrap();
    assert_eq!(body(again, StatusCode::OK).await["state"], "cancelled");
    let image = client.get(server.url(&format!("/jobs/{}/frames/0/frame.exr", ids[1]))).send().await.unwrap();
    problem(image, StatusCode::CONFLICT, "conflict").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_wrong_is_named() {
    let server = Server::start(0);
    let client = server.client();
    let get = |path: &str| client.get(server.url(path)).send();
    let nobody = "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11";
    problem(get("/nothing").await.unwrap(), StatusCode::NOT_FOUND, "not-found").await;
    problem(get("/jobs/none").await.unwrap(), StatusCode::NOT_FOUND, "not-found").await;
    let absent = problem(get(&format!("/jobs/{nobody}")).await.unwrap(), StatusCode::NOT_FOUND, "not-found").await;
    assert!(absent["detail"].as_str().unwrap().contains(nobody));
    problem(get(&format!("/jobs/{nobody}/events")).await.unwrap(), StatusCode::NOT_FOUND, "not-found").await;
    problem(get(&format!("/jobs/{nobody}/frames/x")).await.unwrap(), StatusCode::BAD_REQUEST, "malformed").await;
    problem(get("/jobs?limit=0").await.unwrap(), StatusCode::BAD_REQUEST, "malformed").await;
    problem(get("/jobs?colour=red").await.unwrap(), StatusCode::BAD_REQUEST, "malformed").await;
    problem(client.put(server.url("/jobs")).send().await.unwrap(), StatusCode::METHOD_NOT_ALLOWED, "method").await;

    let post = || client.post(server.url("/jobs"));
    problem(post().body("hello").send().await.unwrap(), StatusCode::UNSUPPORTED_MEDIA_TYPE, "media-type").await;
    problem(post().json(&json!({ "scene": {}, "speed": 9 })).send().await.unwrap(), StatusCode::BAD_REQUEST, "malformed").await;
    let text = SCENE.replace("\"fov\": 40", "\"fov\": 200");
    let scene: Value = serde_json::from_str(&text).unwrap();
    let wrong = problem(post().json(&json!({ "scene": scene })).send().await.unwrap(), StatusCode::UNPROCESSABLE_ENTITY, "scene").await;
    assert_eq!((&wrong["path"], &wrong["found"]), (&json!("camera.perspective.fov"), &json!("200")));
    let form = Form::new().part("scene", file("room.json", text));
    let wrong = problem(post().multipart(form).send().await.unwrap(), StatusCode::UNPROCESSABLE_ENTITY, "scene").await;
    assert_eq!((&wrong["file"], &wrong["path"]), (&json!("room.json"), &json!("camera.perspective.fov")));

    let form = |field: &'static str, value: &'static str| Form::new().part("scene", file("a.json", SCENE)).text(field, value);
    for (field, value, place) in
        [("samples", "many", "samples"), ("speed", "9", "speed"), ("size", "12", "size"), ("technique", "magic", "technique")]
    {
        let wrong = problem(post().multipart(form(field, value)).send().await.unwrap(), StatusCode::BAD_REQUEST, "malformed").await;
        assert_eq!(wrong["path"], place, "{wrong}");
    }
    let wrong = post().multipart(Form::new().text("samples", "1")).send().await.unwrap();
    assert_eq!(problem(wrong, StatusCode::BAD_REQUEST, "malformed").await["path"], "scene");
    let clash = post().multipart(form("technique", "pt").text("reconstruction", "l2")).send().await.unwrap();
    problem(clash, StatusCode::UNPROCESSABLE_ENTITY, "plan").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_from_elsewhere_are_kept_out() {
    let server = Server::start(0);
    let client = server.client();
    let ask = |header: &'static str, value: &'static str| client.get(server.url("/health")).header(header, value).send();
    problem(ask("origin", "https://example.org").await.unwrap(), StatusCode::FORBIDDEN, "forbidden").await;
    problem(ask("host", "example.org").await.unwrap(), StatusCode::FORBIDDEN, "forbidden").await;
    let health = body(ask("origin", "http://127.0.0.1:3000").await.unwrap(), StatusCode::OK).await;
    assert_eq!(health["status"], "ok");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_commands_speak_to_the_server() {
    let server = Server::start(2);
    let (folder, scene) = common::folder();
    let image = folder.path().join("a.exr");
    let (scene, image) = (scene.to_str().unwrap(), image.to_str().unwrap());
    let workers = body(server.client().get(server.url("/workers")).send().await.unwrap(), StatusCode::OK).await;
    assert!(workers["workers"].as_array().unwrap().len() <= 2);

    let output = server.run(&["submit", scene, "--samples", "4", "--wait", "-o", image]);
    assert_code(&output, 0);
    let job = stdout(&output).trim().to_owned();
    assert!(std::fs::read(image).unwrap().starts_with(b"\x76\x2f\x31\x01"));
    let output = server.run(&["status", &job, "--json"]);
    assert_code(&output, 0);
    assert_eq!(common::last_json(&output)["state"], "done");
    let output = server.run(&["status"]);
    assert_code(&output, 0);
    assert!(stdout(&output).contains(&job) && stdout(&output).contains("scene"), "{}", stdout(&output));
    let output = server.run(&["watch", &job, "--json"]);
    assert_code(&output, 0);
    assert_eq!(common::last_json(&output)["state"]["state"], "done");
    let again = folder.path().join("b.exr");
    assert_code(&server.run(&["pull", &job, "-o", again.to_str().unwrap()]), 0);
    assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(image).unwrap());
    let output = server.run(&["pull", &job, "-o", image, "--frame", "3"]);
    assert_code(&output, 2);

    let output = server.run(&["submit", scene, "--samples", "1000000", "--size", "512x512", "--json"]);
    assert_code(&output, 0);
    let job = common::last_json(&output)["id"].as_str().unwrap().to_owned();
    assert_code(&server.run(&["cancel", &job]), 0);
    assert_code(&server.run(&["watch", &job]), 3);
    assert_code(&server.run(&["status", "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11"]), 2);
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_is_told_to_stop_stops() {
    let mut server = Server::start(1);
    // A listener that never goes away by itself must not hold it up.
    let request = json!({ "scene": serde_json::from_str::<Value>(SCENE).unwrap(), "options": { "samples": 1_000_000, "size": "512x512" } });
    let client = server.client();
    let job = body(client.post(server.url("/jobs")).json(&request).send().await.unwrap(), StatusCode::CREATED).await;
    let id = job["id"].as_str().unwrap().to_owned();
    let mut stream = client.get(server.url(&format!("/jobs/{id}/events"))).send().await.unwrap().bytes_stream();
    stream.next().await.unwrap().unwrap();
    common::signal(&server.child, "TERM");
    let status = common::wait(&mut server.child, Duration::from_secs(30));
    assert_eq!(status.code(), Some(0));

    // What was acknowledged is there again, and goes on.
    server.crash_and_restart(0);
    let job = body(client.get(server.url(&format!("/jobs/{id}"))).send().await.unwrap(), StatusCode::OK).await;
    assert!(["queued", "running"].contains(&job["state"].as_str().unwrap()), "{}", job["state"]);
}

/// The value of a metric, as it is written.
fn value<'a>(text: &'a str, name: &str) -> &'a str {
    text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')).unwrap_or_else(|| panic!("{name} is not in {text}"))
}

#[tokio::test(flavor = "multi_thread")]
async fn machines_read_metrics_and_readiness() {
    let server = Server::start(1);
    let client = server.client();
    let request = json!({ "scene": serde_json::from_str::<Value>(SCENE).unwrap(), "options": { "samples": 2, "tile": 8 } });
    let job = body(client.post(server.url("/jobs")).json(&request).send().await.unwrap(), StatusCode::CREATED).await;
    let id = job["id"].as_str().unwrap();
    let last = events(&client, server.url(&format!("/jobs/{id}/events"))).await.pop().unwrap();
    assert_eq!(last.1["state"], "done");
    let nothing = client.get(server.url(&format!("/jobs/{id}/nothing"))).send().await.unwrap();
    assert_eq!(nothing.status(), StatusCode::NOT_FOUND);
    let answer = client.get(format!("{}/metrics", server.http)).send().await.unwrap();
    assert!(answer.headers()["content-type"].to_str().unwrap().starts_with("application/openmetrics-text"));
    let text = answer.text().await.unwrap();
    assert_eq!(value(&text, "gradfarm_jobs{state=\"done\"}"), "1");
    assert_eq!(value(&text, "gradfarm_jobs_submitted_total"), "1");
    assert_eq!(value(&text, "gradfarm_completions_total"), job["progress"]["units"]["total"].to_string());
    assert_eq!(value(&text, "gradfarm_http_requests_total{method=\"POST\",route=\"/api/v1/jobs\",status=\"201\"}"), "1");
    assert_eq!(value(&text, "gradfarm_http_requests_total{method=\"GET\",route=\"\",status=\"404\"}"), "1");
    assert_eq!(value(&text, "gradfarm_worker_slots{pool=\"\"}"), "1");
    assert!(!text.contains(id), "no label holds what somebody asked for");
    assert_ne!(value(&text, "gradfarm_blob_written_bytes_total"), "0");
    let open = Server::start_with(0, &["--metrics-open"]);
    let stranger = common::client_with(None);
    for (from, path, status) in [
        (&server, "/metrics", StatusCode::UNAUTHORIZED),
        (&open, "/metrics", StatusCode::OK),
        (&open, "/api/v1/metrics", StatusCode::OK),
        (&open, "/api/v1/jobs", StatusCode::UNAUTHORIZED),
        (&server, "/api/v1/ready", StatusCode::OK),
    ] {
        assert_eq!(stranger.get(format!("{}{path}", from.http)).send().await.unwrap().status(), status, "{path}");
    }
    let workers = body(client.get(server.url("/workers")).send().await.unwrap(), StatusCode::OK).await;
    let worker = workers["workers"][0]["id"].as_str().unwrap().to_owned();
    let drained = server.run(&["worker", "drain", &worker]);
    assert_code(&drained, 0);
    assert!(stdout(&drained).contains("finishes the 0 units"), "{}", stdout(&drained));
    let workers = body(client.get(server.url("/workers")).send().await.unwrap(), StatusCode::OK).await;
    assert_eq!(workers["workers"][0]["draining"], true);
    assert_code(&server.run(&["worker", "resume", &worker]), 0);
    assert_code(&server.run(&["worker", "drain", "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11"]), 2);
}
