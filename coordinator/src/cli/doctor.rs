//! `gradfarm doctor`: looks at everything that a farm needs, and says of what is wrong how to mend it.

use std::fmt::Display;
use std::net::TcpListener;
use std::path::Path;

use rustix::process::{Resource, getrlimit};
use serde::Serialize;

use super::client::{Client, ServerOption};
use super::error::Error;
use super::terminal;
use crate::api::json::{Health, JobPage, Worker, Workers};
use crate::job::JobState;
use crate::movie::ffmpeg::{Container, Ffmpeg};
use crate::oidn;

/// Arguments of `gradfarm doctor`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Nothing is changed. The exit code is 0 if nothing is wrong, 1 otherwise; what is merely optional is never wrong.

Examples:
  gradfarm doctor
  gradfarm doctor --data /srv/gradfarm --server http://127.0.0.1:7700
  gradfarm doctor --json | jq '.[] | select(.verdict == \"wrong\")'")]
pub(super) struct Doctor {
    /// Print one JSON array instead of lines
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

/// What was found of one thing.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Finding {
    what: &'static str,
    verdict: Verdict,
    found: String,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    mend: Option<String>,
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    /// As it should be.
    Well,
    /// Works, but there is something to know.
    Note,
    /// Does not work.
    Wrong,
}

/// Room below which a folder is about to be a problem [bytes].
const ROOM: u64 = 2 << 30;
/// Files that a process should be allowed to have open: connections of workers, blobs, the database.
const OPEN_FILES: u64 = 1024;

impl Finding {
    fn well(what: &'static str, found: impl Display) -> Self {
        Self { what, verdict: Verdict::Well, found: found.to_string(), mend: None }
    }

    fn note(what: &'static str, found: impl Display, mend: impl Display) -> Self {
        Self { what, verdict: Verdict::Note, found: found.to_string(), mend: Some(mend.to_string()) }
    }

    fn wrong(what: &'static str, found: impl Display, mend: impl Display) -> Self {
        Self { what, verdict: Verdict::Wrong, found: found.to_string(), mend: Some(mend.to_string()) }
    }
}

impl Doctor {
    /// Looks at everything and prints what it found.
    pub(super) async fn run(self) -> Result<(), Error> {
        let mut findings = vec![program(), open_files()];
        findings.push(folder("temporary files", &std::env::temp_dir(), "set TMPDIR to a folder with room that you may write"));
        findings.extend(state(self.server.data()));
        findings.extend(optional());
        findings.extend(coordinator(&self.server.client()?).await);
        if self.json {
            terminal::json(&findings)?;
        } else {
            for Finding { what, verdict, found, mend } in &findings {
                let sign = match verdict {
                    Verdict::Well => "ok   ",
                    Verdict::Note => "note ",
                    Verdict::Wrong => "WRONG",
                };
                terminal::line(format_args!("{sign}  {what:16}  {found}"))?;
                if let Some(mend) = mend {
                    terminal::line(format_args!("{:25}→ {mend}", ""))?;
                }
            }
        }
        match findings.iter().filter(|finding| finding.verdict == Verdict::Wrong).count() {
            0 => Ok(()),
            1 => Err(Error::Failed("one thing is wrong".to_owned())),
            count => Err(Error::Failed(format!("{count} things are wrong"))),
        }
    }
}

fn program() -> Finding {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let memory = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| available(&text));
    let memory = memory.map(|bytes| format!(", {} of memory available", size(bytes))).unwrap_or_default();
    Finding::well("program", format_args!("gradfarm {}, {cores} cores{memory}", env!("CARGO_PKG_VERSION")))
}

/// What `/proc/meminfo` says is available [bytes].
fn available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? << 10)
}

fn open_files() -> Finding {
    match getrlimit(Resource::Nofile).current {
        Some(limit) if limit < OPEN_FILES => Finding::wrong(
            "open files",
            format_args!("at most {limit}"),
            format_args!("ulimit -n {OPEN_FILES}, or LimitNOFILE= of a systemd unit"),
        ),
        Some(limit) => Finding::well("open files", format_args!("at most {limit}")),
        None => Finding::well("open files", "no limit"),
    }
}

/// Whether a folder can be written, and has room.
fn folder(what: &'static str, path: &Path, mend: &str) -> Finding {
    let place = path.display();
    if let Err(fault) = tempfile::tempfile_in(path) {
        return Finding::wrong(what, format_args!("{place} cannot be written: {fault}"), mend);
    }
    match rustix::fs::statvfs(path) {
        Ok(room) => {
            let free = room.f_bavail.saturating_mul(room.f_frsize);
            let found = format!("{place}, {} free", size(free));
            if free < ROOM { Finding::wrong(what, found, mend) } else { Finding::well(what, found) }
        }
        Err(fault) => Finding::note(what, format_args!("{place} can be written; how much room it has is not told: {fault}"), mend),
    }
}

/// The folder of the coordinator's state: whether it could be used.
fn state(data: &Path) -> Vec<Finding> {
    const WHAT: &str = "state";
    let place = data.display();
    if !data.exists() {
        return vec![Finding::note(WHAT, format_args!("{place} is not there"), "`gradfarm serve` makes it; --data names another one")];
    }
    let mut findings = vec![folder(WHAT, data, "make room, or move the folder to where there is some")];
    let lock = data.join("lock");
    if let Ok(file) = std::fs::File::open(&lock) {
        findings.push(match file.try_lock() {
            Ok(()) => Finding::note("coordinator", format_args!("none is using {place}"), format_args!("gradfarm serve --data {place}")),
            Err(_) => Finding::well("coordinator", format_args!("one is using {place}")),
        });
    }
    findings.extend(secret(&data.join("token")));
    findings
}

