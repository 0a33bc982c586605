//! What the coordinator counts and measures: one table of all names, in the text format of OpenMetrics, which Prometheus reads.
//!
//! No label has values that somebody outside chooses without bound: routes are patterns, methods and pools are cut off. Each service has
//! counters of its own, so that several in one process do not mix.

mod count;
mod state;

use std::time::Duration;

use prometheus_client::encoding::text;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::registry::Registry;

use crate::job::{Ending, JobState};
pub(crate) use count::Ledger;
pub(crate) use state::{Snapshot, WorkerState};

/// Media type of the text.
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Names and values of labels.
pub(crate) type Labels<const N: usize> = [(&'static str, String); N];
/// A counter for each set of labels.
type Counters<const N: usize> = Family<Labels<N>, Counter>;
/// A gauge for each set of labels.
type Gauges<const N: usize> = Family<Labels<N>, Gauge>;
/// A histogram for each set of labels.
type Histograms<const N: usize> = Family<Labels<N>, Histogram, fn() -> Histogram>;
/// A gauge of seconds.
type Seconds = Gauge<f64, std::sync::atomic::AtomicU64>;

/// All that is counted and measured.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    /// Held while the state is written into the gauges and read from them.
    scrape: tokio::sync::Mutex<()>,
    draining: Gauge,
    jobs: Gauges<1>,
    jobs_submitted: Counter,
    jobs_finished: Counters<1>,
    units: Gauges<1>,
    queue_units: Gauge,
    queue_seconds: Seconds,
    grants: Counter,
    completions: Counter,
    retries: Counter,
    pub(crate) superseded: Counter,
    attempts: Counters<1>,
    given_up: Counter,
    pub(crate) disagreements: Counter,
    returned: Counter,
    lease_seconds: Histogram,
    oldest_lease: Seconds,
    render_seconds: Counter<f64, std::sync::atomic::AtomicU64>,
    store_commit: Histogram,
    store_changes: Counter,
    assembly: Histograms<1>,
    workers: Gauges<2>,
    worker_slots: Gauges<1>,
    pub(crate) connections: Counter,
    http_requests: Counters<3>,
    http_seconds: Histograms<1>,
    blob_written: Counter,
    blob_read: Counter,
    blobs: Gauge,
    blobs_bytes: Gauge,
    webhooks: Counters<1>,
    pub(crate) webhook_queue: Gauge,
}

/// A millisecond to 16 s.
fn short() -> Histogram {
    Histogram::new(exponential_buckets(0.001, 2.0, 15))
}

/// A hundredth of a second to 45 min.
fn long() -> Histogram {
    Histogram::new(exponential_buckets(0.01, 4.0, 10))
}

impl Default for Metrics {
    /// Everything at zero.
    fn default() -> Self {
        let constructor = |make: fn() -> Histogram| Histograms::new_with_constructor(make);
        let version: Gauges<1> = Family::default();
        version.get_or_create(&[("version", env!("CARGO_PKG_VERSION").to_owned())]).set(1);
        let mut own = Self {
            registry: Registry::default(),
            scrape: tokio::sync::Mutex::default(),
            draining: Gauge::default(),
            jobs: Family::default(),
            jobs_submitted: Counter::default(),
            jobs_finished: Family::default(),
            units: Family::default(),
            queue_units: Gauge::default(),
            queue_seconds: Gauge::default(),
            grants: Counter::default(),
            completions: Counter::default(),
            retries: Counter::default(),
            superseded: Counter::default(),
            attempts: Family::default(),
            given_up: Counter::default(),
            disagreements: Counter::default(),
            returned: Counter::default(),
            lease_seconds: long(),
            oldest_lease: Gauge::default(),
            render_seconds: Counter::default(),
            store_commit: short(),
            store_changes: Counter::default(),
            assembly: constructor(long),
            workers: Family::default(),
            worker_slots: Family::default(),
            connections: Counter::default(),
            http_requests: Family::default(),
            http_seconds: constructor(short),
            blob_written: Counter::default(),
            blob_read: Counter::default(),
            blobs: Gauge::default(),
            blobs_bytes: Gauge::default(),
            webhooks: Family::default(),
            webhook_queue: Gauge::default(),
        };
        let mut table = Registry::with_prefix("gradfarm");
        // The table. Names of counters end in `_total` when they are written.
        let t = &mut table;
        t.register("build_info", "1 for the version of the software", version);
        t.register("draining", "1 while the coordinator grants nothing because it is about to stop", own.draining.clone());
        t.register("jobs", "Jobs of this coordinator by state", own.jobs.clone());
        t.register("jobs_submitted", "Jobs accepted", own.jobs_submitted.clone());
        t.register("jobs_finished", "Jobs that ended, by state", own.jobs_finished.clone());
        t.register("units", "Units of jobs that are not over, by state", own.units.clone());
        t.register("queue_units", "Units that wait for a worker and could be granted now", own.queue_units.clone());
        t.register("queue_seconds", "Estimated rendering time of these on one thread [s]", own.queue_seconds.clone());
        t.register("grants", "Leases granted", own.grants.clone());
        t.register("completions", "Results that counted", own.completions.clone());
        t.register("retries", "Grants of units that had been granted before", own.retries.clone());
        t.register("superseded", "Results that came too late", own.superseded.clone());
        t.register("attempts", "Attempts at units that came to nothing, by their ending", own.attempts.clone());
        t.register("units_given_up", "Units given up", own.given_up.clone());
        t.register("verification_disagreements", "Results that others showed to be wrong", own.disagreements.clone());
        t.register("returned", "Leases that ended without a result", own.returned.clone());
        t.register("lease_seconds", "Age of leases when their result counted [s]", own.lease_seconds.clone());
        t.register("oldest_lease_seconds", "Age of the oldest lease that is held [s]", own.oldest_lease.clone());
        t.register("render_seconds", "Rendering time of the results that counted, on one thread [s]", own.render_seconds.clone());
        t.register("store_commit_seconds", "Time until changes of jobs were durable [s]", own.store_commit.clone());
        t.register("store_changes", "Changes of jobs made durable", own.store_changes.clone());
        t.register("assembly_seconds", "Time that frames, measurements, guides and window solves took [s]", own.assembly.clone());
        t.register("workers", "Connected workers by state and pool", own.workers.clone());
        t.register("worker_slots", "Rendering threads of the connected workers by pool", own.worker_slots.clone());
        t.register("worker_connections", "Streams that workers opened", own.connections.clone());
        t.register("http_requests", "HTTP requests by method, route and status", own.http_requests.clone());
        t.register("http_request_seconds", "Time until the answer begins, by route [s]", own.http_seconds.clone());
        t.register("blob_written_bytes", "Bytes put into the storage", own.blob_written.clone());
        t.register("blob_read_bytes", "Bytes read from the storage", own.blob_read.clone());
        t.register("blobs", "Contents in the storage, as this coordinator last swept it", own.blobs.clone());
        t.register("blobs_bytes", "Bytes in the storage, as this coordinator last swept it", own.blobs_bytes.clone());
        t.register("webhooks", "Posts of webhooks by outcome: delivered, retried, dropped", own.webhooks.clone());
        t.register("webhook_queue", "Events that wait to be posted", own.webhook_queue.clone());
        own.registry = table;
        // Zero is said, too: what appears only with its first event cannot be told from what is not there.
        let zero = |counters: &Counters<1>, label, value: &str| drop(counters.get_or_create(&[(label, value.to_owned())]));
        JobState::ALL.iter().filter(|state| state.is_final()).for_each(|state| zero(&own.jobs_finished, "state", state.name()));
        Ending::ALL.iter().for_each(|ending| zero(&own.attempts, "ending", ending.name()));
        ["delivered", "retried", "dropped"].iter().for_each(|outcome| zero(&own.webhooks, "outcome", outcome));
        for what in ["frame", "measure", "guide", "window"] {
            drop(own.assembly.get_or_create(&[("what", what.to_owned())]));
        }
        own
    }
}

impl Metrics {
    /// A frame, measurement, guide or window (`what`) was made in so long.
    pub(crate) fn assembled(&self, what: &str, took: Duration) {
        self.assembly.get_or_create(&[("what", what.to_owned())]).observe(took.as_secs_f64());
    }

    /// A commit of so many changes took so long.
    pub(crate) fn committed(&self, changes: usize, took: Duration) {
        self.store_commit.observe(took.as_secs_f64());
        self.store_changes.inc_by(changes as u64);
    }

    /// A request was answered. `route` is a pattern, or empty where nothing lives.
    pub(crate) fn answered(&self, method: &str, route: &str, status: u16, took: Duration) {
        let known = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"].contains(&method);
        let method = if known { method } else { "other" };
        let labels = [("method", method.to_owned()), ("route", route.to_owned()), ("status", status.to_string())];
        self.http_requests.get_or_create(&labels).inc();
        self.http_seconds.get_or_create(&[("route", route.to_owned())]).observe(took.as_secs_f64());
    }

    /// A webhook was `delivered`, `retried` or `dropped`.
    pub(crate) fn told(&self, outcome: &str) {
        self.webhooks.get_or_create(&[("outcome", outcome.to_owned())]).inc();
    }

    fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _written = text::encode(&mut text, &self.registry);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Traffic;

    #[tokio::test]
    async fn every_name_is_in_the_manual_and_has_a_help_text() {
        let metrics = Metrics::default();
        metrics.answered("BREW", "/jobs/{job}", 404, Duration::from_millis(3));
        let workers = vec![(WorkerState::Busy, String::new(), 2)];
        let text = metrics.scrape(Snapshot { workers, ..Snapshot::default() }, &Traffic::default()).await;
        let manual = include_str!("../../../docs/operating.md");
        let mut names = 0;
        for line in text.lines() {
            let Some((name, kind)) = line.strip_prefix("# TYPE ").and_then(|line| line.split_once(' ')) else { continue };
            let written = if kind == "counter" { format!("{name}_total") } else { name.to_owned() };
            assert!(manual.contains(&format!("`{written}`")), "{written} is not in docs/operating.md");
            assert!(text.contains(&format!("# HELP {name} ")), "{name}");
            names += 1;
        }
        assert_eq!(names, 33);
        assert!(text.contains(r#"gradfarm_http_requests_total{method="other",route="/jobs/{job}",status="404"} 1"#), "{text}");
        assert!(text.ends_with("# EOF\n"));
    }
}
