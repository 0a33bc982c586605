//! The stream to the coordinator: opens it, and opens it again whenever it breaks.

use std::time::Duration;

use gradfarm_proto::v1::farm_client::FarmClient;
use gradfarm_proto::{limits, v1};
use tokio::sync::{mpsc, oneshot};
use tokio_stream::wrappers::ReceiverStream;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Status};

use crate::backoff::Backoff;
use crate::credential::Bearer;
use crate::error::Error;

/// How often a silent connection is asked whether it still lives, and how long it may take to answer.
const KEEP_ALIVE: (Duration, Duration) = (Duration::from_secs(5), Duration::from_secs(10));
/// Messages that may wait to be sent.
const OUTBOX: usize = 256;

/// Speaks to the coordinator.
pub(crate) type Client = FarmClient<InterceptedService<Channel, Bearer>>;

/// What the link tells the loop.
pub(crate) enum News {
    /// The coordinator is about to be greeted: with what?
    Greeting(oneshot::Sender<v1::Hello>),
    /// The stream is open.
    Up(mpsc::Sender<v1::WorkerMessage>),
    /// The coordinator says something.
    Message(v1::coordinator_message::Message),
    /// The stream broke.
    Down,
    /// The coordinator refuses this worker for good.
    Refused(Error),
}

/// A client over a connection of its own, opened when it is first used and again whenever it broke.
///
/// # Errors
/// If the address is none.
pub(crate) fn client(url: &str, bearer: Bearer) -> Result<Client, Error> {
    let wrong = |error: tonic::transport::Error| Error::Coordinator { url: url.to_owned(), reason: format!("not an address: {error}") };
    let endpoint = Endpoint::from_shared(url.to_owned()).map_err(wrong)?;
    let channel = endpoint
        .initial_stream_window_size(limits::WINDOWS.0)
        .initial_connection_window_size(limits::WINDOWS.1)
        .http2_keep_alive_interval(KEEP_ALIVE.0)
        .keep_alive_timeout(KEEP_ALIVE.1)
        .keep_alive_while_idle(true)
        .connect_timeout(KEEP_ALIVE.1)
        .tcp_nodelay(true)
        .connect_lazy();
    Ok(FarmClient::with_interceptor(channel, bearer).max_decoding_message_size(limits::MESSAGE).max_encoding_message_size(limits::MESSAGE))
}

/// Keeps the stream open until the loop is gone or the coordinator refuses the worker.
pub(crate) async fn keep(url: String, client: Client, bearer: Bearer, news: mpsc::Sender<News>) {
    let mut backoff = Backoff::new();
    // Whether somebody was told of this outage.
    let mut told = false;
    loop {
        bearer.refresh();
        let Err(status) = open(client.clone(), &news, &mut backoff, &mut told).await else { return };
        if news.send(News::Down).await.is_err() {
            return;
        }
        if matches!(status.code(), Code::FailedPrecondition | Code::InvalidArgument | Code::Unimplemented | Code::PermissionDenied) {
            // If the loop is gone there is nobody to tell.
            let _gone = news.send(News::Refused(Error::Coordinator { url, reason: status.message().to_owned() })).await;
            return;
        }
        if told {
            tracing::debug!(problem = status.message(), "coordinator away");
        } else {
            tracing::warn!(%url, problem = status.message(), "coordinator away, trying again");
            told = true;
        }
        tokio::time::sleep(backoff.wait()).await;
    }
}

/// Opens the stream once and reads it to its end. `Ok` if the loop is gone.
async fn open(mut client: Client, news: &mpsc::Sender<News>, backoff: &mut Backoff, told: &mut bool) -> Result<(), Status> {
    let (ask, answer) = oneshot::channel();
    if news.send(News::Greeting(ask)).await.is_err() {
        return Ok(());
    }
    let Ok(hello) = answer.await else { return Ok(()) };
    let (outbox, messages) = mpsc::channel(OUTBOX);
    let first = v1::WorkerMessage { message: Some(v1::worker_message::Message::Hello(hello)) };
    if outbox.send(first).await.is_err() {
        return Ok(());
    }
    let mut inbox = client.work(ReceiverStream::new(messages)).await?.into_inner();
    backoff.reset();
    *told = false;
    if news.send(News::Up(outbox)).await.is_err() {
        return Ok(());
    }
    while let Some(message) = inbox.message().await? {
        // A message without content comes from a newer coordinator.
        if let Some(message) = message.message
            && news.send(News::Message(message)).await.is_err()
        {
            return Ok(());
        }
    }
    Err(Status::unavailable("the coordinator closed the stream"))
}
