//! `gradfarm-worker`: a worker as a process of its own.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use gradfarm_worker::settings::{self, SettingsError};
use gradfarm_worker::{Config, Credential};
use tracing_subscriber::EnvFilter;

/// Renders for a gradfarm coordinator.
///
/// The worker opens one connection to the coordinator, asks for as many units of work as it has threads, renders them and sends the
/// results back. Nothing needs to reach the worker from outside. It keeps trying while the coordinator is away, and holds finished
/// results until they are acknowledged. Ctrl-C or SIGTERM makes it finish the units it is at (within --drain), hand the others back and
/// exit with code 0; a second signal stops it at once.
///
/// A worker on the coordinator's machine shows the token that the coordinator has put into its folder; started elsewhere than the
/// coordinator was, it needs --data or --token-file to find it. From another machine it joins with --join, over https://, and renews its
/// certificate by itself from then on.
///
/// Exit codes: 0 stopped as told, 1 something failed, 2 wrong usage.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = "Example: gradfarm-worker --coordinator http://127.0.0.1:7781 --threads 8")]
struct Arguments {
    /// File of settings (TOML): every option is a key of the same name. Command line and environment go before it.
    #[arg(long, value_name = "FILE", env = "GRADFARM_CONFIG")]
    config: Option<PathBuf>,
    /// Print an example of that file, with the defaults, and stop.
    #[arg(long)]
    print_config: bool,
    /// Where the coordinator listens for workers; several times, or with commas, for several coordinators of one farm.
    #[arg(long, value_name = "URL", env = "GRADFARM_COORDINATOR", value_delimiter = ',', default_value = "http://127.0.0.1:7781")]
    coordinator: Vec<String>,
    /// File with the worker's token; read again before every connection [default: DIR/worker-token of --data].
    #[arg(long, value_name = "FILE", env = "GRADFARM_TOKEN_FILE")]
    token_file: Option<PathBuf>,
    /// Join the farm with this file of `gradfarm join-token create`; needed once. The worker has a certificate from then on.
    #[arg(long, value_name = "FILE", env = "GRADFARM_JOIN")]
    join: Option<PathBuf>,
    /// Folder for the worker's key and certificate, one for each worker [default: gradfarm-worker in the user's state folder].
    #[arg(long, value_name = "DIR", env = "GRADFARM_STATE")]
    state: Option<PathBuf>,
    /// Authority (PEM) of the coordinator's certificate, if that is not the farm's own.
    #[arg(long, value_name = "FILE", env = "GRADFARM_CA")]
    ca: Option<PathBuf>,
    /// Certificate (PEM) of another authority that the coordinator trusts (its --client-ca), instead of joining.
    #[arg(long, value_name = "FILE", env = "GRADFARM_TLS_CERT", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// The key of that certificate (PEM).
    #[arg(long, value_name = "FILE", env = "GRADFARM_TLS_KEY", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// The coordinator's folder, where it is on this machine: the worker's token lies there.
    #[arg(long, value_name = "DIR", env = "GRADFARM_DATA", default_value = "gradfarm-data")]
    data: PathBuf,
    /// Rendering threads [default: one for each core].
    #[arg(long, value_name = "N", env = "GRADFARM_THREADS")]
    threads: Option<usize>,
    /// Folder for scenes and assets by content; several workers may share it [default: gradfarm in the user's cache folder].
    #[arg(long, value_name = "DIR", env = "GRADFARM_CACHE")]
    cache: Option<PathBuf>,
    /// Most room for that folder [GiB]; 0 keeps nothing on disk.
    #[arg(long, value_name = "GIB", env = "GRADFARM_CACHE_SIZE", default_value_t = 32)]
    cache_size: u32,
    /// Compiled scenes to keep in memory.
    #[arg(long, value_name = "N", default_value_t = 2)]
    scenes: usize,
    /// Pool that it belongs to; jobs may ask for workers of certain pools.
    #[arg(long, value_name = "NAME", env = "GRADFARM_POOL", default_value = "")]
    pool: String,
    /// What else it is, such as gpu or big; jobs may ask for it. Can be given more than once.
    #[arg(long = "tag", value_name = "NAME", env = "GRADFARM_TAGS", value_delimiter = ',')]
    tags: Vec<String>,
    /// Memory that it may use, such as 8G; jobs may ask for so much [default: that of this machine].
    #[arg(long, value_name = "SIZE", env = "GRADFARM_MEMORY", value_parser = memory)]
    memory: Option<u64>,
    /// Name for people [default: host name and process number].
    #[arg(long, value_name = "NAME", env = "GRADFARM_NAME")]
    name: Option<String>,
    /// Where to show metrics for Prometheus, such as 127.0.0.1:7790: without a token, so keep it on loopback or in a network that you trust.
    #[arg(long, value_name = "ADDRESS", env = "GRADFARM_METRICS")]
    metrics: Option<std::net::SocketAddr>,
    /// How long it may take to finish and deliver what it is at once it is told to stop, such as 30s; the rest is handed back.
    #[arg(long, value_name = "TIME", env = "GRADFARM_DRAIN", default_value = "30s", value_parser = span)]
    drain: std::time::Duration,
    /// What to log: error, warn, info, debug or trace, or a list such as info,gradfarm_worker=debug.
    #[arg(long, value_name = "FILTER", env = "GRADFARM_LOG", default_value = "info")]
    log: String,
    /// How log lines look: text for people, json for programs.
    #[arg(long, value_name = "FORMAT", env = "GRADFARM_LOG_FORMAT", default_value = "text")]
    log_format: LogFormat,
}

/// How log lines look.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum LogFormat {
    Text,
    Json,
}

