//! The README's commands do what it says: they are read out of it and run one by one, with the built programs in place of cargo.

#![allow(clippy::unwrap_used, missing_docs)]
#![cfg(unix)]

use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use gradfarm_tests::programs::Program;

const README: &str = include_str!("../../README.md");
/// Longest that one command may take on a slow machine.
const PATIENCE: Duration = Duration::from_secs(600);

/// The lines of all ```` ```console ```` blocks, in order.
fn commands() -> Vec<&'static str> {
    let mut inside = false;
    let mut lines = Vec::new();
    for line in README.lines() {
        match line {
            "```console" => inside = true,
            "```" => inside = false,
            line if inside => lines.push(line),
            _ => {}
        }
    }
    lines
}

/// What a command is to this test.
#[derive(Debug, PartialEq, Eq)]
enum Kind {
    /// It builds or tests: that is what cargo is doing just now.
    Cargo,
    /// It stays until it is told to stop.
    Stays,
    /// It sets a variable for the commands after it.
    Sets,
    /// It speaks HTTP from outside.
    Curl,
    /// One of the programs, run to its end.
    Runs,
}

fn kind(command: &str) -> Kind {
    let first = command.split_whitespace().next().unwrap();
    match first {
        "cargo" if command.starts_with("cargo run --release -- ") => Kind::Runs,
        "cargo" => Kind::Cargo,
        "curl" => Kind::Curl,
        "target/release/gradfarm-worker" => Kind::Stays,
        "target/release/gradfarm" if command.starts_with("target/release/gradfarm serve") => Kind::Stays,
        "target/release/gradfarm" => Kind::Runs,
        _ if first.split('=').next().unwrap().bytes().all(|byte| byte.is_ascii_uppercase()) => Kind::Sets,
        _ => panic!("the README holds a command that this test does not know: {command}"),
    }
}

/// A process that ends with the test.
struct Background(Child);

impl Drop for Background {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Two ports that nobody uses at this moment.
fn free_ports() -> [u16; 2] {
    let listeners = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    listeners.map(|listener| listener.local_addr().unwrap().port())
}

fn wait_until(what: &str, done: impl Fn() -> bool) {
    let started = Instant::now();
    while !done() {
        assert!(started.elapsed() < PATIENCE, "{what} takes too long");
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn starts_with(path: &Path, magic: &[u8]) -> bool {
    std::fs::read(path).is_ok_and(|bytes| bytes.starts_with(magic))
}

#[test]
fn every_command_does_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    std::os::unix::fs::symlink(root.join("tests"), folder.path().join("tests")).unwrap();
    let (gradfarm, worker) = (Program::Gradfarm.path().unwrap(), Program::Worker.path().unwrap());
    // The README's ports may be taken on this machine.
    let [http, grpc] = free_ports().map(|port| format!("127.0.0.1:{port}"));
    let here = |command: &str| {
        command
            .replace("cargo run --release --", gradfarm.to_str().unwrap())
            .replace("target/release/gradfarm-worker", worker.to_str().unwrap())
            .replace("target/release/gradfarm", gradfarm.to_str().unwrap())
            .replace("127.0.0.1:7700", &http)
            .replace("127.0.0.1:7781", &grpc)
    };
    let shell = |script: String| {
        let mut shell = Command::new("sh");
        shell.args(["-euc", &script]).current_dir(&folder).stdin(Stdio::null());
        shell.env("GRADFARM_LISTEN", &http).env("GRADFARM_GRPC", &grpc).env("GRADFARM_SERVER", format!("http://{http}"));
        shell.env("GRADFARM_CACHE", folder.path().join("cache")).env("GRADFARM_LOG", "warn");
        shell
    };
    let curl = Command::new("curl").arg("--version").stdout(Stdio::null()).status().is_ok_and(|status| status.success());
    let (exr, png) = (folder.path().join("cornell.exr"), folder.path().join("cornell.png"));

    let mut background = Vec::new();
    let mut variables = String::new();
    let (mut ran, mut curled) = (0, 0);
    for command in commands() {
        match kind(command) {
            Kind::Cargo => continue,
            Kind::Stays => {
                background.push(Background(shell(format!("exec {}", here(command))).spawn().unwrap()));
                wait_until("the server", || folder.path().join("gradfarm-data/address.json").exists());
                continue;
            }
            Kind::Curl | Kind::Sets if !curl => {
                eprintln!("there is no curl on this machine, not run: {command}");
                continue;
            }
            Kind::Sets => {
                variables += &format!("{}\n", here(command));
                continue;
            }
            Kind::Curl => curled += 1,
            Kind::Runs => ran += 1,
        }
        let writes_image = command.contains("cornell.exr");
        if writes_image {
            let _ = std::fs::remove_file(&exr);
        }
        let mut child = shell(format!("{variables}{}", here(command))).spawn().unwrap();
        let started = Instant::now();
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break status,
                None if started.elapsed() > PATIENCE => {
                    child.kill().unwrap();
                    panic!("takes too long: {command}");
                }
                None => std::thread::sleep(Duration::from_millis(50)),
            }
        };
        assert!(status.success(), "{status}: {command}");
        assert!(!writes_image || starts_with(&exr, b"\x76\x2f\x31\x01"), "wrote no EXR: {command}");
    }
    assert!(starts_with(&png, b"\x89PNG\r\n\x1a\n"), "there is no PNG");
    assert!(ran >= 3, "only {ran} commands ran: where have the README's commands gone?");
    assert!(!curl || curled >= 4, "only {curled} of curl's commands ran: where have they gone?");
    // The coordinator and the workers are still there: nobody broke.
    for process in &mut background {
        assert_eq!(process.0.try_wait().unwrap(), None, "a process of the farm ended by itself");
    }
    assert_eq!(background.len(), 3, "a coordinator and two workers");
}
