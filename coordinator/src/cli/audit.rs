//! `gradfarm audit`: who changed what.

use super::client::ServerOption;
use super::error::Error;
use super::{span, terminal};
use crate::api::audit::AuditPage;
use crate::clock::Clock;

/// Arguments of `gradfarm audit`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Every request that changes something is in the log, with those that were refused; nothing is ever taken out of it.

Examples:
  gradfarm audit
  gradfarm audit --limit 1000 --json | jq '.entries[] | select(.outcome >= \"400\")'")]
pub(super) struct AuditCommand {
    /// How many lines to show, newest first
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    /// Print JSON as the coordinator sends it
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    server: ServerOption,
}

impl AuditCommand {
    /// Asks and prints.
    pub(super) async fn run(self) -> Result<(), Error> {
        let client = self.server.client()?;
        let path = format!("/audit?limit={}", self.limit);
        if self.json {
            return terminal::json(&client.get::<serde_json::Value>(&path).await?);
        }
        let page: AuditPage = client.get(&path).await?;
        let now = Clock::new().now().millis();
        terminal::line(format_args!("{:>9}  {:24}  {:8}  what", "ago", "who", "outcome"))?;
        for entry in page.entries {
            terminal::line(format_args!("{:>9}  {:24}  {:8}  {}", span::tell(now - entry.at_ms), entry.who, entry.outcome, entry.what))?;
        }
        Ok(())
    }
}
