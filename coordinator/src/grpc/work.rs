//! The stream of a worker, both ways.

use std::time::Duration;

use futures::StreamExt;
use gradfarm_proto::convert::{ConvertError, LeaseName, lease_ref, uuid};
use gradfarm_proto::v1::worker_message::Message;
use gradfarm_proto::{Digest, limits, v1, version};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming};

use super::admission::Peer;
use super::{Messages, status};
use crate::job::{Capabilities, WorkerId};
use crate::service::Handle;
use crate::service::command::{Command, Hello, SessionKey};

/// How long a worker may take to say hello.
const HELLO: Duration = Duration::from_secs(10);
/// How often it is looked whether a worker is still let in.
const STANDING: Duration = Duration::from_secs(1);
/// Messages that may wait for a worker to read them.
const OUTBOX: usize = 1024;
/// Longest name of a worker, and of its version [bytes].
const NAME: usize = 200;

/// Opens a worker's stream: checks its hello, enters it, and forwards what it says until it ends.
pub(super) async fn work(
    handle: Handle,
    peer: Peer,
    mut inbox: Streaming<v1::WorkerMessage>,
) -> Result<Messages<v1::CoordinatorMessage>, Status> {
    let first = tokio::time::timeout(HELLO, inbox.message());
    let first = first.await.map_err(|_| Status::deadline_exceeded("no hello within 10 s"))??;
    let Some(Message::Hello(hello)) = first.and_then(|message| message.message) else {
        return Err(Status::invalid_argument("the first message must be a hello"));
    };
    let hello = read_hello(hello)?;
    peer.require(hello.worker)?;
    let (outbox, messages) = mpsc::channel(OUTBOX);
    let connect = |reply| Command::Connect { hello: Box::new(hello), outbox, reply };
    let key = handle.ask(connect).await.map_err(status)?;
    tokio::spawn(async move {
        let ended = tokio::select! {
            ended = forward(&handle, key, &mut inbox) => ended,
            ended = thrown_out(&handle, &peer) => Err(ended),
        };
        if let Err(problem) = ended {
            tracing::debug!(worker = %key.worker, %problem, "worker's stream broke");
        }
        // If the loop is gone there is nobody to tell.
        let _stopped = handle.tell(Command::Disconnect { from: key }).await;
    });
    Ok(ReceiverStream::new(messages).map(Ok).boxed())
}

/// Ready when this caller would not be let in any more: revoked, or its certificate is over.
async fn thrown_out(handle: &Handle, peer: &Peer) -> Status {
    loop {
        tokio::time::sleep(STANDING).await;
        match peer.still(handle).await {
            Err(refusal) if refusal.code() != Code::Unavailable => return refusal,
            _ => {}
        }
    }
}

fn read_hello(hello: v1::Hello) -> Result<Hello, Status> {
    let protocol =
        version::agree(hello.protocol_min, hello.protocol_max).map_err(|error| Status::failed_precondition(error.to_string()))?;
    if hello.name.len() > NAME || hello.version.len() > NAME {
        return Err(Status::invalid_argument(format!("name and version of a worker may have {NAME} bytes at most")));
    }
    Ok(Hello {
        worker: WorkerId::from_bytes(uuid("hello.worker", &hello.worker)?),
        protocol,
        name: hello.name,
        version: hello.version,
        capabilities: capabilities(hello.pool, hello.tags, hello.memory_bytes, hello.threads)?,
        held: leases(hello.held)?,
        scenes: scenes(&hello.scenes)?,
    })
}

async fn forward(handle: &Handle, from: SessionKey, inbox: &mut Streaming<v1::WorkerMessage>) -> Result<(), Status> {
    while let Some(message) = inbox.message().await? {
        let command = match message.message {
            Some(Message::Credit(credit)) => Command::Credit { from, leases: credit.leases },
            Some(Message::Heartbeat(beat)) => {
                Command::Heartbeat { from, held: leases(beat.held)?, scenes: scenes(&beat.scenes)?, progress: progress(beat.progress)? }
            }
            Some(Message::Returned(returned)) => Command::Returned { from, leases: leases(returned.leases)? },
            Some(Message::Failed(failed)) => {
                let reason: String = failed.reason.chars().take(limits::TEXT / 4).collect();
                Command::Failed { worker: from.worker, lease: lease_ref(failed.lease)?, reason }
            }
            Some(Message::Goodbye(_)) => return Ok(()),
            Some(Message::Hello(_)) => return Err(Status::invalid_argument("a second hello")),
            // From a newer worker: it may say more than this version understands.
            None => continue,
        };
        handle.tell(command).await.map_err(status)?;
    }
    Ok(())
}

fn capabilities(pool: String, tags: Vec<String>, memory: u64, threads: u32) -> Result<Capabilities, Status> {
    if tags.len() > limits::TAGS || tags.iter().chain([&pool]).any(|name| name.len() > limits::TAG) {
        let expected = format!("at most {} tags, and names of at most {} bytes", limits::TAGS, limits::TAG);
        return Err(Status::invalid_argument(format!("pool and tags of a worker: expected {expected}")));
    }
    Ok(Capabilities { pool, tags: tags.into_iter().collect(), memory, threads })
}

fn progress(messages: Vec<v1::LeaseProgress>) -> Result<Vec<(LeaseName, u64)>, ConvertError> {
    check_count("progress", messages.len())?;
    messages.into_iter().map(|message| Ok((lease_ref(message.lease)?, message.samples))).collect()
}

fn leases(messages: Vec<v1::LeaseRef>) -> Result<Vec<LeaseName>, ConvertError> {
    check_count("held", messages.len())?;
    messages.into_iter().map(LeaseName::try_from).collect()
}

fn scenes(messages: &[bytes::Bytes]) -> Result<Vec<Digest>, Status> {
    check_count("scenes", messages.len())?;
    let read = |bytes: &bytes::Bytes| Digest::try_from(bytes.as_ref()).map_err(|error| Status::invalid_argument(error.to_string()));
    messages.iter().map(read).collect()
}

fn check_count(field: &'static str, count: usize) -> Result<(), ConvertError> {
    if count <= limits::LEASES {
        return Ok(());
    }
    Err(ConvertError::Range { field, found: format!("{count} entries"), expected: format!("at most {}", limits::LEASES) })
}
