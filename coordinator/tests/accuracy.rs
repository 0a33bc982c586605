//! What accuracy costs, from outside: on the command line, over HTTP, as numbers and as a plot.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{SCENE, Server, assert_code, folder, last_json, moving_scene, run, stderr, stdout};
use serde_json::{Value, json};

#[test]
fn render_stops_at_its_error_and_the_same_samples_are_the_same_image() {
    let (folder, scene) = folder();
    let at = |name: &str| folder.path().join(name);
    let render = |image: &str, more: &[&str]| {
        run(&[&["render", scene.to_str().unwrap(), "-o", at(image).to_str().unwrap(), "--technique", "gpt"], more].concat())
    };
    let (plot, numbers) = (at("curve.svg"), at("curve.json"));
    let output = render("a.exr", &["--error", "0.05", "--json", "--accuracy", plot.to_str().unwrap()]);
    assert_code(&output, 0);
    let report = last_json(&output);
    let accuracy = &report["accuracy"];
    assert_eq!((&accuracy["reached"], &accuracy["stopped"]), (&true.into(), &"error".into()), "{accuracy}");
    let points = accuracy["points"].as_array().unwrap();
    let last = points.last().unwrap();
    assert_eq!((&report["samples"], &report["estimated_relmse"]), (&last["samples"], &last["relmse"]));
    assert!(last["relmse"].as_f64().unwrap() <= 0.05 && last["high"].as_f64() >= last["relmse"].as_f64());
    let samples = report["samples"].as_u64().unwrap();
    assert_eq!(report["statistics"]["samples"], 24 * 16 * samples);
    let svg = std::fs::read_to_string(&plot).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("target 0.05") && svg.contains("scene, frame 0"), "{svg}");

    // The same samples, asked for as a number; with the curve as numbers on the way.
    let output = render("b.exr", &["--samples", &samples.to_string(), "--accuracy", numbers.to_str().unwrap(), "--workers", "1"]);
    assert_code(&output, 0);
    assert!(stdout(&output).contains(&format!("{samples} samples each")), "{}", stdout(&output));
    let again: Value = serde_json::from_slice(&std::fs::read(&numbers).unwrap()).unwrap();
    let last_again = again["points"].as_array().unwrap().last().unwrap();
    for key in ["samples", "relmse", "low", "high"] {
        assert_eq!(last_again[key], last[key], "{key}");
    }
    assert_eq!((&again["target"], &again["reached"]), (&Value::Null, &Value::Null));
    let compared = run(&["compare", at("a.exr").to_str().unwrap(), at("b.exr").to_str().unwrap(), "--json"]);
    assert_eq!(last_json(&compared)["rmse"], 0.0);
}

