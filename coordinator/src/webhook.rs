//! Webhooks: tells a URL of the operator's that a job changed its state, signed as Standard Webhooks has it.
//!
//! The loop never waits for it: events wait in a short queue, and what does not fit is dropped and counted. Only the operator says where to; what
//! is sent are names, states and errors of jobs, and no answer is ever shown to anybody.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use hmac::{Hmac, Mac};
use reqwest::StatusCode;
use serde_json::json;
use sha2::Sha256;
use tokio::sync::mpsc;
use uuid::Uuid;

use crate::clock::Clock;
use crate::job::Job;
use crate::metrics::Metrics;

/// Events that wait at most.
const QUEUE: usize = 256;
/// How often an event is tried.
const TRIES: u32 = 8;
/// Shortest key [bytes].
const SHORTEST: usize = 16;

/// Where to, and how it is signed.
#[derive(Clone, Debug)]
pub struct Options {
    url: reqwest::Url,
    key: Key,
    /// How long a try may take.
    timeout: Duration,
    /// How long to wait before the second try; twice as long before each further one.
    wait: Duration,
}

/// What signatures are made with.
#[derive(Clone)]
struct Key(Vec<u8>);

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Key(…)")
    }
}

impl Options {
    /// Checks URL and secret: the latter is `whsec_` and base64, or any text.
    ///
    /// # Errors
    /// What is wrong with them, in words. The secret is not shown.
    pub fn new(url: &str, secret: &str) -> Result<Self, String> {
        let expected = "expected https://…, or http:// with an address of this machine";
        let url: reqwest::Url = url.parse().map_err(|fault| format!("webhook {url:?}: {fault}; {expected}"))?;
        let here = url.host_str().is_some_and(|host| {
            host == "localhost" || host.trim_matches(['[', ']']).parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback())
        });
        if url.scheme() != "https" && !(url.scheme() == "http" && here) {
            return Err(format!("webhook {:?} would be told in the clear; {expected}", url.as_str()));
        }
        let secret = secret.trim();
        let key = match secret.strip_prefix("whsec_") {
            Some(encoded) => STANDARD.decode(encoded).map_err(|_| "the webhook's secret is not base64 after whsec_".to_owned())?,
            None => secret.as_bytes().to_vec(),
        };
        if key.len() < SHORTEST {
            return Err(format!("the webhook's secret has {} bytes, expected {SHORTEST} or more", key.len()));
        }
        Ok(Self { url, key: Key(key), timeout: Duration::from_secs(10), wait: Duration::from_secs(1) })
    }

    /// The same with the secret in a file.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn read(url: &str, file: &Path) -> Result<Self, String> {
        let secret = std::fs::read_to_string(file).map_err(|fault| format!("webhook's secret {}: {fault}", file.display()))?;
        Self::new(url, &secret)
    }

    /// The same with other times.
    #[must_use]
    pub fn with_times(self, timeout: Duration, wait: Duration) -> Self {
        Self { timeout, wait, ..self }
    }
}

/// Something to tell.
struct Message {
    id: String,
    /// Seconds since 1970.
    timestamp: i64,
    body: String,
}

/// Takes events in and has them sent.
#[derive(Clone, Debug)]
pub(crate) struct Webhook {
    queue: mpsc::Sender<Message>,
    metrics: Arc<Metrics>,
}

impl Webhook {
    /// Starts the task that sends; it ends with the last copy of what is returned, after what it is at.
    pub(crate) fn start(options: Options, metrics: Arc<Metrics>) -> Self {
        let (queue, mut waiting) = mpsc::channel(QUEUE);
        let counted = metrics.clone();
        tokio::spawn(async move {
            while let Some(message) = waiting.recv().await {
                counted.webhook_queue.dec();
                let outcome = if send(&options, &message, &counted).await { "delivered" } else { "dropped" };
                counted.told(outcome);
            }
        });
        Self { queue, metrics }
    }

    /// A job has a new state. Does not wait.
    pub(crate) fn job(&self, job: &Job) {
        let now = Clock::new().now().millis();
        let data = json!({
            "job": job.record.id.to_string(), "name": job.record.name, "project": job.record.needs.project,
            "state": job.state.name(), "error": job.error,
        });
        let body = json!({ "type": "job.state", "timestamp_ms": now, "data": data }).to_string();
        let message = Message { id: format!("msg_{}", Uuid::now_v7()), timestamp: now / 1000, body };
        match self.queue.try_send(message) {
            Ok(()) => drop(self.metrics.webhook_queue.inc()),
            Err(_) => {
                tracing::warn!(job = %job.record.id, state = job.state.name(), "webhook dropped: too many wait");
                self.metrics.told("dropped");
            }
        }
    }
}

