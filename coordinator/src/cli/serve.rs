//! `gradfarm serve`: a coordinator that stays.

use std::io::{self, IsTerminal};
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use crate::embedded::settings;
use serde_json::json;
use tokio::sync::watch;

use super::error::Error;
use super::files::Target;
use super::terminal;
use crate::config::ServeConfig;
use crate::embedded::{self, Farm};
use crate::{access, api, service, telemetry, tls};

/// Arguments of `gradfarm serve`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Everything that was acknowledged survives a crash: start it again with the same --data and jobs go on. The addresses it got are \
printed and written to DIR/address.json. Nobody is let in without a token: DIR/token is the administrator's, DIR/worker-token that \
of workers on this machine, both readable by you alone; `gradfarm token create` issues others. Ctrl-C or SIGTERM stops it once what is under way is finished (within \
--drain), and a second one at once; running jobs go on at the next start, or at another coordinator. GRADFARM_LOG sets how \
much it tells, for example GRADFARM_LOG=debug.

Examples:
  gradfarm serve
  gradfarm-worker --coordinator http://127.0.0.1:7781        # as often as you like
  gradfarm serve --listen 127.0.0.1:0 --grpc 127.0.0.1:0 --data /tmp/farm --workers 2
  gradfarm serve --tls --listen 0.0.0.0:7700 --grpc 0.0.0.0:7781 --tls-name farm.example.org    # for other machines")]
pub(super) struct Serve {
    /// File of settings (TOML): every option is a key of the same name. Command line and environment go before it
    #[arg(id = "config", long = "config", value_name = "FILE", env = "GRADFARM_CONFIG")]
    file: Option<std::path::PathBuf>,
    /// Print an example of that file, with the defaults, and stop
    #[arg(long)]
    print_config: bool,
    #[command(flatten)]
    config: ServeConfig,
}

/// The name of this command, which takes a file of settings.
pub(super) const SERVE: &str = "serve";

/// How long requests under way may still take once the server was told to stop.
const FAREWELL: Duration = Duration::from_secs(5);

impl Serve {
    /// Serves until told to stop.
    pub(super) fn run(self) -> Result<(), Error> {
        if self.print_config {
            return terminal::line(settings::example(&super::definition_of(SERVE)).trim_end());
        }
        telemetry::start_as_told(&self.config.log, self.config.log_format).map_err(Error::Usage)?;
        super::runtime()?.block_on(serve(self.config))
    }
}

async fn serve(config: ServeConfig) -> Result<(), Error> {
    let failed = |fault: crate::error::Error| Error::Failed(fault.to_string());
    let webhook = config.webhook().map_err(Error::Usage)?;
    let tls = config.encryption().map_err(Error::Usage)?;
    let http = service::listen_beyond_loopback(config.listen).await.map_err(failed)?;
    let grpc = service::listen_beyond_loopback(config.grpc).await.map_err(failed)?;
    let address = http.local_addr().map_err(|fault| Error::Failed(fault.to_string()))?;
    let threads = embedded::threads(config.workers, config.threads);
    let service = service::Config {
        store: config.store.clone(),
        blobs: config.blobs.clone(),
        http: config.reached_at(address),
        grpc: config.reached_at(grpc.local_addr().map_err(|fault| Error::Failed(fault.to_string()))?),
        blob_grace: config.blob_grace,
        keep_jobs: config.keep_jobs,
        tls: tls.clone(),
        oidc: config.oidc.options(),
        rules: config.rules(),
        metrics_open: config.metrics_open,
        webhook,
        drain: config.drain,
        ..service::Config::new(&config.data)
    };
    let mut farm = Farm::start(service, grpc, &threads).await.map_err(failed)?;
    access::hand_out(farm.handle().gate(), &config.data).await.map_err(failed)?;
    announce(&config.data, address, farm.grpc(), tls.as_ref())?;

    let (stop, mut stopping) = watch::channel(false);
    let stopped = async move { drop(stopping.wait_for(|stop| *stop).await) };
    let mut server = tokio::spawn(api::serve(http, farm.handle(), stopped));
    let ended = tokio::select! {
        told = told_to_stop() => told,
        reason = farm.broken() => Err(Error::Failed(reason)),
        ended = &mut server => Err(Error::Failed(format!("the HTTP server ended: {ended:?}"))),
    };
    if ended.is_ok() {
        tracing::info!("stopping: finishing what is under way; a second signal ends it at once");
        tokio::spawn(async {
            if told_to_stop().await.is_ok() {
                std::process::exit(130);
            }
        });
        farm.drain(config.drain).await.map_err(failed)?;
    }
    stop.send_replace(true);
    // Streams of events end with the service; whoever still reads after that is not waited for.
    let farm = farm.stop().await;
    if !server.is_finished() && tokio::time::timeout(FAREWELL, &mut server).await.is_err() {
        server.abort();
    }
    ended.and(farm.map_err(failed))
}

/// Tells where the coordinator is, to people and to programs that let it choose the ports.
fn announce(data: &Path, http: SocketAddr, grpc: SocketAddr, tls: Option<&tls::Options>) -> Result<(), Error> {
    let [http, grpc] = [http, grpc].map(|address| embedded::url(address, tls.is_some()));
    // Whoever is on this machine trusts the authority that our certificate is of; another one they must be told of.
    let own = tls.filter(|options| options.given.is_none()).map(|options| std::path::absolute(options.authority.join("ca.pem")));
    let authority = own.and_then(Result::ok);
    let addresses = json!({ "http": http, "grpc": grpc, "authority": authority, "pid": std::process::id() });
    Target::check(&data.join("address.json"))?.write(format!("{addresses}\n").as_bytes())?;
    // With the token only where a person sees it: fragments are never sent, but output that is kept is read by others.
    let token = match io::stdout().is_terminal() {
        true => std::fs::read_to_string(data.join(access::ADMIN_TOKEN)).map(|token| format!("#token={}", token.trim())).unwrap_or_default(),
        false => String::new(),
    };
    terminal::line(format_args!("people   {http}/{token}"))?;
    terminal::line(format_args!("workers  gradfarm-worker --coordinator {grpc}{}", if tls.is_some() { " --join FILE" } else { "" }))?;
    terminal::line(format_args!(
        "tokens   {} and {}, for this user on this machine",
        data.join(access::ADMIN_TOKEN).display(),
        access::WORKER_TOKEN
    ))
}

/// Waits for Ctrl-C or SIGTERM.
async fn told_to_stop() -> Result<(), Error> {
    let no_signal = |fault: std::io::Error| Error::Failed(format!("cannot wait for signals: {fault}"));
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let mut terminate = signal(SignalKind::terminate()).map_err(no_signal)?;
        tokio::select! {
            told = tokio::signal::ctrl_c() => told.map_err(no_signal),
            _ = terminate.recv() => Ok(()),
        }
    }
    #[cfg(not(unix))]
    tokio::signal::ctrl_c().await.map_err(no_signal)
}
