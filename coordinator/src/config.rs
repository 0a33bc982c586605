//! How `gradfarm serve` is configured: command line over environment over defaults, checked before anything starts.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use crate::access::OidcOptions;
use crate::embedded;
use crate::service::{LimitRule, ProjectRule, Rules};
use crate::store::{BlobUri, StoreUri};
use crate::tls;

/// What a server is told.
#[derive(Clone, Debug, clap::Args)]
pub struct ServeConfig {
    /// Where to listen for people: HTTP, beyond loopback only with TLS; port 0 picks a free one
    #[arg(long, value_name = "ADDRESS", env = "GRADFARM_LISTEN", default_value = "127.0.0.1:7700", value_parser = address)]
    pub listen: SocketAddr,
    /// Where to listen for workers: gRPC, beyond loopback only with TLS; port 0 picks a free one
    #[arg(long, value_name = "ADDRESS", env = "GRADFARM_GRPC", default_value = "127.0.0.1:7781", value_parser = address)]
    pub grpc: SocketAddr,
    /// Folder for jobs, assets and images; made if it is not there
    #[arg(long, value_name = "DIR", env = "GRADFARM_DATA", default_value = "gradfarm-data")]
    pub data: PathBuf,
    /// Where to keep jobs: sqlite:PATH or postgres://USER:PASSWORD@HOST/DATABASE [default: a SQLite file in the data folder]
    #[arg(long, value_name = "URI", env = "GRADFARM_STORE", hide_env_values = true)]
    pub store: Option<StoreUri>,
    /// Where to keep assets, results and images: file:PATH or s3://BUCKET/PREFIX, the latter with endpoint, region and keys from the
    /// environment (AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY) [default: the folder blobs in the data folder]
    #[arg(long, value_name = "URI", env = "GRADFARM_BLOBS")]
    pub blobs: Option<BlobUri>,
    /// How long to keep bytes that no job needs any more, such as 30m or 1h; at least 5m
    #[arg(long, value_name = "TIME", env = "GRADFARM_BLOB_GRACE", default_value = "1h", value_parser = grace)]
    pub blob_grace: Duration,
    /// How long to keep jobs that are over and their images, such as 12h or 30d [default: for ever]
    #[arg(long, value_name = "TIME", env = "GRADFARM_KEEP_JOBS", value_parser = span)]
    pub keep_jobs: Option<Duration>,
    /// Weight of a project in sharing the farm, and its quota of leases: NAME=WEIGHT or NAME=WEIGHT/LEASES. Can be given more than once; projects without a
    /// rule weigh 1
    #[arg(long = "project", value_name = "NAME=WEIGHT", env = "GRADFARM_PROJECTS", value_delimiter = ',')]
    pub projects: Vec<ProjectRule>,
    /// A named limit, such as licence=20: at most so many leases at once of all jobs that name it. Can be given more than once
    #[arg(long = "limit", value_name = "NAME=LEASES", env = "GRADFARM_LIMITS", value_delimiter = ',')]
    pub limits: Vec<LimitRule>,
    /// Share of the units that are rendered by two workers and compared, 0 to 1, for jobs that do not ask for another one
    #[arg(long, value_name = "SHARE", env = "GRADFARM_VERIFY", default_value_t = 0.0, value_parser = share)]
    pub verify: f64,
    /// Workers to start in this process
    #[arg(long, value_name = "N", env = "GRADFARM_WORKERS", default_value_t = 0,
          value_parser = clap::value_parser!(u16).range(0..=i64::from(embedded::WORKERS_MOST)))]
    pub workers: u16,
    /// Rendering threads of each of them [default: the cores shared out]
    #[arg(long, value_name = "N", env = "GRADFARM_THREADS", value_parser = clap::value_parser!(u16).range(1..=i64::from(embedded::THREADS_MOST)))]
    pub threads: Option<u16>,
    /// Let anybody read the metrics, without a token: their numbers name no job, but tell how busy the farm is
    #[arg(long, env = "GRADFARM_METRICS_OPEN")]
    pub metrics_open: bool,
    /// How long to finish what is under way once it is told to stop, such as 30s; a second signal ends it at once
    #[arg(long, value_name = "TIME", env = "GRADFARM_DRAIN", default_value = "30s", value_parser = span)]
    pub drain: Duration,
    /// Tell this URL, signed, when jobs change their state: https://, or http:// on this machine
    #[arg(long, value_name = "URL", env = "GRADFARM_WEBHOOK", requires = "webhook_secret_file")]
    pub webhook: Option<String>,
    /// File with the secret of the webhook's signatures: whsec_ and base64, or any text
    #[arg(long, value_name = "FILE", env = "GRADFARM_WEBHOOK_SECRET_FILE", requires = "webhook")]
    pub webhook_secret_file: Option<PathBuf>,
    /// What to log: error, warn, info, debug or trace, or a list such as info,gradfarm=debug
    #[arg(long, value_name = "FILTER", env = "GRADFARM_LOG", default_value = "info")]
    pub log: String,
    /// How log lines look: text for people, json for programs
    #[arg(long, value_name = "FORMAT", env = "GRADFARM_LOG_FORMAT", default_value = "text")]
    pub log_format: crate::telemetry::Format,
    /// How both ports are encrypted.
    #[command(flatten)]
    pub tls: TlsConfig,
    /// Whose tokens are taken besides our own.
    #[command(flatten)]
    pub oidc: OidcConfig,
}