#[tokio::main]
async fn main() -> ExitCode {
    let arguments = match settings::parse::<Arguments>(&Arguments::command(), None, std::env::args_os().collect()) {
        Ok(arguments) => arguments,
        Err(SettingsError::Arguments(error)) => error.exit(),
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    if arguments.print_config {
        return print(&settings::example(&Arguments::command()));
    }
    match start(arguments).await {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Prints a text; whoever reads it may have gone away.
fn print(text: &str) -> ExitCode {
    use std::io::Write;
    let _gone = std::io::stdout().write_all(text.as_bytes());
    ExitCode::SUCCESS
}

async fn start(arguments: Arguments) -> anyhow::Result<()> {
    let filter = EnvFilter::try_new(&arguments.log).map_err(|error| anyhow::anyhow!("log filter {:?}: {error}", arguments.log));
    let builder = tracing_subscriber::fmt().with_writer(std::io::stderr).with_ansi(std::io::stderr().is_terminal()).with_target(false);
    match (filter, arguments.log_format == LogFormat::Json) {
        (Ok(filter), false) => builder.with_env_filter(filter).init(),
        (Ok(filter), true) => builder.with_env_filter(filter).json().init(),
        (Err(error), _) => {
            builder.init();
            return Err(error);
        }
    }
    let threads = match arguments.threads {
        Some(threads) => threads,
        None => std::thread::available_parallelism()?.get(),
    };
    let credential = credential(&arguments)?;
    let mut coordinators = arguments.coordinator.into_iter();
    let first = coordinators.next().ok_or_else(|| anyhow::anyhow!("no coordinator is named"))?;
    let mut config = Config::new(first, arguments.name.unwrap_or_else(default_name), threads);
    (config.credential, config.authority) = (credential, arguments.ca);
    config.cache = (arguments.cache_size > 0).then(|| arguments.cache.or_else(default_cache)).flatten();
    config.cache_bytes = u64::from(arguments.cache_size) << 30;
    config.others = coordinators.collect();
    config.scenes = arguments.scenes;
    (config.pool, config.tags) = (arguments.pool, arguments.tags);
    (config.metrics, config.drain) = (arguments.metrics, arguments.drain);
    config.memory = arguments.memory.unwrap_or_else(memory_of_this_machine);
    tracing::info!(name = %config.name, threads, coordinator = %config.coordinator, others = ?config.others, cache = ?config.cache, "worker starts");
    let told = stop_signal()?;
    gradfarm_worker::run(config, told).await?;
    tracing::info!("worker stopped");
    Ok(())
}

/// A certificate where connections are encrypted, a token where they are not.
fn credential(arguments: &Arguments) -> anyhow::Result<Credential> {
    if let Some((certificate, key)) = arguments.tls_cert.clone().zip(arguments.tls_key.clone()) {
        return Ok(Credential::Certificate { certificate, key });
    }
    if let Some(path) = &arguments.token_file {
        return Ok(Credential::File(path.clone()));
    }
    if arguments.join.is_none() && !arguments.coordinator.iter().any(|url| url.starts_with("https://")) {
        return Ok(Credential::File(arguments.data.join("worker-token")));
    }
    let state = arguments.state.clone().or_else(default_state);
    let state = state.ok_or_else(|| anyhow::anyhow!("there is no home folder for the worker's certificate: --state names one"))?;
    Ok(Credential::Enrolment { join: arguments.join.clone(), state })
}

fn default_state() -> Option<PathBuf> {
    let base = std::env::var_os("XDG_STATE_HOME").map(PathBuf::from);
    base.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".local/state"))).map(|base| base.join("gradfarm-worker"))
}

/// An amount of memory: a whole number with K, M, G or T for powers of 1024, or nothing for bytes.
fn memory(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let power = match text[digits.len()..].to_ascii_uppercase().trim_end_matches("IB").trim_end_matches('B') {
        "" => 0,
        "K" => 1,
        "M" => 2,
        "G" => 3,
        "T" => 4,
        _ => return Err("expected a size such as 512M or 8G".to_owned()),
    };
    let amount: Option<u64> = digits.parse().ok();
    amount.and_then(|amount| amount.checked_mul(1 << (10 * power))).ok_or_else(|| "expected a size such as 512M or 8G".to_owned())
}

/// A span of time: a whole number with s, m or h.
fn span(text: &str) -> Result<std::time::Duration, String> {
    let seconds = [("s", 1), ("m", 60), ("h", 3600)].into_iter().find_map(|(unit, seconds)| {
        let number: u64 = text.strip_suffix(unit)?.parse().ok()?;
        number.checked_mul(seconds)
    });
    seconds.map(std::time::Duration::from_secs).ok_or_else(|| "expected a span of time such as 30s or 5m".to_owned())
}

/// All memory that there is, where the system tells [bytes]; else 0.
fn memory_of_this_machine() -> u64 {
    let told = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = told.lines().find_map(|line| line.strip_prefix("MemTotal:")?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
    line.unwrap_or(0) << 10
}

fn default_name() -> String {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("HOSTNAME").ok());
    format!("{}-{}", host.as_deref().map_or("worker", str::trim), std::process::id())
}

fn default_cache() -> Option<PathBuf> {
    let base = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    base.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache"))).map(|base| base.join("gradfarm"))
}

/// Ready when the worker is told to stop; a second signal ends the process.
fn stop_signal() -> std::io::Result<impl Future<Output = ()> + Send> {
    #[cfg(unix)]
    let mut terminate = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?;
    Ok(async move {
        #[cfg(unix)]
        let mut told = async move || {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = terminate.recv() => {}
            }
        };
        #[cfg(not(unix))]
        let mut told = async || drop(tokio::signal::ctrl_c().await);
        told().await;
        tokio::spawn(async move {
            told().await;
            std::process::exit(130);
        });
    })
}