/// Sends until it was taken, or it is of no use to go on; whether it was taken.
async fn send(options: &Options, message: &Message, metrics: &Metrics) -> bool {
    let client = reqwest::Client::builder().timeout(options.timeout).redirect(reqwest::redirect::Policy::none()).build();
    let client = match client {
        Ok(client) => client,
        Err(fault) => {
            tracing::error!(%fault, "webhooks cannot be sent");
            return false;
        }
    };
    let signature = sign(&options.key, message);
    for tried in 1..=TRIES {
        let sent = client
            .post(options.url.clone())
            .header("content-type", "application/json")
            .header("webhook-id", &message.id)
            .header("webhook-timestamp", message.timestamp)
            .header("webhook-signature", &signature)
            .body(message.body.clone());
        let problem = match sent.send().await.map(|answer| answer.status()) {
            Ok(status) if status.is_success() => return true,
            Ok(status) if !worth_another_try(status) => {
                tracing::warn!(id = %message.id, %status, "webhook refused");
                return false;
            }
            Ok(status) => status.to_string(),
            Err(fault) => fault.without_url().to_string(),
        };
        if tried == TRIES {
            tracing::warn!(id = %message.id, %problem, "webhook given up");
            break;
        }
        tracing::debug!(id = %message.id, %problem, "webhook not taken, trying again");
        metrics.told("retried");
        tokio::time::sleep(options.wait * 2u32.pow(tried - 1)).await;
    }
    false
}

fn worth_another_try(status: StatusCode) -> bool {
    status.is_server_error() || [StatusCode::REQUEST_TIMEOUT, StatusCode::TOO_MANY_REQUESTS].contains(&status)
}

/// `v1,` and the signature of id, time and body.
fn sign(key: &Key, message: &Message) -> String {
    // A key may have any length.
    let Ok(mut mac) = Hmac::<Sha256>::new_from_slice(&key.0) else { return String::new() };
    mac.update(format!("{}.{}.{}", message.id, message.timestamp, message.body).as_bytes());
    format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::tests::record;
    use axum::Router;
    use axum::http::HeaderMap;
    use axum::routing::post;

    #[test]
    fn the_signature_is_that_of_the_specification() {
        // The example of the Standard Webhooks libraries.
        let options = Options::new("https://example.org/hook", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let body = r#"{"test": 2432232314}"#.to_owned();
        let message = Message { id: "msg_p5jXN8AQM9LWM0D4loKWxJek".into(), timestamp: 1_614_265_330, body };
        assert_eq!(sign(&options.key, &message), "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
        assert!(!format!("{options:?}").contains("MfKQ"));
    }

    #[test]
    fn nothing_is_told_in_the_clear_nor_signed_with_little() {
        let secret = "a secret of some length";
        for good in ["https://example.org/h", "http://127.0.0.1:1/h", "http://[::1]:1/h", "http://localhost/h"] {
            assert!(Options::new(good, secret).is_ok(), "{good}");
        }
        for bad in ["http://example.org/h", "ftp://127.0.0.1/", "file:///etc/passwd", "h", ""] {
            assert!(Options::new(bad, secret).unwrap_err().contains("expected https"), "{bad}");
        }
        assert!(Options::new("https://example.org", "short").is_err());
        assert!(Options::new("https://example.org", "whsec_?").is_err());
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn events_are_sent_again_until_they_are_taken_and_nobody_waits_for_them() {
        crate::crypto::provide();
        let (heard, mut hearing) = mpsc::unbounded_channel();
        let taken = move |headers: HeaderMap, body: String| {
            let heard = heard.clone();
            async move {
                let answer = if heard.send((headers, body)).is_ok() { StatusCode::OK } else { StatusCode::GONE };
                // The first one is not taken.
                static FIRST: std::sync::Once = std::sync::Once::new();
                let mut first = false;
                FIRST.call_once(|| first = true);
                if first { StatusCode::BAD_GATEWAY } else { answer }
            }
        };
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("http://{}/hook", listener.local_addr().unwrap());
        tokio::spawn(axum::serve(listener, Router::new().route("/hook", post(taken))).into_future());
        let options = Options::new(&url, "a secret of some length").unwrap();
        let options = options.with_times(Duration::from_secs(30), Duration::from_millis(5));
        let metrics = Arc::new(Metrics::default());
        let webhook = Webhook::start(options.clone(), metrics.clone());
        let (job, _) = crate::job::submit(record("told")).unwrap();
        for _ in 0..QUEUE + 50 {
            webhook.job(&job);
        }
        let mut ids = std::collections::BTreeMap::<String, u32>::new();
        while ids.len() < 20 {
            let (headers, body) = hearing.recv().await.unwrap();
            let of = |name: &str| headers[name].to_str().unwrap().to_owned();
            let message = Message { id: of("webhook-id"), timestamp: of("webhook-timestamp").parse().unwrap(), body };
            assert_eq!(of("webhook-signature"), sign(&options.key, &message));
            let told: serde_json::Value = serde_json::from_str(&message.body).unwrap();
            assert_eq!(
                (&told["type"], &told["data"]["state"], &told["data"]["name"]),
                (&"job.state".into(), &"queued".into(), &"told".into())
            );
            *ids.entry(message.id).or_insert(0) += 1;
        }
        assert_eq!(ids.values().filter(|count| **count == 2).count(), 1, "the one that was not taken: {ids:?}");
        let text = metrics.scrape(Default::default(), &Default::default()).await;
        assert!(text.contains("gradfarm_webhooks_total{outcome=\"retried\"} 1\n"), "{text}");
        assert!(!text.contains("gradfarm_webhooks_total{outcome=\"dropped\"} 0\n"), "they do not all fit: {text}");
    }
}