/// What a server is told about an identity provider.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Identity provider")]
pub struct OidcConfig {
    /// Take tokens of this identity provider (OpenID Connect), too: its address, as its tokens name it
    #[arg(long, value_name = "URL", env = "GRADFARM_OIDC_ISSUER", requires = "oidc_audience")]
    pub oidc_issuer: Option<String>,
    /// What its tokens for this farm are for
    #[arg(long, value_name = "NAME", env = "GRADFARM_OIDC_AUDIENCE", requires = "oidc_issuer")]
    pub oidc_audience: Option<String>,
    /// The claim of its tokens that names roles (admin or gradfarm-admin, and so on); dots step into objects
    #[arg(long, value_name = "CLAIM", env = "GRADFARM_OIDC_ROLES", default_value = "roles")]
    pub oidc_roles: String,
}

impl OidcConfig {
    /// The provider, if there is one.
    pub fn options(&self) -> Option<OidcOptions> {
        let (issuer, audience) = self.oidc_issuer.clone().zip(self.oidc_audience.clone())?;
        Some(OidcOptions { issuer, audience, role_claim: self.oidc_roles.clone() })
    }
}

/// What a server is told about encryption.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Encryption")]
pub struct TlsConfig {
    /// Encrypt both ports with a certificate of the farm's own authority; needed to listen beyond loopback
    #[arg(long, env = "GRADFARM_TLS")]
    pub tls: bool,
    /// A name or address under which the coordinator is reached from elsewhere, for that certificate; may be given several times
    #[arg(long, value_name = "NAME", env = "GRADFARM_TLS_NAME", value_delimiter = ',')]
    pub tls_name: Vec<String>,
    /// Encrypt both ports with this certificate (PEM) instead; read again when it changes
    #[arg(long, value_name = "FILE", env = "GRADFARM_TLS_CERT", requires = "tls_key")]
    pub tls_cert: Option<PathBuf>,
    /// The key of that certificate (PEM)
    #[arg(long, value_name = "FILE", env = "GRADFARM_TLS_KEY", requires = "tls_cert")]
    pub tls_key: Option<PathBuf>,
    /// Folder of the farm's own authority, which coordinators of one farm share; made if it is not there [default: authority in the data folder]
    #[arg(long, value_name = "DIR", env = "GRADFARM_AUTHORITY")]
    pub authority: Option<PathBuf>,
    /// Also take workers whose certificates are of this authority (PEM)
    #[arg(long, value_name = "FILE", env = "GRADFARM_CLIENT_CA")]
    pub client_ca: Option<PathBuf>,
    /// How long certificates of workers are good, such as 24h; they are renewed after two thirds of that [default: 24h]
    #[arg(long, value_name = "TIME", env = "GRADFARM_WORKER_CERTIFICATES", value_parser = span)]
    pub worker_certificates: Option<Duration>,
}

impl ServeConfig {
    /// How encryption is set up, if it is.
    ///
    /// # Errors
    /// If something listens beyond loopback without it, or it is asked for by halves.
    pub fn encryption(&self) -> Result<Option<tls::Options>, String> {
        let asked = &self.tls;
        if !asked.tls && asked.tls_cert.is_none() {
            if let Some(address) = [self.listen, self.grpc].into_iter().find(|address| !address.ip().is_loopback()) {
                return Err(format!(
                    "{address} can be reached from other machines, and without TLS everybody on the way could read along; \
                     add --tls, or use 127.0.0.1 or [::1]"
                ));
            }
            return match asked.client_ca {
                Some(_) => Err("--client-ca is about encrypted connections; add --tls, or --tls-cert and --tls-key".to_owned()),
                None => Ok(None),
            };
        }
        let mut names = asked.tls_name.clone();
        names
            .extend([self.listen, self.grpc].map(|address| address.ip()).iter().filter(|ip| !ip.is_unspecified()).map(ToString::to_string));
        let authority = asked.authority.clone().unwrap_or_else(|| self.data.join("authority"));
        let given = asked.tls_cert.clone().zip(asked.tls_key.clone());
        let usual = tls::Options::new(authority);
        let worker_ttl = asked.worker_certificates.unwrap_or(usual.worker_ttl);
        Ok(Some(tls::Options { names, given, client_authority: asked.client_ca.clone(), worker_ttl, ..usual }))
    }
}

impl ServeConfig {
    /// By which URL a listener is reached: from elsewhere by the first of the names that were given, where it listens everywhere.
    pub fn reached_at(&self, address: SocketAddr) -> String {
        let encrypted = self.tls.tls || self.tls.tls_cert.is_some();
        match self.tls.tls_name.first().filter(|_| address.ip().is_unspecified()) {
            Some(name) => format!("https://{name}:{}", address.port()),
            None => embedded::url(address, encrypted),
        }
    }
}

