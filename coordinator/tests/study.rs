//! `gradfarm study`: one row for each method, against a reference, with numbers that fit together.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{assert_code, folder, run, stdout};

#[test]
fn every_method_has_its_row() {
    let (_folder, scene) = folder();
    let methods = "gpt+l2,gpt+l1,reuse+l2:reuse-edge=3,graph,gpt+l2:shift=replay:survival=0.5";
    let size = ["--samples", "16", "--reference-samples", "64", "--size", "20x14", "--seeds", "2", "--methods", methods];
    let output = run(&[&["study", scene.to_str().unwrap(), "--json"], &size[..]].concat());
    assert_code(&output, 0);
    let rows: Vec<serde_json::Value> = stdout(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let told: Vec<_> = rows.iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(told, std::iter::once("pt").chain(methods.split(',')).collect::<Vec<_>>());
    assert_eq!(rows[0]["samples"], 16);
    let cost = |row: &serde_json::Value| row["relmse"].as_f64().unwrap() * row["seconds"].as_f64().unwrap();
    for row in &rows {
        // The ratio is what it says it is, and equal error in equal time is 1.
        let ratio = row["ratio"].as_f64().unwrap();
        assert!((ratio * cost(row) / cost(&rows[0]) - 1.0).abs() < 1e-9, "{row}");
        assert!(row["relmse"].as_f64().unwrap() > 0.0 && row["samples"].as_u64().unwrap() >= 2, "{row}");
        assert!(row["reference_relmse"].as_f64().unwrap() > 0.0 && row["spread"].as_f64().unwrap() >= 1.0);
    }
}

#[test]
fn a_study_without_scenes_or_with_one_sample_is_refused() {
    assert_code(&run(&["study"]), 2);
    let (_folder, scene) = folder();
    assert_code(&run(&["study", scene.to_str().unwrap(), "--samples", "1"]), 2);
}
