//! `gradfarm join-token` and `gradfarm worker`: who may join the farm, and who has.

use std::path::PathBuf;
use std::time::Duration;

use reqwest::Method;

use super::client::ServerOption;
use super::error::Error;
use super::{span, terminal};
use crate::access::{PrivateFileError, write_private};
use crate::api::enrolment::{EnrolledWorker, EnrolledWorkers, JoinInfo, JoinRequest, JoinTokens};
use crate::api::json::Workers;
use crate::clock::Clock;

/// Arguments of `gradfarm join-token`.
#[derive(Debug, clap::Args)]
pub(super) struct JoinToken {
    #[command(subcommand)]
    action: JoinAction,
}

#[derive(Debug, clap::Subcommand)]
enum JoinAction {
    /// Issue a token with which a worker on another machine joins
    Create(Create),
    /// List the join tokens
    List(List),
    /// Take a join token back
    Revoke(Revoke),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The file holds a secret, good for one worker and one hour unless told otherwise, and the certificate of the farm's authority, which the \
worker trusts from its first word on. Carry it to the worker's machine as you would a password. From then on the worker has a \
certificate of its own and renews it by itself.

Example:
  gradfarm join-token create --pool north -o north-1.join
  gradfarm-worker --coordinator https://farm.example.org:7781 --join north-1.join        # on the other machine")]
struct Create {
    /// The pool that its workers belong to
    #[arg(long)]
    pool: Option<String>,
    /// How long it is good
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = crate::config::span)]
    ttl: Duration,
    /// How many workers may join with it: more than one for groups that grow by themselves
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    uses: u32,
    /// Write it to a new file that only you can read, instead of printing it
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    server: ServerOption,
}

#[derive(Debug, clap::Args)]
struct List {
    /// Print JSON as the coordinator sends it
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

#[derive(Debug, clap::Args)]
struct Revoke {
    /// Which, as `list` names it
    id: String,
    #[command(flatten)]
    server: ServerOption,
}

impl JoinToken {
    /// Does it.
    pub(super) async fn run(self) -> Result<(), Error> {
        match self.action {
            JoinAction::Create(create) => create.run().await,
            JoinAction::List(list) => list.joins().await,
            JoinAction::Revoke(revoke) => {
                let client = revoke.server.client()?;
                let response = client.send(client.request(Method::DELETE, &format!("/join-tokens/{}", revoke.id))).await?;
                let revoked: JoinInfo = client.read(response).await?;
                terminal::line(format_args!("nobody joins with {} any more", revoked.id))
            }
        }
    }
}

impl Create {
    async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        if let Some(path) = self.output.as_ref().filter(|path| path.exists()) {
            return Err(Error::Usage(format!("{} is there already", path.display())));
        }
        let ttl_seconds = Some(u32::try_from(self.ttl.as_secs()).unwrap_or(u32::MAX));
        let asked = JoinRequest { pool: self.pool, uses: Some(self.uses), ttl_seconds };
        let response = client.send(client.request(Method::POST, "/join-tokens").json(&asked)).await?;
        let issued: JoinInfo = client.read(response).await?;
        let text = file(&issued).ok_or_else(|| Error::Failed("the coordinator sent no token".to_owned()))?;
        let Some(path) = &self.output else { return terminal::line(text.trim_end()) };
        let failed = |fault: PrivateFileError| Error::Write { path: fault.path, source: fault.source };
        write_private(path, text.as_bytes()).map_err(failed)?;
        terminal::line(format_args!("join token {} is in {}", issued.id, path.display()))
    }
}

/// The file that a worker joins with: the token, and the authority that it shall trust.
fn file(issued: &JoinInfo) -> Option<String> {
    let (token, authority) = (issued.token.as_ref()?, issued.authority.as_ref()?);
    let workers = if issued.left == 1 { "one worker".to_owned() } else { format!("{} workers", issued.left) };
    let pool = issued.pool.as_ref().map(|pool| format!(" of pool {pool}")).unwrap_or_default();
    let how = "gradfarm-worker --coordinator https://HOST:PORT --join THIS-FILE";
    Some(format!("# gradfarm join token for {workers}{pool}: {how}\n{}\n{authority}", token.expose()))
}

