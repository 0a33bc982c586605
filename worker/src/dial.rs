//! Connections to the coordinator: what they show, whom they trust, and new ones whenever the certificate is new.

use std::sync::{Arc, PoisonError, RwLock};
use std::time::Duration;

use gradfarm_proto::v1::farm_client::FarmClient;
use gradfarm_proto::{COORDINATOR_NAME, limits};
use tokio::sync::watch;
use tonic::Status;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};

use crate::credential::{Bearer, Credential};
use crate::error::Error;
use crate::papers::Papers;

/// How often a silent connection is asked whether it still lives, and how long it may take to answer.
const KEEP_ALIVE: (Duration, Duration) = (Duration::from_secs(5), Duration::from_secs(10));

/// Speaks to the coordinator.
pub(crate) type Client = FarmClient<InterceptedService<Channel, Bearer>>;

/// By what a coordinator is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Trust {
    /// By nothing: only without encryption.
    Nobody,
    /// By a certificate of the farm's own authority (PEM), wherever it is.
    Farm(String),
    /// By a certificate of another authority (PEM), for the host that is called.
    Host(String),
}

/// Makes connections.
#[derive(Clone, Debug)]
pub(crate) struct Dial {
    url: Arc<str>,
    trust: Arc<Trust>,
    bearer: Bearer,
    papers: Arc<RwLock<Option<Papers>>>,
    /// For results and assets: shared by all who send or fetch, with the count of certificates when it was made.
    shared: Arc<RwLock<Option<(u64, Client)>>>,
    /// Counts certificates, for all coordinators.
    shown: watch::Sender<u64>,
}

impl Dial {
    /// Nothing is sent yet.
    ///
    /// # Errors
    /// If the address is none, or papers or authority cannot be used.
    pub(crate) fn new(url: &str, credential: Credential, papers: Option<Papers>, trust: Trust) -> Result<Self, Error> {
        let (papers, shown) = (Arc::new(RwLock::new(papers)), watch::Sender::new(0));
        let dial = Self { url: url.into(), trust: trust.into(), bearer: Bearer::new(credential), papers, shared: Arc::default(), shown };
        dial.channel()?;
        Ok(dial)
    }

    /// The same for another coordinator of the farm.
    ///
    /// # Errors
    /// If the address is none.
    pub(crate) fn to(&self, url: &str) -> Result<Self, Error> {
        let dial = Self { url: url.into(), shared: Arc::default(), ..self.clone() };
        dial.channel()?;
        Ok(dial)
    }

    /// The coordinator's address.
    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    /// The connection that all share, opened when it is first used and again whenever it broke.
    ///
    /// # Errors
    /// If there are new papers, and they cannot be used.
    pub(crate) fn client(&self) -> Result<Client, Status> {
        let now = *self.shown.borrow();
        if let Some((_, client)) = self.shared.read().unwrap_or_else(PoisonError::into_inner).as_ref().filter(|(made, _)| *made == now) {
            return Ok(client.clone());
        }
        let client = self.connect().map_err(|fault| Status::unavailable(fault.to_string()))?;
        *self.shared.write().unwrap_or_else(PoisonError::into_inner) = Some((now, client.clone()));
        Ok(client)
    }

    /// A connection of its own.
    ///
    /// # Errors
    /// If the address is none, or papers or authority cannot be used.
    pub(crate) fn connect(&self) -> Result<Client, Error> {
        let client = FarmClient::with_interceptor(self.channel()?, self.bearer.clone());
        Ok(client.max_decoding_message_size(limits::MESSAGE).max_encoding_message_size(limits::MESSAGE))
    }

    /// The same without the farm's own protocol.
    ///
    /// # Errors
    /// As [`connect`](Self::connect).
    pub(crate) fn channel(&self) -> Result<Channel, Error> {
        let wrong = |reason: String| Error::Coordinator { url: self.url.to_string(), reason };
        let endpoint = Endpoint::from_shared(self.url.to_string()).map_err(|fault| wrong(format!("not an address: {fault}")))?;
        let endpoint = endpoint
            .initial_stream_window_size(limits::WINDOWS.0)
            .initial_connection_window_size(limits::WINDOWS.1)
            .http2_keep_alive_interval(KEEP_ALIVE.0)
            .keep_alive_timeout(KEEP_ALIVE.1)
            .keep_alive_while_idle(true)
            .connect_timeout(KEEP_ALIVE.1)
            .tcp_nodelay(true);
        let tls = match &*self.trust {
            Trust::Nobody => return Ok(endpoint.connect_lazy()),
            Trust::Farm(authority) => ClientTlsConfig::new().ca_certificate(Certificate::from_pem(authority)).domain_name(COORDINATOR_NAME),
            Trust::Host(authority) => ClientTlsConfig::new().ca_certificate(Certificate::from_pem(authority)),
        };
        let papers = self.papers.read().unwrap_or_else(PoisonError::into_inner).clone();
        let tls = match papers {
            Some(papers) => tls.identity(Identity::from_pem(papers.certificate, papers.key)),
            None => tls,
        };
        let endpoint = endpoint.tls_config(tls).map_err(|fault| wrong(format!("certificate or authority: {fault}")))?;
        Ok(endpoint.connect_lazy())
    }

    /// Shows new papers to all coordinators from now on: open calls end on the connections that they are on.
    pub(crate) fn show(&self, papers: Papers) {
        *self.papers.write().unwrap_or_else(PoisonError::into_inner) = Some(papers);
        self.shown.send_modify(|count| *count += 1);
    }

    /// Tells when there are new papers.
    pub(crate) fn watch(&self) -> watch::Receiver<u64> {
        self.shown.subscribe()
    }

    /// Reads the token again, if there is one.
    pub(crate) fn refresh(&self) {
        self.bearer.refresh();
    }
}
