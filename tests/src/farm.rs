//! A farm of separate processes on this machine, with ways to hurt them: for the tests of what survives.

// Whatever goes wrong here fails the test that asked for it.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use gradfarm_core::film::{Film, Image};
use gradfarm_core::output::exr;
use gradfarm_core::plan::{self, Plan, Request, Stop, Technique};
use gradfarm_core::reconstruction::{Reconstructed, reconstruct};
use gradfarm_core::scene::{NoAssets, Scene, SceneDescription};
use serde_json::Value;
use tempfile::TempDir;

use crate::frame;
use crate::programs::Program;

/// Longest wait for anything, on a machine that does other things, too.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// A process that does not outlive its test.
#[derive(Debug)]
pub struct Process(Child);

impl Process {
    /// Starts it, silent but for its complaints.
    pub fn start(command: &mut Command) -> Self {
        Self(command.stdin(Stdio::null()).stdout(Stdio::null()).spawn().unwrap())
    }

    /// Ends it at once, as a power cut would: SIGKILL.
    pub fn kill(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }

    /// Sends a signal by name.
    pub fn signal(&self, name: &str) {
        let status = Command::new("kill").args([&format!("-{name}"), &self.0.id().to_string()]).status().unwrap();
        assert!(status.success(), "SIG{name} to {}", self.0.id());
    }

    /// Waits for its end.
    pub fn end(&mut self, patience: Duration) -> ExitStatus {
        wait_for("the end of a process", patience, || self.0.try_wait().unwrap())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ended = self.0.kill();
        let _reaped = self.0.wait();
    }
}

/// A coordinator as a process, on a folder and ports that it keeps over crashes.
#[derive(Debug)]
pub struct Coordinator {
    process: Process,
    listen: SocketAddr,
    grpc: SocketAddr,
    data: TempDir,
    with: With,
}

/// What a coordinator is started with besides its folder and addresses.
#[derive(Clone, Debug, Default)]
pub struct With {
    /// Further arguments.
    pub arguments: Vec<String>,
    /// Its environment.
    pub environment: Vec<(&'static str, String)>,
}

impl Coordinator {
    /// Starts one, without workers.
    pub fn start() -> Self {
        Self::start_with(With::default())
    }

    /// Starts one with further settings, without workers.
    pub fn start_with(with: With) -> Self {
        let data = tempfile::tempdir().unwrap();
        let (listen, grpc) = (free_address(), free_address());
        let process = serve(data.path(), listen, grpc, &with);
        let coordinator = Self { process, listen, grpc, data, with };
        coordinator.wait_until_it_answers();
        coordinator
    }

    /// Kills it and starts another one in its place.
    pub fn crash_and_restart(&mut self) {
        self.process.kill();
        self.process = serve(self.data.path(), self.listen, self.grpc, &self.with);
        self.wait_until_it_answers();
    }

    fn wait_until_it_answers(&self) {
        wait_for("the coordinator", PATIENCE, || self.ask(&["status", "--json"]).is_ok().then_some(()));
    }

    /// Starts it again after its end.
    pub fn restart(&mut self) {
        self.process = serve(self.data.path(), self.listen, self.grpc, &self.with);
        self.wait_until_it_answers();
    }

    /// Kills it for good.
    pub fn kill(&mut self) {
        self.process.kill();
    }

    /// Sends it a signal by name.
    pub fn signal(&self, name: &str) {
        self.process.signal(name);
    }

    /// Waits for its end.
    pub fn end(&mut self, patience: Duration) -> ExitStatus {
        self.process.end(patience)
    }

    /// The administrator's token.
    pub fn token(&self) -> String {
        std::fs::read_to_string(self.data.path().join("state/token")).unwrap().trim().to_owned()
    }

    /// Where people and browsers find it.
    pub fn address(&self) -> String {
        format!("http://{}", self.listen)
    }

    /// Starts a worker for it.
    pub fn worker(&self, threads: usize) -> Process {
        Self::worker_of(&[self], threads)
    }

    /// Starts a worker for several coordinators.
    pub fn worker_of(coordinators: &[&Coordinator], threads: usize) -> Process {
        let mut command = program(Program::Worker);
        for coordinator in coordinators {
            command.args(["--coordinator", &format!("http://{}", coordinator.grpc)]);
        }
        command.args(["--threads", &threads.to_string(), "--cache-size", "0"]);
        command.arg("--data").arg(coordinators[0].data.path().join("state"));
        Process::start(command.args(["--log", "warn"]))
    }

    /// Runs a client command; what it printed.
    ///
    /// # Errors
    /// What it complained about.
    pub fn ask(&self, arguments: &[&str]) -> Result<String, String> {
        let mut command = program(Program::Gradfarm);
        let output = command
            .args(arguments)
            .env("GRADFARM_SERVER", format!("http://{}", self.listen))
            .env("GRADFARM_DATA", self.data.path().join("state"))
            .output()
            .unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        if output.status.success() { Ok(text(output.stdout)) } else { Err(text(output.stderr)) }
    }

