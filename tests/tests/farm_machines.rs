//! A farm on several machines, each with a network of its own: workers join over TLS with certificates of their own, and one whose cable is
//! pulled for longer than its leases are good comes back and works on. The image has the bits that it has on one machine.

#![cfg(unix)]
// Whatever goes wrong here fails the test.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use gradfarm_core::plan::Technique;
use gradfarm_tests::farm::{Job, PATIENCE, Process, program, wait_for};
use gradfarm_tests::machines::Network;
use gradfarm_tests::programs::Program;
use serde_json::Value;

const JOB: Job = Job {
    scene: include_str!("../scenes/cornell-box.json"),
    width: 64,
    height: 48,
    samples: 96,
    tile: 16,
    rounds: 1,
    technique: Technique::Gpt,
};
/// 4 × 3 tiles, 6 sample ranges each.
const UNITS: u64 = 72;
/// Longer than a lease is good without a word from its worker.
const PAST_THE_LEASE: Duration = Duration::from_secs(17);

/// The coordinator's machine.
const HOME: usize = 0;

/// A client command on the coordinator's machine; what it printed.
fn ask(network: &Network, folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let mut command = program(Program::Gradfarm);
    command.args(arguments).env("GRADFARM_DATA", folder.join("state"));
    let output = network.on(HOME, &command).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    if output.status.success() { Ok(text(output.stdout)) } else { Err(text(output.stderr)) }
}

fn units_done(network: &Network, folder: &Path, job: &str) -> (u64, String) {
    let text = ask(network, folder, &["status", job, "--json"]).unwrap();
    let job: Value = serde_json::from_str(&text).unwrap();
    (job["progress"]["units"]["done"].as_u64().unwrap(), job["state"].as_str().unwrap().to_owned())
}

fn submit(network: &Network, folder: &Path) -> String {
    let scene = folder.join("scene.json");
    std::fs::write(&scene, JOB.scene).unwrap();
    let (samples, size) = (JOB.samples.to_string(), format!("{}x{}", JOB.width, JOB.height));
    let submit = ["submit", scene.to_str().unwrap(), "--technique", "gpt", "--samples", &samples, "--size", &size, "--tile", "16"];
    ask(network, folder, &[&submit[..], &["--seed", "11", "--rounds", "1"]].concat()).unwrap().trim().to_owned()
}

fn image(network: &Network, folder: &Path, job: &str) -> Vec<u8> {
    wait_for("the end of the job", PATIENCE, || (units_done(network, folder, job).1 == "done").then_some(()));
    assert_eq!(units_done(network, folder, job).0, UNITS);
    let file = folder.join("out.exr");
    ask(network, folder, &["pull", job, "-o", file.to_str().unwrap()]).unwrap();
    std::fs::read(file).unwrap()
}

/// A worker that joins with this file, on a machine of its own.
fn worker(network: &Network, machine: usize, folder: &Path, join: &Path) -> Process {
    let mut command: Command = program(Program::Worker);
    command.args(["--coordinator", &format!("https://{}:7781", network.address(HOME))]).arg("--join").arg(join);
    command.arg("--state").arg(folder.join(format!("worker-{machine}")));
    command.args(["--threads", "1", "--cache-size", "0", "--log", "warn"]);
    Process::start(&mut network.on(machine, &command))
}

#[test]
fn a_pulled_cable_costs_time_and_nothing_else() {
    let Some(network) = Network::of(3) else { return };
    let folder = tempfile::tempdir().unwrap();
    let (folder, home) = (folder.path(), network.address(HOME));
    let mut serve = program(Program::Gradfarm);
    serve.args(["serve", "--tls", "--listen", &format!("{home}:7700"), "--grpc", &format!("{home}:7781"), "--data"]);
    serve.arg(folder.join("state")).env("GRADFARM_LOG", "warn");
    let _coordinator = Process::start(&mut network.on(HOME, &serve));
    wait_for("the coordinator", PATIENCE, || ask(&network, folder, &["status", "--json"]).ok());
    let join = folder.join("join");
    ask(&network, folder, &["join-token", "create", "--uses", "2", "-o", join.to_str().unwrap()]).unwrap();
    let _cut_off = worker(&network, 1, folder, &join);
    let mut other = worker(&network, 2, folder, &join);

    let job = submit(&network, folder);
    wait_for("units", PATIENCE, || (units_done(&network, folder, &job).0 >= 5).then_some(()));
    network.plug(1, false);
    std::thread::sleep(PAST_THE_LEASE);
    JOB.reference().assert_same_bits(&image(&network, folder, &job));
    network.plug(1, true);

    // All alone, it has to be back to do this.
    other.kill();
    let job = submit(&network, folder);
    JOB.reference().assert_same_bits(&image(&network, folder, &job));
}
