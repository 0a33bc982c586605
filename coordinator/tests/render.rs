//! `gradfarm render` and `gradfarm compare`: from a scene to an image, and what they say about it.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::path::Path;
use std::process::Output;

use common::{assert_code, folder, last_json, run, stderr, stdout};

fn render(scene: &Path, image: &Path, more: &[&str]) -> Output {
    run(&[&["render", scene.to_str().unwrap(), "-o", image.to_str().unwrap(), "--json"], more].concat())
}

#[test]
fn an_image_appears_with_what_there_is_to_say_about_it() {
    let (folder, scene) = folder();
    let image = folder.path().join("a.exr");
    let output = render(&scene, &image, &["--technique", "gpt", "--reconstruction", "l2", "--samples", "20", "--seed", "3"]);
    assert_code(&output, 0);
    let report = last_json(&output);
    assert_eq!((&report["technique"], &report["reconstruction"]), (&"gpt".into(), &"l2".into()));
    assert_eq!((&report["width"], &report["height"], &report["samples"]), (&24.into(), &16.into(), &20.into()));
    assert_eq!(report["statistics"]["samples"], 24 * 16 * 20);
    assert_eq!(report["output"], image.to_str().unwrap());
    assert!(report["samples_per_second"].as_f64().unwrap() > 0.0);
    assert!(report["estimated_relmse"].as_f64().unwrap() > 0.0);
    let mut sum = 0.0;
    for phase in ["load", "build", "render", "stitch", "reconstruct", "write"] {
        let seconds = report["seconds"][phase].as_f64().unwrap();
        assert!(seconds >= 0.0, "{phase}: {seconds}");
        sum += seconds;
    }
    let total = report["seconds"]["total"].as_f64().unwrap();
    assert!(sum <= total * 1.05, "phases take {sum} s of {total} s");

    let exr = std::fs::read(&image).unwrap();
    assert_eq!(exr[..4], [0x76, 0x2f, 0x31, 0x01], "not an EXR");
    let png = std::fs::read(folder.path().join("a.png")).unwrap();
    assert_eq!(png[..8], *b"\x89PNG\r\n\x1a\n", "not a PNG");
    // The size stands in the first chunk, big-endian.
    assert_eq!((png[16..20].to_vec(), png[20..24].to_vec()), (24u32.to_be_bytes().to_vec(), 16u32.to_be_bytes().to_vec()));
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names.len(), 3, "something was left behind: {names:?}");
}

#[test]
fn the_farm_has_no_influence_on_the_image() {
    let (folder, scene) = folder();
    let (first, second) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
    let what = ["--technique", "gpt", "--reconstruction", "l1", "--samples", "9", "--size", "21x13"];
    assert_code(&render(&scene, &first, &[&what[..], &["--workers", "1", "--threads", "1", "--tile", "64"]].concat()), 0);
    assert_code(&render(&scene, &second, &[&what[..], &["--workers", "3", "--threads", "2", "--tile", "5"]].concat()), 0);
    let compare = |a: &Path, b: &Path, more: &[&str]| run(&[&["compare", a.to_str().unwrap(), b.to_str().unwrap()], more].concat());
    let output = compare(&first, &second, &["--json"]);
    assert_code(&output, 0);
    let measures = last_json(&output);
    for measure in ["relmse", "rmse", "mean_error", "flip"] {
        assert_eq!(measures[measure], 0.0, "{measure}");
    }
    // Another seed is another image, and the measures see it.
    let third = folder.path().join("c.exr");
    assert_code(&render(&scene, &third, &[&what[..], &["--seed", "1"]].concat()), 0);
    let measures = last_json(&compare(&third, &first, &["--json"]));
    for measure in ["relmse", "rmse", "flip"] {
        assert!(measures[measure].as_f64().unwrap() > 0.0, "{measure}");
    }
    let table = compare(&third, &first, &[]);
    assert_code(&table, 0);
    assert!(stdout(&table).contains("relMSE") && stdout(&table).contains("FLIP"));

    let small = folder.path().join("small.exr");
    assert_code(&render(&scene, &small, &["--samples", "1", "--size", "4x4"]), 0);
    let output = compare(&small, &first, &[]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("4 × 4") && stderr(&output).contains("21 × 13"), "{}", stderr(&output));
    let output = compare(&scene, &first, &[]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("scene.json"), "{}", stderr(&output));
}

#[test]
fn a_mesh_beside_the_scene_reaches_the_workers() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, mesh) = common::scene_with_mesh();
    let (path, image) = (folder.path().join("scene.json"), folder.path().join("a.exr"));
    std::fs::write(&path, scene).unwrap();
    let output = render(&path, &image, &["--samples", "1"]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("models/wedge.obj"), "{}", stderr(&output));
    std::fs::create_dir(folder.path().join("models")).unwrap();
    std::fs::write(folder.path().join("models/wedge.obj"), mesh).unwrap();
    assert_code(&render(&path, &image, &["--samples", "1"]), 0);
    assert!(image.exists());
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_behind() {
    use std::time::Duration;
    let (folder, scene) = folder();
    let temporary = tempfile::tempdir().unwrap();
    let mut child = common::gradfarm()
        .args(["render", scene.to_str().unwrap(), "-o", folder.path().join("a.exr").to_str().unwrap()])
        .args(["--samples", "1000000", "--size", "512x512"])
        .env("TMPDIR", temporary.path())
        .spawn()
        .unwrap();
    // The state folder appears when the farm starts.
    let started = std::time::Instant::now();
    while std::fs::read_dir(temporary.path()).unwrap().next().is_none() {
        assert!(started.elapsed() < Duration::from_secs(30), "the farm did not start");
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(500));
    common::signal(&child, "INT");
    let status = common::wait(&mut child, Duration::from_secs(30));
    assert_eq!(status.code(), Some(130));
    assert_eq!(std::fs::read_dir(temporary.path()).unwrap().count(), 0, "the state folder was left behind");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a part of an image was left behind");
}
