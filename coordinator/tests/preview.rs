//! What people watch over HTTP: pictures of frames while they are made, waiting for jobs, the list by state and name, the page's own files.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::time::Duration;

use common::{SCENE, Server};
use reqwest::multipart::{Form, Part};
use reqwest::{Client, StatusCode};
use serde_json::Value;

async fn submit(client: &Client, server: &Server, options: &[(&'static str, &'static str)]) -> String {
    let form = Form::new().part("scene", Part::bytes(SCENE.as_bytes()).file_name("lamp.json"));
    let form = options.iter().fold(form, |form, (name, value)| form.text(*name, *value));
    let response = client.post(server.url("/jobs")).multipart(form).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::CREATED);
    response.json::<Value>().await.unwrap()["id"].as_str().unwrap().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_are_seen_while_they_are_made_and_after() {
    let server = Server::start(1);
    let client = server.client();
    let job = submit(&client, &server, &[("samples", "200000"), ("technique", "gpt"), ("tile", "16"), ("size", "64x48")]).await;
    let preview = |job: &str, rest: &str| server.url(&format!("/jobs/{job}/frames/0/preview.{rest}"));
    // Nothing can be seen before something was delivered; then it can, at the size that was asked for.
    let picture = loop {
        let response = client.get(preview(&job, "pfm?view=primal&most=800")).send().await.unwrap();
        if response.status() == StatusCode::OK {
            assert_eq!(response.headers()["content-type"], "image/x-portable-floatmap");
            break response.bytes().await.unwrap();
        }
        assert_eq!(response.status(), StatusCode::CONFLICT);
        assert!(response.json::<Value>().await.unwrap()["detail"].as_str().unwrap().contains("primal"));
        tokio::time::sleep(Duration::from_millis(20)).await;
    };
    assert!(picture.starts_with(b"PF\n32 24\n-1.0\n"));
    let header = b"PF\n32 24\n-1.0\n".len();
    let values: Vec<f32> = picture[header..].chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    assert_eq!(values.len(), 3 * 32 * 24);
    assert!(values.iter().all(|value| value.is_finite()) && values.iter().any(|value| *value > 0.0));
    // The error of an unfinished frame is not there, and what is wrong with a question is said.
    let status = async |address: String| client.get(address).send().await.unwrap().status();
    assert_eq!(status(preview(&job, "png?view=error")).await, StatusCode::CONFLICT);
    for wrong in ["png?view=magic", "png?exposure=1000", "png?most=0", "pfm?size=3"] {
        assert_eq!(status(preview(&job, wrong)).await, StatusCode::BAD_REQUEST, "{wrong}");
    }
    assert_eq!(status(server.url(&format!("/jobs/{job}/frames/7/preview.png"))).await, StatusCode::NOT_FOUND);
    // Tiles tell who has them.
    let worker = client.get(server.url("/workers")).send().await.unwrap().json::<Value>().await.unwrap()["workers"][0]["id"].clone();
    loop {
        let tiles = client.get(server.url(&format!("/jobs/{job}/frames/0/tiles"))).send().await.unwrap().json::<Value>().await.unwrap();
        if tiles["tiles"].as_array().unwrap().iter().any(|tile| tile["workers"][0] == worker) {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    client.post(server.url(&format!("/jobs/{job}/cancel"))).send().await.unwrap();

    let job = submit(&client, &server, &[("samples", "8"), ("technique", "gpt"), ("name", "Quick one")]).await;
    let over = client.get(server.url(&format!("/jobs/{job}?wait=100s"))).send().await.unwrap().json::<Value>().await.unwrap();
    assert_eq!(over["state"], "done");
    for view in ["primal", "dx", "dy", "reconstructed", "error"] {
        let address = preview(&job, &format!("png?view={view}"));
        let response = client.get(&address).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::OK, "{view}");
        let tag = response.headers()["etag"].clone();
        assert!(response.bytes().await.unwrap().starts_with(b"\x89PNG"));
        let again = client.get(&address).header("if-none-match", tag).send().await.unwrap();
        assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
    }
    assert_eq!(status(server.url(&format!("/jobs/{job}?wait=forever"))).await, StatusCode::BAD_REQUEST);

    let found = async |query: &str| -> Vec<Value> {
        let page = client.get(server.url(&format!("/jobs?{query}"))).send().await.unwrap().json::<Value>().await.unwrap();
        page["jobs"].as_array().unwrap().iter().map(|job| job["name"].clone()).collect()
    };
    assert_eq!(found("").await, ["Quick one", "lamp"]);
    assert_eq!(found("search=quick").await, ["Quick one"]);
    assert_eq!(found("state=cancelled").await, ["lamp"]);
    assert!(found("state=open").await.is_empty());
    assert_eq!(status(server.url("/jobs?state=odd")).await, StatusCode::BAD_REQUEST);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_is_its_own_and_the_farm_tells_its_news() {
    let server = Server::start(1);
    let client = server.client();
    // The page's files are for anybody; they hold no secret.
    let stranger = common::client_with(None);
    let page = stranger.get(&server.http).send().await.unwrap();
    assert!(page.headers()["content-security-policy"].to_str().unwrap().starts_with("default-src 'none'"));
    assert!(page.headers()["content-type"].to_str().unwrap().starts_with("text/html"));
    let script = stranger.get(format!("{}/page/app.js", server.http)).send().await.unwrap();
    let tag = script.headers()["etag"].clone();
    let again = client.get(format!("{}/page/app.js", server.http)).header("if-none-match", tag).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
    assert_eq!(client.get(format!("{}/page/other.js", server.http)).send().await.unwrap().status(), StatusCode::NOT_FOUND);

    assert_eq!(stranger.get(server.url("/openapi.json")).send().await.unwrap().status(), StatusCode::UNAUTHORIZED);
    let described = client.get(server.url("/openapi.json")).send().await.unwrap().json::<Value>().await.unwrap();
    assert_eq!(described["openapi"], "3.1.0");
    assert_eq!(described["components"]["schemas"]["Job"]["properties"]["tile"]["type"], "integer");

    // A stream that began tells of a job that comes after it.
    let mut events = client.get(server.url("/events")).send().await.unwrap();
    let mut text = String::from_utf8(events.chunk().await.unwrap().unwrap().to_vec()).unwrap();
    assert!(text.contains("event: workers"), "{text}");
    let job = submit(&client, &server, &[("samples", "2")]).await;
    while !(text.contains("event: jobs") && text.contains(&job)) {
        text += std::str::from_utf8(&events.chunk().await.unwrap().unwrap()).unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_form_may_bring_a_scene_of_another_format() {
    let server = Server::start(1);
    let client = server.client();
    let gltf = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0 }, { "camera": 0, "translation": [0, 0, 3] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "buffers": [{ "uri": "parts/corners.bin", "byteLength": 36 }], "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }] }"#;
    let corners: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let scene = || Part::bytes(gltf.as_bytes()).file_name("corner.gltf");
    let options = |form: Form| form.text("samples", "2").text("size", "16x12");
    let form = options(Form::new().part("scene", scene()).part("asset", Part::bytes(corners).file_name("parts/corners.bin")));
    let response = client.post(server.url("/jobs")).multipart(form).send().await.unwrap();
    let (status, job) = (response.status(), response.json::<Value>().await.unwrap());
    assert_eq!(status, StatusCode::CREATED, "{job}");
    assert_eq!(job["name"], "corner");
    let over = client.get(server.url(&format!("/jobs/{}?wait=100", job["id"].as_str().unwrap()))).send().await.unwrap();
    assert_eq!(over.json::<Value>().await.unwrap()["state"], "done");
    // Nothing but what came along is read.
    let response = client.post(server.url("/jobs")).multipart(options(Form::new().part("scene", scene()))).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::UNPROCESSABLE_ENTITY);
    assert!(response.json::<Value>().await.unwrap()["detail"].as_str().unwrap().contains("parts/corners.bin"));
}
