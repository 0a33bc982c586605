//! What the tests of the program share: running it, a small scene, a server that ends with its test.

#![allow(dead_code, unreachable_pub, clippy::unwrap_used, missing_docs)]

pub mod puppet;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// A lamp over a floor and a ball: everything a path needs, in 24 × 16 pixels.
pub const SCENE: &str = r#"{
  "version": 1,
  "camera": { "perspective": { "to_world": [{ "look_at": { "origin": [0, 1, 5], "target": [0, 0.8, 0] } }], "fov": 40 } },
  "film": { "width": 24, "height": 16 },
  "integrator": { "max_depth": 4 },
  "materials": { "white": { "diffuse": { "reflectance": 0.7 } }, "black": { "diffuse": { "reflectance": 0 } } },
  "shapes": [
    { "geometry": "rectangle", "material": "white", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [4, 4, 4] }] },
    { "geometry": "rectangle", "material": "black", "emission": { "radiance": 8 },
      "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }] },
    { "geometry": { "sphere": { "radius": 0.6 } }, "material": "white", "to_world": [{ "translate": [0, 0.6, 0] }] }
  ],
  "environment": { "radiance": 0.05 }
}"#;

/// The same, and the ball rolls to the right in half a second.
pub fn moving_scene() -> String {
    let track = r#"{ "target": "shapes[2].to_world[0].translate", "times": [0, 0.5], "values": [[0, 0.6, 0], [1, 0.6, 0]] }"#;
    SCENE.replacen('{', &format!(r#"{{ "animation": {{ "tracks": [{track}] }},"#), 1)
}

/// The same with a mesh from a file beside it.
pub fn scene_with_mesh() -> (String, &'static str) {
    let ball = r#"{ "sphere": { "radius": 0.6 } }"#;
    assert!(SCENE.contains(ball));
    let scene = SCENE.replace(ball, r#"{ "obj": { "file": "models/wedge.obj" } }"#);
    (scene, "v -0.6 0 0\nv 0.6 0 0\nv 0 1 0\nv 0 0 0.6\nf 1 2 3\nf 1 4 3\nf 4 2 3\n")
}

/// A folder with `scene.json` in it.
pub fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.json");
    std::fs::write(&scene, SCENE).unwrap();
    (folder, scene)
}

/// The program, with no settings from outside.
pub fn gradfarm() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gradfarm"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GRADFARM_")) {
        command.env_remove(name);
    }
    command
}

/// Runs it to its end.
pub fn run(arguments: &[&str]) -> Output {
    gradfarm().args(arguments).stdin(Stdio::null()).output().unwrap()
}

pub fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

pub fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// The JSON object on the last line of standard output.
pub fn last_json(output: &Output) -> Value {
    let line = stdout(output).lines().last().unwrap_or_else(|| panic!("no output; standard error: {}", stderr(output)));
    serde_json::from_str(line).unwrap_or_else(|fault| panic!("{fault}: {line}"))
}

/// Fails with everything the program said unless it ended with this code.
#[track_caller]
pub fn assert_code(output: &Output, code: i32) {
    assert_eq!(output.status.code(), Some(code), "standard output: {}\nstandard error: {}", stdout(output), stderr(output));
}

/// Sends a signal by name.
#[cfg(unix)]
pub fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap().success());
}

/// Waits for the end of a process, at most so long.
pub fn wait(child: &mut Child, patience: Duration) -> std::process::ExitStatus {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if started.elapsed() > patience {
            child.kill().unwrap();
            panic!("still running after {patience:?}");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A coordinator with workers of its own, on free ports.
pub struct Server {
    pub child: Child,
    pub http: String,
    pub grpc: String,
    pub data: TempDir,
}

impl Server {
    pub fn start(workers: u32) -> Self {
        Self::start_with(workers, &[])
    }

    /// The same with more arguments.
    pub fn start_with(workers: u32, more: &[&str]) -> Self {
        let data = tempfile::tempdir().unwrap();
        let (child, http, grpc) = launch(data.path(), workers, more);
        Self { child, http, grpc, data }
    }

    /// Ends it without a warning and starts another one on the same data.
    pub fn crash_and_restart(&mut self, workers: u32) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
        std::fs::remove_file(self.data.path().join("address.json")).unwrap();
        (self.child, self.http, self.grpc) = launch(self.data.path(), workers, &[]);
    }

    /// The administrator's token.
    pub fn token(&self) -> String {
        std::fs::read_to_string(self.data.path().join("token")).unwrap().trim().to_owned()
    }

    /// Speaks HTTP to it with that token.
    pub fn client(&self) -> reqwest::Client {
        client_with(Some(&self.token()))
    }

    pub fn url(&self, path: &str) -> String {
        format!("{}/api/v1{path}", self.http)
    }

    /// Runs a client command against it.
    pub fn run(&self, arguments: &[&str]) -> Output {
        gradfarm()
            .args(arguments)
            .env("GRADFARM_SERVER", &self.http)
            .env("GRADFARM_DATA", self.data.path())
            .stdin(Stdio::null())
            .output()
            .unwrap()
    }
}

/// Speaks HTTP with a token, or without any.
pub fn client_with(token: Option<&str>) -> reqwest::Client {
    gradfarm::crypto::provide();
    let headers = token.map(|token| (reqwest::header::AUTHORIZATION, format!("Bearer {token}").parse().unwrap()));
    let client = reqwest::Client::builder().no_proxy().timeout(Duration::from_secs(120));
    client.default_headers(headers.into_iter().collect()).build().unwrap()
}

fn launch(data: &Path, workers: u32, more: &[&str]) -> (Child, String, String) {
    let listen: &[&str] = if more.contains(&"--listen") { &[] } else { &["--listen", "127.0.0.1:0"] };
    let mut child = gradfarm()
        .args(["serve", "--grpc", "127.0.0.1:0", "--threads", "1", "--workers", &workers.to_string(), "--data"])
        .arg(data)
        .args(listen)
        .args(more)
        .env("GRADFARM_LOG", "warn")
        .env("GRADFARM_DRAIN", "3s")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = Instant::now();
    loop {
        if let Ok(text) = std::fs::read_to_string(data.join("address.json")) {
            let address: Value = serde_json::from_str(&text).unwrap();
            return (child, address["http"].as_str().unwrap().to_owned(), address["grpc"].as_str().unwrap().to_owned());
        }
        if child.try_wait().unwrap().is_some() || started.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            let mut said = String::new();
            child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
            panic!("the server did not start: {said}");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Whether a test can use something that not every machine has. Where `GRADFARM_REQUIRE` names it, its absence fails the test.
pub fn optional(name: &str, there: bool) -> bool {
    let required = std::env::var("GRADFARM_REQUIRE").is_ok_and(|names| names.split(',').any(|other| other == name));
    assert!(there || !required, "GRADFARM_REQUIRE names {name}, which is not here");
    there
}
