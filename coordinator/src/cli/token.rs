//! `gradfarm token`: issues, lists and revokes tokens.

use std::path::PathBuf;

use reqwest::Method;

use super::client::{Client, ServerOption};
use super::error::Error;
use super::{span, terminal};
use crate::access::{Role, write_private};
use crate::api::tokens::{TokenInfo, TokenRequest, Tokens};
use crate::clock::Clock;

/// Arguments of `gradfarm token`.
#[derive(Debug, clap::Args)]
pub(super) struct TokenCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Issue a token
    Create(Create),
    /// List the tokens
    List(List),
    /// Take a token back
    Revoke(Revoke),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The token is shown this once: what is kept of it is a hash. Give it to its user as a file of mode 0600, who names it with --token-file, \
or sets GRADFARM_TOKEN.

Examples:
  gradfarm token create --name anna --role submitter --ttl 90d -o anna.token
  gradfarm token create --name dashboard --role viewer")]
struct Create {
    /// Whose it is, or what it is for
    #[arg(long)]
    name: String,
    /// What it allows: viewer, submitter, operator, admin; or worker, over the workers' port of the coordinator's machine
    #[arg(long)]
    role: Role,
    /// How long it is good, such as 12h or 90d [default: until it is revoked]
    #[arg(long, value_name = "TIME", value_parser = crate::config::span)]
    ttl: Option<std::time::Duration>,
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
    /// The token, as `token list` names it
    id: String,
    #[command(flatten)]
    server: ServerOption,
}

impl TokenCommand {
    /// Does it.
    pub(super) async fn run(self) -> Result<(), Error> {
        match self.action {
            Action::Create(create) => create.run().await,
            Action::List(list) => list.run().await,
            Action::Revoke(revoke) => revoke.run().await,
        }
    }
}

impl Create {
    async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        let ttl_seconds = self.ttl.map(|ttl| u32::try_from(ttl.as_secs()).unwrap_or(u32::MAX));
        let asked = TokenRequest { name: self.name, role: self.role, projects: Vec::new(), ttl_seconds };
        if let Some(path) = self.output.as_ref().filter(|path| path.exists()) {
            return Err(Error::Usage(format!("{} is there already", path.display())));
        }
        let response = client.send(client.request(Method::POST, "/tokens").json(&asked)).await?;
        let issued: TokenInfo = client.read(response).await?;
        let token = issued.token.ok_or_else(|| Error::Failed("the coordinator sent no token".to_owned()))?;
        match &self.output {
            None => terminal::line(token.expose()),
            Some(path) => {
                let failed = |fault: crate::access::PrivateFileError| Error::Write { path: fault.path, source: fault.source };
                write_private(path, format!("{}\n", token.expose()).as_bytes()).map_err(failed)?;
                terminal::line(format_args!("token {} of {} ({}) is in {}", issued.id, issued.name, issued.role, path.display()))
            }
        }
    }
}

impl List {
    async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        if self.json {
            return terminal::json(&client.get::<serde_json::Value>("/tokens").await?);
        }
        let all: Tokens = client.get("/tokens").await?;
        let now = Clock::new().now().millis();
        terminal::line(format_args!("{:12}  {:9}  {:10}  {:>9}  {:>9}  name", "token", "role", "state", "age", "used"))?;
        for token in all.tokens {
            let state = match (token.revoked_ms, token.expires_ms) {
                (Some(_), _) => "revoked".to_owned(),
                (None, Some(end)) if end <= now => "expired".to_owned(),
                (None, Some(end)) => format!("for {}", span::tell(end - now)),
                (None, None) => "good".to_owned(),
            };
            let used = token.used_ms.map_or("never".to_owned(), |used| span::tell(now - used));
            let projects = if token.projects.is_empty() { String::new() } else { format!(" ({})", token.projects.join(", ")) };
            let age = span::tell(now - token.created_ms);
            let role = token.role.name();
            terminal::line(format_args!("{:12}  {role:9}  {state:10}  {age:>9}  {used:>9}  {}{projects}", token.id, token.name))?;
        }
        Ok(())
    }
}

impl Revoke {
    async fn run(self) -> Result<(), Error> {
        let client: Client = self.server.client()?;
        let response = client.send(client.request(Method::DELETE, &format!("/tokens/{}", self.id))).await?;
        let revoked: TokenInfo = client.read(response).await?;
        terminal::line(format_args!("revoked {} of {}", revoked.id, revoked.name))
    }
}