/// A file that only its owner should read.
fn secret(path: &Path) -> Option<Finding> {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(path).ok()?.permissions().mode() & 0o777;
    let place = path.display();
    Some(match mode & 0o077 {
        0 => Finding::well("token", format_args!("{place} is its owner's alone")),
        _ => Finding::wrong(
            "token",
            format_args!("others may read {place} (mode {mode:03o})"),
            format_args!("chmod 600 {place}, and renew the token"),
        ),
    })
}

/// What is used where it is there.
fn optional() -> [Finding; 2] {
    [
        match Ffmpeg::find(Container::Mp4) {
            Ok(_) => Finding::well("movies", "ffmpeg is here"),
            Err(missing) => Finding::note("movies", missing, "install ffmpeg; animated PNG needs nothing"),
        },
        match oidn::install() {
            Ok(found) => Finding::well("denoiser", found),
            Err(missing) => Finding::note("denoiser", missing, "only `--reconstruction oidn` needs it"),
        },
    ]
}

/// The coordinator and its workers, as the network shows them.
async fn coordinator(client: &Client) -> Vec<Finding> {
    const WHAT: &str = "network";
    let health: Health = match client.get("/health").await {
        Ok(health) => health,
        Err(Error::Unreachable { server, reason }) => {
            let port = reqwest::Url::parse(&server).ok().and_then(|url| url.port_or_known_default());
            let taken = port.is_some_and(|port| TcpListener::bind(("127.0.0.1", port)).is_err());
            let mend =
                if taken { "something else has the port: `gradfarm serve --listen` takes another" } else { "start `gradfarm serve`" };
            return vec![Finding::note(WHAT, format_args!("no coordinator at {server}: {reason}"), mend)];
        }
        Err(fault) => return vec![Finding::wrong(WHAT, fault, "see the coordinator's log")],
    };
    let mut findings = vec![match health.version == env!("CARGO_PKG_VERSION") {
        true => Finding::well(WHAT, format_args!("coordinator {} at {}", health.version, client.server())),
        false => {
            Finding::note(WHAT, format_args!("coordinator {} at {}", health.version, client.server()), "this program is of another version")
        }
    }];
    match (client.get::<Workers>("/workers").await, client.get::<JobPage>("/jobs?limit=500").await) {
        (Ok(Workers { workers }), Ok(page)) => {
            let open =
                page.jobs.iter().filter(|job| [JobState::Queued, JobState::Running].iter().any(|state| state.name() == job.state)).count();
            findings.extend(workers_of(&workers, open, &health.version));
        }
        (Err(fault), _) | (_, Err(fault)) => findings.push(Finding::wrong(WHAT, fault, "a token that may look is needed")),
    }
    findings
}

fn workers_of(workers: &[Worker], open: usize, version: &str) -> Vec<Finding> {
    const WHAT: &str = "workers";
    let threads: u64 = workers.iter().map(|worker| u64::from(worker.threads)).sum();
    let found = format!("{} connected, {threads} threads; {open} jobs are not over", workers.len());
    let start = "start gradfarm-worker on any machine that reaches the coordinator";
    let mut findings = vec![match (workers.len(), open) {
        (0, 0) => Finding::note(WHAT, found, start),
        (0, _) => Finding::wrong(WHAT, found, start),
        _ => Finding::well(WHAT, found),
    }];
    for worker in workers {
        if worker.set_aside_until_ms.is_some() {
            let mend = "look at that worker's log: memory, disk, another version?";
            findings.push(Finding::note(WHAT, format_args!("{} is set aside: it failed units in a row", worker.name), mend));
        }
        if worker.version != version {
            let found = format!("{} is of version {}, the coordinator of {version}", worker.name, worker.version);
            findings.push(Finding::note(WHAT, found, "update it when it is convenient"));
        }
    }
    findings
}

/// A number of bytes, for people.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_048_576 => format!("{} kB", bytes >> 10),
        1_048_576..1_073_741_824 => format!("{} MB", bytes >> 20),
        _ => format!("{:.1} GB", bytes as f64 / (1u64 << 30) as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn folders_and_secrets_are_judged() {
        let folder_of = tempfile::tempdir().unwrap();
        assert_ne!(folder("x", folder_of.path(), "m").verdict, Verdict::Note);
        let gone = folder("x", &folder_of.path().join("gone"), "make it");
        assert_eq!((gone.verdict, gone.mend.as_deref()), (Verdict::Wrong, Some("make it")));
        assert_eq!(state(&folder_of.path().join("gone"))[0].verdict, Verdict::Note);
        let token = folder_of.path().join("token");
        assert_eq!(secret(&token), None);
        std::fs::write(&token, "t").unwrap();
        for (mode, verdict) in [(0o600, Verdict::Well), (0o644, Verdict::Wrong)] {
            std::fs::set_permissions(&token, std::fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(secret(&token).unwrap().verdict, verdict);
        }
        assert_eq!(available("MemTotal: 10 kB\nMemAvailable:    2048 kB\n"), Some(2 << 20));
        assert_eq!([size(2048), size(3 << 20), size(5 << 29)], ["2 kB", "3 MB", "2.5 GB"]);
    }

    #[test]
    fn jobs_without_workers_are_wrong() {
        assert_eq!(workers_of(&[], 0, "1").first().unwrap().verdict, Verdict::Note);
        assert_eq!(workers_of(&[], 2, "1").first().unwrap().verdict, Verdict::Wrong);
    }
}
