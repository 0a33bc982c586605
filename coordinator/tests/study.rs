//! `gradfarm study`: every method by every budget against a reference, with numbers that fit together, as table, files and page.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_code, folder, run, stdout};

const SHORT: [&str; 10] = ["--seconds", "0.02,0.05", "--reference-seconds", "0.5", "--size", "20x14", "--seeds", "2", "--seed", "5"];

#[test]
fn every_method_is_measured_at_every_budget() {
    let (folder, scene) = folder();
    let output = folder.path().join("found");
    let methods = "gpt+l2,reuse+l2:reuse-edge=3,gpt+l2:shift=replay:survival=0.5";
    let arguments = ["study", scene.to_str().unwrap(), "--json", "--methods", methods, "-o", output.to_str().unwrap()];
    let done = run(&[&arguments[..], &SHORT].concat());
    assert_code(&done, 0);
    let found: serde_json::Value = serde_json::from_str(stdout(&done)).unwrap();
    let scene = &found["scenes"][0];
    assert_eq!((scene["width"].as_u64(), scene["height"].as_u64()), (Some(20), Some(14)));
    assert!(scene["reference_relmse"].as_f64().unwrap() > 0.0 && found["command"].as_str().unwrap().contains("--seeds 2"));
    let named: Vec<_> = scene["methods"].as_array().unwrap().iter().map(|method| method["name"].as_str().unwrap()).collect();
    assert_eq!(named, std::iter::once("pt").chain(methods.split(',')).collect::<Vec<_>>());
    let mut runs = 0;
    for method in scene["methods"].as_array().unwrap() {
        let points = method["points"].as_array().unwrap();
        assert_eq!(points.iter().map(|point| point["budget"].as_f64().unwrap()).collect::<Vec<_>>(), [0.02, 0.05]);
        for point in points {
            assert_eq!(point["runs"].as_array().unwrap().iter().map(|run| run["seed"].as_u64().unwrap()).collect::<Vec<_>>(), [5, 6]);
            for run in point["runs"].as_array().unwrap() {
                runs += 1;
                let number = |name: &str| run[name].as_f64().unwrap();
                assert!(number("relmse") > 0.0 && number("seconds") > 0.0 && number("samples") >= 2.0, "{run}");
                assert!((0.0..=1.0).contains(&number("flip")) && number("estimated_relmse") > 0.0, "{run}");
            }
        }
    }
    let text = |name: &str| std::fs::read_to_string(output.join(name)).unwrap();
    assert_eq!(text("study.csv").lines().count(), 1 + runs);
    assert_eq!(serde_json::from_str::<serde_json::Value>(&text("study.json")).unwrap(), found);
    let page = text("study.html");
    for part in ["<svg", "How many times smaller the error is at equal time", "reuse+l2:reuse-edge=3", "data:image/png;base64,"] {
        assert!(page.contains(part), "{part} is missing from the page");
    }
    // The reference has no error map.
    assert_eq!(page.matches("<img").count(), 3 * named.len() + 2);
    assert!(std::fs::read_dir(&output).unwrap().any(|file| file.unwrap().path().extension().is_some_and(|end| end == "svg")));
}

#[test]
fn pairs_and_references_make_a_table() {
    let (folder, scene) = folder();
    let scene = scene.to_str().unwrap();
    let reference = folder.path().join("reference.exr");
    let reference = reference.to_str().unwrap();
    assert_code(&run(&["render", scene, "--size", "20x14", "--samples", "64", "-o", reference]), 0);
    let short = ["--seconds", "0.02", "--seeds", "1", "--reference", reference];
    let pairs = ["study", scene, "--size", "20x14", "--techniques", "pt,gpt", "--reconstructions", "none,l2"];
    let done = run(&[&pairs[..], &short].concat());
    assert_code(&done, 0);
    let text = stdout(&done);
    // What a technique cannot give is left out, and path tracing stands there once.
    let methods: Vec<_> = text.lines().skip(2).map(|line| line.split('|').nth(2).unwrap().trim()).collect();
    assert_eq!(methods, ["pt", "gpt+none", "gpt+l2"]);
    let wrong = run(&[&["study", scene, "--size", "21x14"], &short[..]].concat());
    assert_code(&wrong, 2);
}

#[test]
fn nonsense_is_refused() {
    assert_code(&run(&["study"]), 2);
    let (_folder, scene) = folder();
    let refused = |arguments: &[&str]| assert_code(&run(&[&["study", scene.to_str().unwrap()], arguments].concat()), 2);
    refused(&["--seconds", "0"]);
    refused(&["--seconds", "2,1"]);
    refused(&["--techniques", "gpt"]);
    refused(&["--methods", "magic"]);
}