    /// Most memory that it ever held, as far as the system tells [MiB]; 0 where it does not.
    pub fn peak_memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.0.id())).unwrap_or_default();
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
        peak.unwrap_or(0).div_ceil(1024)
    }

    /// Submits a job; its name.
    pub fn submit(&self, job: &Job) -> String {
        self.submit_with(job, &[])
    }

    /// Submits a job with further arguments; its name.
    pub fn submit_with(&self, job: &Job, more: &[&str]) -> String {
        let samples = job.samples.to_string();
        let size = format!("{}x{}", job.width, job.height);
        let file = self.data.path().join("scene.json");
        std::fs::write(&file, job.scene).unwrap();
        let (file, tile) = (file.to_str().unwrap(), job.tile.to_string());
        let rounds = job.rounds.to_string();
        let technique = job.technique.name();
        let arguments = ["submit", file, "--technique", technique, "--samples", &samples, "--size", &size, "--tile", &tile, "--seed", "11"];
        let arguments = [&arguments[..], &["--rounds", &rounds], more].concat();
        self.ask(&arguments).unwrap().trim().to_owned()
    }

    /// A job as the coordinator tells it.
    pub fn job(&self, job: &str) -> Value {
        let text = self.ask(&["status", job, "--json"]).unwrap();
        serde_json::from_str(&text).unwrap()
    }

    /// How many units of a job are done.
    pub fn units_done(&self, job: &str) -> u64 {
        self.job(job)["progress"]["units"]["done"].as_u64().unwrap()
    }

    /// Waits until so many units are done, and says how many there are then.
    pub fn wait_for_units(&self, job: &str, least: u64) -> u64 {
        wait_for("units", PATIENCE, || Some(self.units_done(job)).filter(|done| *done >= least))
    }

    /// Waits for the end of a job that should be done, and fetches its image.
    pub fn image(&self, job: &str) -> Vec<u8> {
        self.frame(job, 0)
    }

    /// The same for one of several frames.
    pub fn frame(&self, job: &str, frame: u32) -> Vec<u8> {
        let state = wait_for("the end of the job", PATIENCE, || {
            let state = self.job(job)["state"].as_str().unwrap().to_owned();
            (state != "queued" && state != "running").then_some(state)
        });
        assert_eq!(state, "done", "{}", self.job(job));
        let file = self.data.path().join("out.exr");
        self.ask(&["pull", job, "--frame", &frame.to_string(), "-o", file.to_str().unwrap()]).unwrap();
        std::fs::read(file).unwrap()
    }
}

/// A job that renders for some seconds.
#[derive(Clone, Copy, Debug)]
pub struct Job {
    /// Description.
    pub scene: &'static str,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Edge of the tiles.
    pub tile: u32,
    /// Rounds in which samples are placed.
    pub rounds: u32,
    /// How its pixels are measured.
    pub technique: Technique,
}

impl Job {
    /// What the core alone makes of this job, without any farm: once for each process.
    pub fn reference(&self) -> &'static Reference {
        static REFERENCE: OnceLock<Reference> = OnceLock::new();
        REFERENCE.get_or_init(|| self.rendered(Stop::default()))
    }

    /// The same, rendered now, of a job that is checked on the way by this rule.
    pub fn rendered(&self, stop: Stop) -> Reference {
        let description = SceneDescription::from_json(self.scene, "scene").unwrap();
        let extent = gradfarm_core::lattice::Extent { width: self.width, height: self.height };
        let technique = Some(self.technique);
        let (samples, rounds) = (Some(self.samples), Some(self.rounds));
        let request = Request { technique, samples, extent: Some(extent), seed: 11, rounds, stop, ..Request::default() };
        let plan: Plan = plan::resolve(&description, &request).unwrap();
        let film = frame::render(&Scene::compile(&description, &NoAssets).unwrap(), &plan).unwrap();
        let image = reconstruct(&film, plan.reconstruction, plan.alpha).unwrap();
        Reference { film, image }
    }
}

/// A frame without a farm.
#[derive(Debug)]
pub struct Reference {
    film: Film,
    image: Reconstructed,
}

impl Reference {
    /// Fails unless the layers of an OpenEXR file have exactly these bits.
    #[track_caller]
    pub fn assert_same_bits(&self, file: &[u8]) {
        let both = self.film.combined();
        let mut layers: Vec<(&str, &Image)> = vec![
            ("", &self.image.image),
            ("primal", &self.image.primal),
            ("variance", &both.primal_variance),
            ("albedo", &self.film.features.albedo),
        ];
        if let Some(gradients) = &both.gradients {
            layers.extend([("dx", &gradients.dx), ("dy", &gradients.dy)]);
        }
        layers.extend(self.film.counts.as_ref().map(|counts| ("samples", counts)));
        for (name, expected) in layers {
            let found = exr::read_layer(file, name).unwrap();
            assert_eq!(found.extent(), expected.extent());
            let differing = found.data().iter().zip(expected.data()).filter(|(f, e)| f.to_bits() != e.to_bits()).count();
            assert_eq!(differing, 0, "values of layer `{name}` that differ, of {}", expected.data().len());
        }
    }
}

/// Asks again and again until there is an answer.
#[track_caller]
pub fn wait_for<T>(what: &str, patience: Duration, mut ask: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(started.elapsed() < patience, "no sign of {what} within {patience:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn serve(data: &Path, listen: SocketAddr, grpc: SocketAddr, with: &With) -> Process {
    let mut command = program(Program::Gradfarm);
    command.args(["serve", "--listen", &listen.to_string(), "--grpc", &grpc.to_string(), "--data"]).arg(data.join("state"));
    command.args(&with.arguments).envs(with.environment.iter().map(|(name, value)| (name, value)));
    Process::start(command.env("GRADFARM_LOG", "warn"))
}

/// One of the programs, with no settings from outside.
pub fn program(which: Program) -> Command {
    static PATHS: OnceLock<[PathBuf; 2]> = OnceLock::new();
    let [gradfarm, worker] = PATHS.get_or_init(|| [Program::Gradfarm, Program::Worker].map(|program| program.path().unwrap()));
    let mut command = Command::new(if which == Program::Worker { worker } else { gradfarm });
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GRADFARM_")) {
        command.env_remove(name);
    }
    command
}

/// An address that was free a moment ago, so that a coordinator can come back to it.
fn free_address() -> SocketAddr {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap()
}
