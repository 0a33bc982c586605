//! How `gradfarm serve` is configured: command line over environment over defaults, checked before anything starts.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use crate::embedded;
use crate::store::{BlobUri, StoreUri};

/// What a server is told.
#[derive(Clone, Debug, clap::Args)]
pub struct ServeConfig {
    /// Where to listen for people: HTTP, loopback only; port 0 picks a free one
    #[arg(long, value_name = "ADDRESS", env = "GRADFARM_LISTEN", default_value = "127.0.0.1:7700", value_parser = loopback)]
    pub listen: SocketAddr,
    /// Where to listen for workers: gRPC, loopback only; port 0 picks a free one
    #[arg(long, value_name = "ADDRESS", env = "GRADFARM_GRPC", default_value = "127.0.0.1:7781", value_parser = loopback)]
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
    /// Workers to start in this process
    #[arg(long, value_name = "N", env = "GRADFARM_WORKERS", default_value_t = 0,
          value_parser = clap::value_parser!(u16).range(0..=i64::from(embedded::WORKERS_MOST)))]
    pub workers: u16,
    /// Rendering threads of each of them [default: the cores shared out]
    #[arg(long, value_name = "N", env = "GRADFARM_THREADS", value_parser = clap::value_parser!(u16).range(1..=i64::from(embedded::THREADS_MOST)))]
    pub threads: Option<u16>,
}

/// An address of this machine only. Names are not resolved: what a name means can change after it was checked.
///
/// # Errors
/// Why not.
fn loopback(text: &str) -> Result<SocketAddr, String> {
    let text = text.replacen("localhost:", "127.0.0.1:", 1);
    let address: SocketAddr = text.parse().map_err(|_| "expected an address and a port, such as 127.0.0.1:7700".to_owned())?;
    if address.ip().is_loopback() {
        Ok(address)
    } else {
        Err("this address can be reached from other machines, and there is neither encryption nor authentication yet; \
             use 127.0.0.1 or [::1], and a tunnel (ssh -L) from elsewhere"
            .to_owned())
    }
}

/// A span of time: a whole number and its unit.
///
/// # Errors
/// If it is none.
fn span(text: &str) -> Result<Duration, String> {
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
    fn only_loopback_addresses_are_taken() {
        for good in ["127.0.0.1:0", "127.0.0.2:80", "[::1]:7700", "localhost:1"] {
            assert!(loopback(good).is_ok(), "{good}");
        }
        for bad in ["0.0.0.0:7700", "[::]:7700", "192.168.1.2:7700"] {
            assert!(loopback(bad).unwrap_err().contains("neither encryption nor authentication"), "{bad}");
        }
        for bad in ["7700", "example.org:80", ""] {
            assert!(loopback(bad).unwrap_err().contains("such as"), "{bad}");
        }
    }
}
