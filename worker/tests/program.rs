//! The worker as a program: its example settings exist, and it waits for a coordinator that is not there yet.

#![allow(clippy::unwrap_used, missing_docs)]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn worker() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gradfarm-worker"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GRADFARM_")) {
        command.env_remove(name);
    }
    command
}

#[test]
fn help_names_the_example_settings() {
    let output = worker().arg("--help").output().unwrap();
    assert!(output.status.success());
    let help = String::from_utf8(output.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    let example = include_str!("../../deploy/worker.env");
    let keys = example.lines().filter_map(|line| line.trim_start_matches('#').split_once('='));
    let keys: Vec<&str> = keys.map(|(key, _)| key).filter(|key| key.starts_with("GRADFARM_")).collect();
    for key in &keys {
        assert!(help.contains(&format!("[env: {key}")), "{key} is no setting of the worker");
    }
    assert_eq!(keys.len(), help.matches("[env: GRADFARM_").count(), "a setting is missing in deploy/worker.env");
}

#[cfg(unix)]
#[test]
fn a_coordinator_that_is_away_is_waited_for_until_told_to_stop() {
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut child = worker()
        .args(["--coordinator", &format!("http://127.0.0.1:{port}"), "--threads", "1", "--cache-size", "0"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!(child.try_wait().unwrap(), None, "it gave up");
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    let told = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if told.elapsed() > Duration::from_secs(30) {
            child.kill().unwrap();
            panic!("it does not stop");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(status.code(), Some(0));
}
