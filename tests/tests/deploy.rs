//! What lies in `deploy/` fits the programs: every setting, option, address and metric that it names exists, and the Python client speaks to a
//! farm.

// Whatever goes wrong here fails the test.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use gradfarm_tests::farm::Coordinator;
use gradfarm_tests::programs::Program;
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// All files below `deploy/`, with their text.
fn files() -> Vec<(PathBuf, String)> {
    fn walk(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else {
                let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
                found.push((path, text));
            }
        }
    }
    let mut found = Vec::new();
    walk(&root().join("deploy"), &mut found);
    assert!(found.len() > 15, "{found:?}");
    found
}

/// What stands in a text from each place where `start` does, as far as `belongs`.
fn words<'a>(text: &'a str, start: &'a str, belongs: fn(char) -> bool) -> impl Iterator<Item = &'a str> {
    text.match_indices(start).filter_map(move |(at, _)| {
        let before = text[..at].chars().next_back();
        let rest = &text[at..];
        let end = rest[start.len()..].find(|c| !belongs(c)).map_or(rest.len(), |end| start.len() + end);
        (!before.is_some_and(belongs)).then_some(&rest[..end])
    })
}

fn help(program: Program, arguments: &[&str]) -> String {
    let output = Command::new(program.path().unwrap()).args(arguments).output().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap()
}

/// Whose settings a file holds: workers' files say so by their name.
fn is_of_a_worker(path: &Path) -> bool {
    path.strip_prefix(root()).unwrap().to_string_lossy().contains("worker")
}

#[test]
fn every_setting_and_option_exists() {
    let (coordinator, worker) = (help(Program::Gradfarm, &["serve", "--help"]), help(Program::Worker, &["--help"]));
    let mut seen = BTreeSet::new();
    for (path, text) in files() {
        let is_client = path.starts_with(root().join("deploy/python"));
        if is_client || path.ends_with("compose.yaml") || path.ends_with("Dockerfile") {
            continue;
        }
        let help = if is_of_a_worker(&path) { &worker } else { &coordinator };
        for name in words(&text, "GRADFARM_", |c| c.is_ascii_uppercase() || c == '_') {
            let told = ["=", "]"].iter().any(|end| help.contains(&format!("[env: {name}{end}")));
            assert!(told, "{}: {name} is no setting of this program", path.display());
            seen.insert(name.to_owned());
        }
        if path.ends_with("workers.sbatch") || path.ends_with("worker.nomad.hcl") {
            for line in text.lines().filter(|line| !line.trim_start().starts_with('#')) {
                for option in words(line, "--", |c| c.is_ascii_lowercase() || c == '-') {
                    assert!(help.contains(&format!("{option} ")), "{}: gradfarm-worker has no option {option}", path.display());
                }
            }
        }
    }
    assert!(seen.len() > 40, "{seen:?}");
}

#[test]
fn every_metric_and_address_exists() {
    // That the manual names what the programs tell is tested there.
    let manual = std::fs::read_to_string(root().join("docs/operating.md")).unwrap();
    let routes = std::fs::read_to_string(root().join("coordinator/src/api/roles.rs")).unwrap();
    let mut metrics = 0;
    for (path, text) in files() {
        let asks = ["grafana", "prometheus", "scaled.yaml"].iter().any(|part| path.iter().any(|name| name == *part));
        for name in words(&text, "gradfarm_", |c| c.is_ascii_lowercase() || c == '_').filter(|_| asks) {
            let name = ["_bucket", "_sum", "_count"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name);
            assert!(manual.contains(&format!("`{name}`")), "{}: there is no metric {name}", path.display());
            metrics += 1;
        }
        for address in words(&text, "/api/v1/", |c| c.is_ascii_lowercase() || "/.".contains(c)) {
            let path_below = address.strip_prefix("/api/v1").unwrap().trim_end_matches('.');
            assert!(routes.contains(&format!("\"{path_below}\"")), "{}: there is no address {address}", path.display());
        }
    }
    assert!(metrics > 30, "{metrics}");
}

#[test]
fn the_dashboard_is_one() {
    let text = std::fs::read_to_string(root().join("deploy/grafana/farm.json")).unwrap();
    let board: Value = serde_json::from_str(&text).unwrap();
    let panels = board["panels"].as_array().unwrap();
    let ids: BTreeSet<u64> = panels.iter().map(|panel| panel["id"].as_u64().unwrap()).collect();
    assert_eq!(ids.len(), panels.len(), "numbers of panels are unique");
    for panel in panels.iter().filter(|panel| panel["type"] != "row") {
        let place = &panel["gridPos"];
        assert!(place["x"].as_u64().unwrap() + place["w"].as_u64().unwrap() <= 24, "{panel}");
        assert!(!panel["targets"].as_array().unwrap().is_empty(), "{panel}");
    }
}

#[test]
fn the_python_client_speaks_to_a_farm() {
    let there = Command::new("python3").arg("--version").output().is_ok_and(|output| output.status.success());
    if !there {
        let required = std::env::var("GRADFARM_REQUIRE").unwrap_or_default();
        assert!(required.split(',').all(|name| name != "python"), "GRADFARM_REQUIRE names python, which is not here");
        return eprintln!("there is no python3: its client is not tested");
    }
    let coordinator = Coordinator::start();
    let _worker = coordinator.worker(2);
    let client = root().join("deploy/python");
    let output = Command::new("python3")
        .arg(client.join("example.py"))
        .arg(root().join("tests/scenes/cornell-box.json"))
        .env("GRADFARM_SERVER", coordinator.address())
        .env("GRADFARM_TOKEN", coordinator.token())
        .env("PYTHONPATH", &client)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    let (told, complaints) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && told.contains("relMSE"), "{told}{complaints}");
}
