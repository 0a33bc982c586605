//! What the program does for people at a terminal: pictures, completions, manual pages, and finding what is wrong.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{Server, assert_code, folder, gradfarm, last_json, run, stderr, stdout};

#[test]
fn an_image_is_shown_in_characters() {
    let (folder, scene) = folder();
    let image = folder.path().join("a.exr");
    let output = run(&["render", scene.to_str().unwrap(), "-o", image.to_str().unwrap(), "--samples", "4"]);
    assert_code(&output, 0);
    for file in ["a.exr", "a.png"] {
        let file = folder.path().join(file);
        let output = run(&["view", file.to_str().unwrap()]);
        assert_code(&output, 0);
        let text = stdout(&output);
        // The scene has 24 × 16 pixels, and a character has two of them above each other.
        assert_eq!(text.lines().count(), 8, "{text}");
        assert!(text.lines().all(|line| line.chars().count() == 24), "{text}");
        let weights: std::collections::BTreeSet<char> = text.chars().collect();
        assert!(weights.len() > 5, "light and dark: {text}");
        let colour = run(&["view", file.to_str().unwrap(), "--width", "12", "--colour", "true"]);
        assert_eq!(stdout(&colour).matches('▀').count(), 12 * 4);
    }
    let output = run(&["view", image.to_str().unwrap(), "--layer", "no-such-layer"]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("there are [") && stderr(&output).contains("primal"), "{}", stderr(&output));
    let output = run(&["view", scene.to_str().unwrap()]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("scene.json"), "{}", stderr(&output));
}

#[test]
fn shells_and_manuals_learn_every_command() {
    for shell in ["bash", "zsh", "fish"] {
        let output = run(&["completions", shell]);
        assert_code(&output, 0);
        for said in ["render", "doctor", "reconstruction"] {
            assert!(stdout(&output).contains(said), "{shell}: {said}");
        }
    }
    let (folder, _) = folder();
    let pages = folder.path().join("share/man1");
    assert_code(&run(&["man", pages.to_str().unwrap()]), 0);
    for page in ["gradfarm.1", "gradfarm-render.1", "gradfarm-study.1"] {
        assert!(std::fs::read_to_string(pages.join(page)).unwrap().contains(".TH"), "{page}");
    }
}

#[test]
fn the_doctor_finds_what_is_wrong() {
    let server = Server::start(0);
    let (folder, scene) = folder();
    let verdict = |data: &std::path::Path, what: &str| {
        let token = server.data.path().join("token");
        let output = server.run(&["doctor", "--json", "--data", data.to_str().unwrap(), "--token-file", token.to_str().unwrap()]);
        let findings = last_json(&output);
        let found = findings.as_array().unwrap().iter().find(|finding| finding["what"] == what).cloned();
        (output.status.code(), found.unwrap_or_else(|| panic!("nothing on {what}: {findings}"))["verdict"].as_str().unwrap().to_owned())
    };
    assert_eq!(verdict(&folder.path().join("gone"), "state").1, "note");
    assert_eq!(verdict(folder.path(), "workers").1, "note", "no job waits");
    assert_eq!(verdict(folder.path(), "network").1, "well");
    assert_code(&server.run(&["submit", scene.to_str().unwrap()]), 0);
    assert_eq!(verdict(folder.path(), "workers"), (Some(1), "wrong".into()), "a job waits for workers that are not there");
    let lines = gradfarm().args(["doctor", "--server", "http://127.0.0.1:9"]).output().unwrap();
    assert!(stdout(&lines).contains("gradfarm serve"), "{}", stdout(&lines));
}
