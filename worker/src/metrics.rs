//! What the worker counts and measures: one table of all names, in the text format of OpenMetrics, which Prometheus reads, and the small
//! server that shows it.

use std::future::{Future, IntoFuture};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use axum::Router;
use axum::http::header;
use axum::routing::get;
use prometheus_client::encoding::text;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use tokio::net::TcpListener;

use crate::error::Error;

/// Media type of the text.
const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Counters by one label.
type Counters = Family<[(&'static str, &'static str); 1], Counter>;

/// All that is counted and measured.
#[derive(Debug)]
pub(crate) struct Metrics {
    registry: Registry,
    pub(crate) threads: Gauge,
    pub(crate) rendering: Gauge,
    pub(crate) spooled: Gauge,
    pub(crate) connected: Gauge,
    pub(crate) draining: Gauge,
    units: Counters,
    samples: Counter,
    render_seconds: Counter<f64, AtomicU64>,
    deliveries: Counters,
    pub(crate) delivery_retries: Counter,
    assets: Counters,
    asset_bytes: Counters,
    scenes: Counter,
    scene_seconds: Counter<f64, AtomicU64>,
}

impl Default for Metrics {
    /// Everything at zero.
    fn default() -> Self {
        let version: Family<[(&'static str, &'static str); 1], Gauge> = Family::default();
        version.get_or_create(&[("version", env!("CARGO_PKG_VERSION"))]).set(1);
        let mut own = Self {
            registry: Registry::default(),
            threads: Gauge::default(),
            rendering: Gauge::default(),
            spooled: Gauge::default(),
            connected: Gauge::default(),
            draining: Gauge::default(),
            units: Family::default(),
            samples: Counter::default(),
            render_seconds: Counter::default(),
            deliveries: Family::default(),
            delivery_retries: Counter::default(),
            assets: Family::default(),
            asset_bytes: Family::default(),
            scenes: Counter::default(),
            scene_seconds: Counter::default(),
        };
        let mut table = Registry::with_prefix("gradfarm_worker");
        // The table. Names of counters end in `_total` when they are written.
        let t = &mut table;
        t.register("build_info", "1 for the version of the software", version);
        t.register("threads", "Rendering threads", own.threads.clone());
        t.register("rendering", "Units that are being rendered", own.rendering.clone());
        t.register("spooled_results", "Finished results that no coordinator has acknowledged yet", own.spooled.clone());
        t.register("connected", "Coordinators that it is connected to", own.connected.clone());
        t.register("draining", "1 while it takes nothing more and is about to stop", own.draining.clone());
        t.register("units", "Units by outcome: rendered, failed, stopped", own.units.clone());
        t.register("samples", "Camera samples of units that were rendered", own.samples.clone());
        t.register("render_seconds", "Rendering time, on one thread [s]", own.render_seconds.clone());
        t.register("deliveries", "Results by the coordinator's answer: accepted, superseded, refused", own.deliveries.clone());
        t.register("delivery_retries", "Tries to deliver a result that got no answer", own.delivery_retries.clone());
        t.register("assets", "Assets read, by source: cache, coordinator", own.assets.clone());
        t.register("asset_bytes", "Their bytes", own.asset_bytes.clone());
        t.register("scenes", "Scenes made ready", own.scenes.clone());
        t.register("scene_seconds", "Time of loading and compiling them [s]", own.scene_seconds.clone());
        own.registry = table;
        // Zero is said, too: what appears only with its first event cannot be told from what is not there.
        let zero = |counters: &Counters, label, values: &[&'static str]| {
            values.iter().for_each(|value| drop(counters.get_or_create(&[(label, *value)])));
        };
        zero(&own.units, "outcome", &["rendered", "failed", "stopped"]);
        zero(&own.deliveries, "outcome", &["accepted", "superseded", "refused"]);
        zero(&own.assets, "source", &["cache", "coordinator"]);
        zero(&own.asset_bytes, "source", &["cache", "coordinator"]);
        own
    }
}

impl Metrics {
    /// A rendering thread is through with a unit after so long.
    pub(crate) fn unit(&self, outcome: &'static str, samples: u64, seconds: f64) {
        self.units.get_or_create(&[("outcome", outcome)]).inc();
        if outcome == "rendered" {
            self.samples.inc_by(samples);
        }
        self.render_seconds.inc_by(seconds);
    }

    /// The coordinator answered a delivery.
    pub(crate) fn delivered(&self, outcome: &'static str) {
        self.deliveries.get_or_create(&[("outcome", outcome)]).inc();
    }

    /// An asset was read.
    pub(crate) fn asset(&self, source: &'static str, bytes: usize) {
        self.assets.get_or_create(&[("source", source)]).inc();
        self.asset_bytes.get_or_create(&[("source", source)]).inc_by(bytes as u64);
    }

    /// A scene was made ready.
    pub(crate) fn scene(&self, seconds: f64) {
        self.scenes.inc();
        self.scene_seconds.inc_by(seconds);
    }

    fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _written = text::encode(&mut text, &self.registry);
        text
    }
}

/// Something that a gauge counts for as long as it lives.
#[derive(Debug)]
pub(crate) struct Counted(Gauge);

impl Counted {
    /// One more.
    pub(crate) fn new(gauge: &Gauge) -> Self {
        gauge.inc();
        Self(gauge.clone())
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Binds the address and shows the metrics there, until the future it returns is dropped.
///
/// # Errors
/// If the address cannot be bound.
pub(crate) async fn serve(address: SocketAddr, metrics: Arc<Metrics>) -> Result<impl Future<Output = std::io::Result<()>>, Error> {
    let io = |source| Error::Io { what: format!("address {address} for metrics"), source };
    let listener = TcpListener::bind(address).await.map_err(io)?;
    let bound = listener.local_addr().map_err(io)?;
    tracing::info!(url = %format!("http://{bound}/metrics"), "metrics");
    let show = move || {
        let text = metrics.text();
        async move { ([(header::CONTENT_TYPE, MEDIA_TYPE)], text) }
    };
    Ok(axum::serve(listener, Router::new().route("/metrics", get(show))).into_future())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_in_the_manual() {
        let text = Metrics::default().text();
        let manual = include_str!("../../docs/operating.md");
        let mut names = 0;
        for (name, kind) in text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split_once(' ')) {
            let written = if kind == "counter" { format!("{name}_total") } else { name.to_owned() };
            assert!(manual.contains(&format!("`{written}`")), "{written} is not in docs/operating.md");
            names += 1;
        }
        assert_eq!(names, 15);
    }
}
