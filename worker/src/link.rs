//! The stream to the coordinator: opens it, and opens it again whenever it breaks.

use std::error::Error as _;

use gradfarm_proto::v1;
use tokio::sync::{mpsc, oneshot};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status};

use crate::backoff::Backoff;
use crate::dial::Dial;
use crate::error::Error;

/// Messages that may wait to be sent.
const OUTBOX: usize = 256;

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

/// Keeps the stream open until the loop is gone or the coordinator refuses the worker.
pub(crate) async fn keep(dial: Dial, news: mpsc::Sender<News>) {
    let url = dial.url().to_owned();
    let mut backoff = Backoff::new();
    // Whether somebody was told of this outage.
    let mut told = false;
    loop {
        dial.refresh();
        let status = match open(&dial, &news, &mut backoff, &mut told).await {
            Ok(Ended::Unheard) => return,
            Ok(Ended::Renewed) => None,
            Err(status) => Some(status),
        };
        if news.send(News::Down).await.is_err() {
            return;
        }
        let Some(status) = status else { continue };
        if matches!(status.code(), Code::FailedPrecondition | Code::InvalidArgument | Code::Unimplemented | Code::PermissionDenied) {
            // If the loop is gone there is nobody to tell.
            let _gone = news.send(News::Refused(Error::Coordinator { url, reason: status.message().to_owned() })).await;
            return;
        }
        if told {
            tracing::debug!(problem = %cause(&status), "coordinator away");
        } else {
            tracing::warn!(%url, problem = %cause(&status), "coordinator away, trying again");
            told = true;
        }
        tokio::time::sleep(backoff.wait()).await;
    }
}

/// Why a stream ended that did not break.
enum Ended {
    /// The loop is gone.
    Unheard,
    /// There is a new certificate, to be shown on a new connection.
    Renewed,
}

/// What went wrong in words: where a connection could not be made, what the system or TLS said of it.
pub(crate) fn cause(status: &Status) -> String {
    let mut deepest: Option<&dyn std::error::Error> = status.source();
    while let Some(deeper) = deepest.and_then(|fault| fault.source()) {
        deepest = Some(deeper);
    }
    deepest.map_or_else(|| status.message().to_owned(), |fault| format!("{}: {fault}", status.message()))
}

/// Opens the stream once and reads it to its end.
async fn open(dial: &Dial, news: &mpsc::Sender<News>, backoff: &mut Backoff, told: &mut bool) -> Result<Ended, Status> {
    let mut renewed = dial.watch();
    let mut client = dial.connect().map_err(|fault| Status::unavailable(fault.to_string()))?;
    let (ask, answer) = oneshot::channel();
    if news.send(News::Greeting(ask)).await.is_err() {
        return Ok(Ended::Unheard);
    }
    let Ok(hello) = answer.await else { return Ok(Ended::Unheard) };
    let (outbox, messages) = mpsc::channel(OUTBOX);
    let first = v1::WorkerMessage { message: Some(v1::worker_message::Message::Hello(hello)) };
    if outbox.send(first).await.is_err() {
        return Ok(Ended::Unheard);
    }
    let mut inbox = client.work(ReceiverStream::new(messages)).await?.into_inner();
    backoff.reset();
    *told = false;
    if news.send(News::Up(outbox)).await.is_err() {
        return Ok(Ended::Unheard);
    }
    loop {
        let message = tokio::select! {
            message = inbox.message() => message?,
            Ok(()) = renewed.changed() => return Ok(Ended::Renewed),
        };
        let Some(message) = message else { return Err(Status::unavailable("the coordinator closed the stream")) };
        // A message without content comes from a newer coordinator.
        if let Some(message) = message.message
            && news.send(News::Message(message)).await.is_err()
        {
            return Ok(Ended::Unheard);
        }
    }
}
