//! The program as a person meets it: arguments, exit codes, what it prints and what it writes.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_code, folder, last_json, run, stderr, stdout};

#[test]
fn nonsense_is_bad_input() {
    for (arguments, said) in [
        (vec!["frobnicate"], "unrecognized subcommand"),
        (vec!["render"], "required arguments"),
        (vec!["render", "a.json", "-o", "a.exr", "--technique", "magic"], "possible values: auto, pt, gpt"),
        (vec!["render", "a.json", "-o", "a.exr", "--size", "12"], "such as 640x480"),
        (vec!["render", "a.json", "-o", "a.exr", "--workers", "0"], "1.."),
        (vec!["render", "a.json", "-o", "a.jpg"], "should end in .exr"),
        (vec!["render", "a.json"], "nothing would be written"),
        (vec!["render", "a.json", "-o", "a%d%d.exr"], "expected exactly one %d"),
        (vec!["serve", "--listen", "0.0.0.0:7700"], "--tls"),
        (vec!["status", "--server", "ftp://127.0.0.1"], "http://"),
    ] {
        let output = run(&arguments);
        assert_code(&output, 2);
        assert!(stderr(&output).contains(said), "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn help_tells_the_exit_codes() {
    let output = run(&["--help"]);
    assert_code(&output, 0);
    for said in ["render", "Exit codes", "130"] {
        assert!(stdout(&output).contains(said), "{said}");
    }
}

#[test]
fn an_output_that_cannot_be_written_is_found_before_anything_else() {
    let (folder, _) = folder();
    let nowhere = folder.path().join("nowhere/a.exr");
    // The scene does not exist either: the output must be complained about first, so it was looked at first.
    let output = run(&["render", "no-such-scene.json", "-o", nowhere.to_str().unwrap()]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("nowhere does not exist"), "{}", stderr(&output));
}

#[test]
fn a_wrong_scene_is_bad_input_and_named() {
    let (folder, scene) = folder();
    std::fs::write(&scene, common::SCENE.replace("\"fov\": 40", "\"fov\": 200")).unwrap();
    let image = folder.path().join("a.exr");
    for arguments in [vec!["plan", scene.to_str().unwrap()], vec!["render", scene.to_str().unwrap(), "-o", image.to_str().unwrap()]] {
        let output = run(&arguments);
        assert_code(&output, 2);
        for said in ["scene.json", "camera.perspective.fov", "found 200", "(0, 180)"] {
            assert!(stderr(&output).contains(said), "{said}: {}", stderr(&output));
        }
    }
    assert!(!image.exists());
    let output = run(&["plan", folder.path().join("absent.json").to_str().unwrap()]);
    assert_code(&output, 2);
}

#[test]
fn what_cannot_be_planned_is_bad_input() {
    let (folder, scene) = folder();
    let image = folder.path().join("a.exr");
    let (scene, image) = (scene.to_str().unwrap(), image.to_str().unwrap());
    for arguments in [vec!["plan", scene], vec!["render", scene, "-o", image]] {
        let output = run(&[&arguments[..], &["--technique", "pt", "--reconstruction", "l2"]].concat());
        assert_code(&output, 2);
        assert!(stderr(&output).contains("gradients"), "{}", stderr(&output));
    }
}

#[test]
fn the_schema_is_json_and_knows_the_scene() {
    let output = run(&["schema"]);
    assert_code(&output, 0);
    let schema: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    for part in ["version", "camera", "film", "materials", "shapes"] {
        assert!(schema["properties"].get(part).is_some(), "{part}");
    }
}

#[test]
fn the_plan_says_what_and_why() {
    let (_folder, scene) = folder();
    let scene = scene.to_str().unwrap();
    let output = run(&["plan", scene, "--technique", "gpt", "--samples", "5", "--seed", "7", "--json"]);
    assert_code(&output, 0);
    let plan = last_json(&output);
    assert_eq!((&plan["technique"], &plan["samples"], &plan["seed"]), (&"gpt".into(), &5.into(), &7.into()));
    assert_eq!((&plan["width"], &plan["height"], &plan["max_depth"]), (&24.into(), &16.into(), &4.into()));
    for effect in ["area_lights", "environment_light"] {
        assert!(plan["effects"][effect].as_array().is_some_and(|because| !because.is_empty()), "{effect}: {plan}");
    }
    let reasons = plan["reasons"].as_array().unwrap();
    assert!(!reasons.is_empty());
    let told = run(&["plan", scene, "--technique", "gpt", "--samples", "5", "--seed", "7"]);
    assert_code(&told, 0);
    for reason in reasons {
        assert!(stdout(&told).contains(reason.as_str().unwrap()), "{reason}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    use std::process::Stdio;
    let mut child = common::gradfarm().arg("schema").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_code(&output, 0);
    assert!(output.stderr.is_empty(), "{}", stderr(&output));
}

#[test]
fn nobody_at_the_other_end_has_its_own_code() {
    // A port that was free a moment ago.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let server = format!("http://127.0.0.1:{port}");
    for arguments in [vec!["status"], vec!["cancel", "01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11"]] {
        let output = run(&[&arguments[..], &["--server", &server]].concat());
        assert_code(&output, 4);
        assert!(stderr(&output).contains(&server) && stderr(&output).contains("gradfarm serve"), "{}", stderr(&output));
    }
}

#[test]
fn the_example_settings_exist() {
    let example = include_str!("../../deploy/coordinator.env");
    let help = run(&["serve", "--help"]);
    assert_code(&help, 0);
    let help = stdout(&help).split_whitespace().collect::<Vec<_>>().join(" ");
    let mut keys = 0;
    for line in example.lines() {
        // Keys that are commented out are keys all the same.
        if let Some((key, _)) = line.trim_start_matches('#').split_once('=').filter(|(key, _)| key.starts_with("GRADFARM_")) {
            assert!(help.contains(key), "{key} is no setting of `gradfarm serve`");
            keys += 1;
        }
    }
    assert_eq!(keys, help.matches("[env: GRADFARM_").count(), "a setting is missing in deploy/coordinator.env");
}

#[test]
fn settings_from_a_file_are_checked_with_their_lines() {
    let (folder, _) = folder();
    let file = folder.path().join("farm.toml");
    let example = run(&["serve", "--print-config"]);
    assert_code(&example, 0);
    let serve = |text: &str| {
        std::fs::write(&file, text).unwrap();
        // A port that cannot be had, so that it never starts.
        run(&["serve", "--config", file.to_str().unwrap(), "--listen", "203.0.113.1:1"])
    };
    // Everything in the example is good: what is wrong is that there is no TLS.
    let output = serve(stdout(&example));
    assert_code(&output, 2);
    assert!(stderr(&output).contains("add --tls"), "{}", stderr(&output));
    for (text, said) in [
        ("listen = \"127.0.0.1:0\"\ntls_cert = \"a\"", "line 2: there is no setting \"tls_cert\"; did you mean \"tls-cert\"?"),
        ("\nblob-grace = \"1s\"", "line 2: invalid value '1s' for '--blob-grace"),
        ("tls-cert = \"a\"", "--tls-key"),
    ] {
        let output = serve(text);
        assert_code(&output, 2);
        assert!(stderr(&output).contains(said), "{text}: {}", stderr(&output));
    }
}

/// A ball before a pbrt camera, with a mesh large enough to become a file of its own.
fn pbrt() -> String {
    let points: String = (0..40).map(|k| format!("{} {} {} ", k % 7, k % 5, k)).collect();
    format!(
        "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n\
         Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [0 1 2 3 4 5]\nShape \"curve\"\n"
    )
}

#[test]
fn a_scene_of_another_renderer_becomes_a_native_one_beside_its_files() {
    let (folder, _) = folder();
    let (scene, json) = (folder.path().join("ball.pbrt"), folder.path().join("out/ball.json"));
    std::fs::create_dir(folder.path().join("out")).unwrap();
    std::fs::write(&scene, pbrt()).unwrap();
    let arguments = ["import", scene.to_str().unwrap(), "-o", json.to_str().unwrap()];
    let output = run(&arguments);
    assert_code(&output, 0);
    assert!(stderr(&output).contains("warning: line 6, Shape \"curve\": left out"), "{}", stderr(&output));
    assert!(stdout(&output).contains("2 shapes, 1 materials") && stdout(&output).contains("1 file written"), "{}", stdout(&output));
    assert!(folder.path().join("out/meshes/mesh.ply").is_file());
    // The native scene is complete: it needs nothing of the old one.
    std::fs::remove_file(&scene).unwrap();
    assert_code(&run(&["plan", json.to_str().unwrap()]), 0);
    std::fs::write(&scene, pbrt()).unwrap();
    // The same again changes nothing and is no fault; something else in the way is.
    assert_code(&run(&arguments), 0);
    std::fs::write(&json, "mine").unwrap();
    let refused = run(&arguments);
    assert_code(&refused, 2);
    assert!(stderr(&refused).contains("ball.json is there already; --force replaces it"), "{}", stderr(&refused));
    assert_eq!(std::fs::read_to_string(&json).unwrap(), "mine");
    assert_code(&run(&[&arguments[..], &["--force"]].concat()), 0);
    assert!(std::fs::read_to_string(&json).unwrap().contains("\"version\": 1"));
    let misnamed = run(&["import", scene.to_str().unwrap(), "-o", folder.path().join("a.xml").to_str().unwrap()]);
    assert_code(&misnamed, 2);
    assert!(stderr(&misnamed).contains("should end in .json"), "{}", stderr(&misnamed));
}