impl List {
    async fn joins(self) -> Result<(), Error> {
        let client = self.server.client()?;
        if self.json {
            return terminal::json(&client.get::<serde_json::Value>("/join-tokens").await?);
        }
        let all: JoinTokens = client.get("/join-tokens").await?;
        let now = Clock::new().now().millis();
        terminal::line(format_args!("{:12}  {:>6}  {:10}  {:16}  by", "join token", "left", "good", "pool"))?;
        for join in all.join_tokens {
            let good = if join.expires_ms <= now || join.left == 0 { "no more".to_owned() } else { span::tell(join.expires_ms - now) };
            let pool = join.pool.as_deref().unwrap_or("");
            terminal::line(format_args!("{:12}  {:>6}  {good:10}  {pool:16}  {}", join.id, join.left, join.issued_by))?;
        }
        Ok(())
    }

    async fn workers(self) -> Result<(), Error> {
        let client = self.server.client()?;
        if self.json {
            return terminal::json(&client.get::<serde_json::Value>("/enrolments").await?);
        }
        let all: EnrolledWorkers = client.get("/enrolments").await?;
        let now = Clock::new().now().millis();
        terminal::line(format_args!("{:36}  {:8}  {:>9}  {:16}  name", "worker", "state", "renewed", "pool"))?;
        for worker in all.workers {
            let state = if worker.revoked_ms.is_some() { "revoked" } else { "enrolled" };
            let renewed = span::tell(now - worker.renewed_ms.unwrap_or(worker.enrolled_ms));
            let pool = worker.pool.as_deref().unwrap_or("");
            terminal::line(format_args!("{:36}  {state:8}  {renewed:>9}  {pool:16}  {}", worker.id, worker.name))?;
        }
        Ok(())
    }
}

/// Arguments of `gradfarm worker`.
#[derive(Debug, clap::Args)]
pub(super) struct WorkerCommand {
    #[command(subcommand)]
    action: WorkerAction,
}

#[derive(Debug, clap::Subcommand)]
enum WorkerAction {
    /// List the workers that have joined
    List(List),
    /// Let a connected worker finish what it holds, and give it nothing new
    Drain(Connected),
    /// Give a worker work again
    Resume(Connected),
    /// Throw a worker out: its session ends, its certificate is worth nothing any more
    Revoke(Revoke),
}

/// A worker, connected or not.
#[derive(Debug, clap::Args)]
struct Connected {
    /// The worker, as the API lists it at /workers
    #[arg(value_name = "WORKER")]
    id: String,
    #[command(flatten)]
    server: ServerOption,
}

impl Connected {
    async fn ask(self, what: &str) -> Result<(), Error> {
        let client = self.server.client()?;
        let response = client.send(client.request(Method::POST, &format!("/workers/{}/{what}", self.id))).await?;
        let Workers { workers } = client.read(response).await?;
        let Some(worker) = workers.first() else { return terminal::line(format_args!("worker {} is not connected", self.id)) };
        let now = if worker.draining { format!("finishes the {} units it holds", worker.leases) } else { "gets work".to_owned() };
        terminal::line(format_args!("worker {} ({}) {now}", worker.id, worker.name))
    }
}

impl WorkerCommand {
    /// Does it.
    pub(super) async fn run(self) -> Result<(), Error> {
        match self.action {
            WorkerAction::List(list) => list.workers().await,
            WorkerAction::Drain(worker) => worker.ask("drain").await,
            WorkerAction::Resume(worker) => worker.ask("resume").await,
            WorkerAction::Revoke(revoke) => {
                let client = revoke.server.client()?;
                let response = client.send(client.request(Method::DELETE, &format!("/enrolments/{}", revoke.id))).await?;
                let revoked: EnrolledWorker = client.read(response).await?;
                terminal::line(format_args!("worker {} ({}) is revoked", revoked.id, revoked.name))
            }
        }
    }
}