#[test]
fn a_render_that_falls_short_says_how_far_it_got() {
    let (folder, scene) = folder();
    let render =
        |more: &[&str]| run(&[&["render", scene.to_str().unwrap(), "-o", folder.path().join("a.exr").to_str().unwrap()], more].concat());
    let output = render(&["--error", "1e-9", "--samples", "40"]);
    assert_code(&output, 0);
    let told = stdout(&output);
    for part in ["40 samples each", "NOT reached: all samples were used", "with 40 samples per pixel", "the next halving costs"] {
        assert!(told.contains(part), "{part} is missing from {told}");
    }
    let output = render(&["--seconds", "1", "--json"]);
    assert_code(&output, 0);
    let report = last_json(&output);
    assert_eq!(report["accuracy"]["stopped"], "seconds");
    assert!(report["samples"].as_u64().unwrap() >= 16);
    // In rounds, which double: beyond the first 64 samples.
    let output = render(&["--error", "0.005", "--rounds", "8", "--json", "--technique", "gpt"]);
    assert_code(&output, 0);
    let report = last_json(&output);
    assert_eq!((&report["accuracy"]["stopped"], report["samples"].as_u64().unwrap() > 64), (&"error".into(), true), "{report}");
    // Without anything asked there is still one point, and what it says.
    let output = render(&["--samples", "4", "--json"]);
    assert_eq!(last_json(&output)["accuracy"]["points"].as_array().unwrap().len(), 1);

    for (wrong, expected) in [(&["--error", "0"][..], "above 0"), (&["--accuracy", "curve.png"], "end in .svg")] {
        let output = render(wrong);
        assert_code(&output, 2);
        assert!(stderr(&output).contains(expected), "{wrong:?}: {}", stderr(&output));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_tells_its_curve_over_http() {
    let server = Server::start(2);
    let client = server.client();
    let scene: Value = serde_json::from_str(&moving_scene()).unwrap();
    let options = json!({ "error": 0.05, "seconds": 600, "technique": "gpt", "frame_count": 2, "first_frame": 4 });
    let job: Value =
        client.post(server.url("/jobs")).json(&json!({ "scene": scene, "options": options })).send().await.unwrap().json().await.unwrap();
    assert_eq!((&job["plan"]["stop_error"], &job["plan"]["stop_seconds"]), (&json!(0.05), &json!(600.0)), "{job}");
    let id = job["id"].as_str().unwrap();
    let events = client.get(server.url(&format!("/jobs/{id}/events"))).send().await.unwrap().text().await.unwrap();
    assert!(events.contains("event: accuracy") && events.contains("\"target\":0.05"), "{events}");
    for frame in [4, 5] {
        let address = format!("/jobs/{id}/frames/{frame}");
        let get = |more: &str| client.get(server.url(&format!("{address}{more}"))).send();
        let view: Value = get("").await.unwrap().json().await.unwrap();
        let accuracy: Value = get("/accuracy").await.unwrap().json().await.unwrap();
        let last = accuracy["points"].as_array().unwrap().last().unwrap();
        assert_eq!((&view["stopped"], &view["samples_per_pixel"]), (&json!("error"), &last["samples"]), "{view}");
        assert_eq!(view["error"], json!({ "relmse": last["relmse"], "low": last["low"], "high": last["high"] }));
        assert_eq!(view["progress"]["samples"]["done"], view["progress"]["samples"]["total"]);
        assert!(accuracy["fit"]["slope"].as_f64().unwrap() < 0.0 && accuracy["cost"]["seconds_per_sample"].as_f64().unwrap() >= 0.0);
        assert!(!accuracy["prices"].as_array().unwrap().is_empty(), "{accuracy}");
        let svg = get("/accuracy.svg").await.unwrap();
        assert_eq!(svg.headers()["content-type"], "image/svg+xml");
        assert!(svg.text().await.unwrap().contains(&format!("frame {frame}: what accuracy costs")));
    }
    assert_eq!(client.get(server.url(&format!("/jobs/{id}/frames/6/accuracy"))).send().await.unwrap().status(), 404);

    let told = server.run(&["accuracy", id, "--frame", "5"]);
    assert_code(&told, 0);
    assert!(stdout(&told).contains("the error asked for, 0.05, is reached"), "{}", stdout(&told));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("curve.svg");
    assert_code(&server.run(&["accuracy", id, "--frame", "4", "-o", file.to_str().unwrap()]), 0);
    assert!(std::fs::read_to_string(file).unwrap().contains("target 0.05"));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_not_measured_is_not_plotted() {
    let server = Server::start(0);
    let client = server.client();
    let scene: Value = serde_json::from_str(SCENE).unwrap();
    let post = |options: Value| client.post(server.url("/jobs")).json(&json!({ "scene": scene, "options": options })).send();
    let job: Value = post(json!({ "error": 0.01 })).await.unwrap().json().await.unwrap();
    let id = job["id"].as_str().unwrap();
    let accuracy: Value = client.get(server.url(&format!("/jobs/{id}/frames/0/accuracy"))).send().await.unwrap().json().await.unwrap();
    assert_eq!((&accuracy["points"], &accuracy["expected_samples"], &accuracy["most_samples"]), (&json!([]), &json!(32), &json!(65536)));
    assert_eq!(client.get(server.url(&format!("/jobs/{id}/frames/0/accuracy.svg"))).send().await.unwrap().status(), 409);
    let wrong = [(json!({ "error": -1 }), 400), (json!({ "seconds": 0 }), 400), (json!({ "curve": 3 }), 400)];
    for (wrong, status) in wrong.into_iter().chain([(json!({ "error": 0.1, "technique": "reuse", "rounds": 3 }), 422)]) {
        assert_eq!(post(wrong.clone()).await.unwrap().status(), status, "{wrong}");
    }
}
