//! What a worker needs to know before it starts.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use gradfarm_proto::limits;

use crate::credential::Credential;
use crate::error::Error;

/// Longest name [bytes].
const NAME: usize = 200;
/// Most rendering threads.
const THREADS: usize = 1024;

/// Configuration of a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Config {
    /// Where the coordinator listens for workers, such as `http://127.0.0.1:7781` on this machine, or `https://farm.example.org:7781`.
    pub coordinator: String,
    /// Where other coordinators of the same farm listen.
    pub others: Vec<String>,
    /// What the worker shows the coordinators.
    pub credential: Credential,
    /// File with the authority (PEM) of the coordinator's certificate, if that is not the farm's own.
    pub authority: Option<PathBuf>,
    /// For people; at most 200 bytes.
    pub name: String,
    /// Rendering threads, 1 to 1024; each renders one unit at a time.
    pub threads: usize,
    /// Folder for assets by content, or `None` to keep them only while a scene is being compiled.
    pub cache: Option<PathBuf>,
    /// Most bytes of assets kept in the folder.
    pub cache_bytes: u64,
    /// Most compiled scenes kept in memory, ≥ 1.
    pub scenes: usize,
    /// Its pool; empty: none.
    pub pool: String,
    /// What else it is, for jobs that ask for it.
    pub tags: Vec<String>,
    /// Memory that it may use [bytes]; 0: it does not say.
    pub memory: u64,
    /// Where to show metrics, if anywhere; without a token, so best on loopback.
    pub metrics: Option<SocketAddr>,
    /// How long it may take to finish and deliver what it is at, once it is told to stop.
    pub drain: Duration,
}

impl Config {
    /// A worker with the given number of threads, no token, no folder, and two scenes in memory.
    pub fn new(coordinator: impl Into<String>, name: impl Into<String>, threads: usize) -> Self {
        Self {
            coordinator: coordinator.into(),
            others: Vec::new(),
            credential: Credential::None,
            authority: None,
            name: name.into(),
            threads,
            cache: None,
            cache_bytes: 32 << 30,
            scenes: 2,
            pool: String::new(),
            tags: Vec::new(),
            memory: 0,
            metrics: None,
            drain: Duration::from_secs(30),
        }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let invalid = |what, found: String, expected: String| Err(Error::Invalid { what, found, expected });
        if self.name.len() > NAME {
            return invalid("name", format!("{} bytes long", self.name.len()), format!("at most {NAME} bytes"));
        }
        if !(1..=THREADS).contains(&self.threads) {
            return invalid("threads", self.threads.to_string(), format!("1 to {THREADS}"));
        }
        if self.tags.len() > limits::TAGS {
            return invalid("tags", self.tags.len().to_string(), format!("at most {}", limits::TAGS));
        }
        for (what, name) in self.tags.iter().map(|tag| ("tag", tag)).chain((!self.pool.is_empty()).then_some(("pool", &self.pool))) {
            let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
            if name.is_empty() || name.len() > limits::TAG || !name.chars().all(good) {
                let expected = format!("1 to {} letters, digits, dots, dashes and underscores", limits::TAG);
                return invalid(what, format!("{name:?}"), expected);
            }
        }
        if self.scenes == 0 {
            return invalid("scenes", "0".into(), "1 or more".into());
        }
        for url in [&self.coordinator].into_iter().chain(&self.others) {
            if let Err(expected) = self.check_coordinator(url) {
                return invalid("coordinator", format!("{url:?}"), expected.into());
            }
        }
        Ok(())
    }

    /// Beyond this machine nothing is said in the clear.
    fn check_coordinator(&self, url: &str) -> Result<(), &'static str> {
        let usual = "an address such as http://127.0.0.1:7781 on this machine, or https://farm.example.org:7781";
        let uri: tonic::codegen::http::Uri = url.parse().map_err(|_| usual)?;
        let host = uri.host().ok_or(usual)?;
        let here = host == "localhost" || host.trim_matches(['[', ']']).parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback());
        match (uri.scheme_str(), &self.credential) {
            (Some("http"), Credential::Enrolment { .. } | Credential::Certificate { .. }) => {
                Err("an address that begins with https://, for a worker with a certificate")
            }
            (Some("http"), _) if here => Ok(()),
            (Some("http"), _) => Err("an address that begins with https://, since this one is another machine's"),
            (Some("https"), _) => Ok(()),
            _ => Err(usual),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_outside_their_range_are_named() {
        let usual = Config::new("http://127.0.0.1:1", "w", 2);
        assert!(usual.check().is_ok());
        let threads = Config { threads: 0, ..usual.clone() }.check().unwrap_err().to_string();
        assert_eq!(threads, "threads is 0, expected 1 to 1024");
        let at = |coordinator: &str| Config { coordinator: coordinator.into(), ..usual.clone() };
        for good in ["http://localhost:7781", "http://[::1]:7781", "https://farm.example.org:7781", "https://10.0.0.1"] {
            assert!(at(good).check().is_ok(), "{good}");
        }
        for bad in ["http://10.0.0.1:7781", "http://farm:7781", "ftp://127.0.0.1", "127.0.0.1:7781", ""] {
            assert!(at(bad).check().is_err(), "{bad}");
        }
        let credential = Credential::Enrolment { join: None, state: "s".into() };
        assert!(Config { credential, ..usual }.check().unwrap_err().to_string().contains("https://"));
    }
}