impl ServeConfig {
    /// Whom to tell that jobs change their state, if somebody.
    ///
    /// # Errors
    /// If URL or secret cannot be used.
    pub fn webhook(&self) -> Result<Option<crate::webhook::Options>, String> {
        let asked = self.webhook.as_ref().zip(self.webhook_secret_file.as_ref());
        asked.map(|(url, file)| crate::webhook::Options::read(url, file)).transpose()
    }

    /// What the operator decided about the farm as a whole.
    pub fn rules(&self) -> Rules {
        Rules::of(&self.projects, &self.limits, self.verify)
    }
}

/// A share of units.
///
/// # Errors
/// What is expected.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let share: Option<f64> = text.parse().ok();
    share.filter(|share| (0.0..=1.0).contains(share)).ok_or_else(|| "expected a share from 0 to 1, such as 0.01".to_owned())
}

/// An address and a port. Names are not resolved: what a name means can change after it was checked.
///
/// # Errors
/// What is expected.
fn address(text: &str) -> Result<SocketAddr, String> {
    let text = text.replacen("localhost:", "127.0.0.1:", 1);
    text.parse().map_err(|_| "expected an address and a port, such as 127.0.0.1:7700".to_owned())
}

/// A span of time: a whole number and its unit.
///
/// # Errors
/// If it is none.
pub(crate) fn span(text: &str) -> Result<Duration, String> {
    let units = [("ms", 1), ("s", 1_000), ("m", 60_000), ("h", 3_600_000), ("d", 86_400_000)];
    let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let millis = units.iter().find(|(name, _)| *name == unit).and_then(|(_, millis)| number.parse::<u64>().ok()?.checked_mul(*millis));
    millis.map(Duration::from_millis).ok_or_else(|| format!("{text:?} is no span of time, expected one such as 90s, 30m, 12h or 30d"))
}

/// Bytes are stored before the row that names them, and database and storage may each be away for a minute in between: what is removed
/// must be older than that by far.
const LEAST_GRACE: Duration = Duration::from_secs(300);

/// A span of time that is safe as a grace for bytes.
///
/// # Errors
/// If it is none, or too short.
fn grace(text: &str) -> Result<Duration, String> {
    let grace = span(text)?;
    if grace < LEAST_GRACE {
        return Err(format!("{text:?} is too short, expected 5m or more: what was just delivered is not named by any job yet"));
    }
    Ok(grace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        config: ServeConfig,
    }

    fn read(arguments: &[&str]) -> Result<Option<tls::Options>, String> {
        Line::parse_from([&["serve"], arguments].concat()).config.encryption()
    }

    #[test]
    fn bytes_are_kept_for_longer_than_a_database_may_be_away() {
        assert_eq!(grace("1h"), Ok(Duration::from_secs(3600)));
        for bad in ["0s", "299s", "1"] {
            assert!(grace(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn spans_have_a_unit() {
        assert_eq!(span("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(span("30d"), Ok(Duration::from_secs(30 * 86_400)));
        assert_eq!(span("250ms"), Ok(Duration::from_millis(250)));
        for bad in ["", "90", "s", "-1s", "1.5h", "1 h", "99999999999999999999d"] {
            assert!(span(bad).unwrap_err().contains("such as 90s"), "{bad}");
        }
    }

    #[test]
    fn beyond_loopback_there_is_tls_or_nothing() {
        for good in ["127.0.0.1:0", "127.0.0.2:80", "[::1]:7700", "localhost:1"] {
            assert_eq!(read(&["--listen", good]), Ok(None), "{good}");
        }
        for beyond in ["0.0.0.0:7700", "[::]:7700", "192.168.1.2:7700"] {
            for port in ["--listen", "--grpc"] {
                assert!(read(&[port, beyond]).unwrap_err().contains("--tls"), "{beyond}");
                assert!(read(&[port, beyond, "--tls"]).unwrap().is_some(), "{beyond}");
            }
        }
        for bad in ["7700", "example.org:80", ""] {
            assert!(address(bad).unwrap_err().contains("such as"), "{bad}");
        }
    }

    #[test]
    fn what_is_told_about_encryption_is_kept() {
        assert!(read(&["--client-ca", "a.pem"]).is_err());
        assert!(Line::try_parse_from(["serve", "--tls-cert", "a.pem"]).is_err());
        let own = read(&["--tls", "--data", "d", "--listen", "10.0.0.1:1", "--tls-name", "farm,10.1.1.1", "--worker-certificates", "2h"]);
        let own = own.unwrap().unwrap();
        assert_eq!(own.authority, PathBuf::from("d/authority"));
        assert_eq!(own.names, ["farm", "10.1.1.1", "10.0.0.1", "127.0.0.1"]);
        assert_eq!((own.worker_ttl.as_secs(), own.given), (7200, None));
        let given = read(&["--tls-cert", "c", "--tls-key", "k", "--authority", "a"]).unwrap().unwrap();
        assert_eq!((given.given, given.authority), (Some(("c".into(), "k".into())), "a".into()));
    }
}
