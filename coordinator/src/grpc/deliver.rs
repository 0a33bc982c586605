//! A result: header, chunks, checks, blob, and only then the loop, whose answer is durable.

use gradfarm_core::film::{FilmBlock, PlaneKind};
use gradfarm_core::plan::{TileGuide, WorkUnit};
use gradfarm_proto::convert::{LeaseName, lease_ref, uuid};
use gradfarm_proto::v1::deliver_reply::Outcome;
use gradfarm_proto::v1::result_chunk::Part;
use gradfarm_proto::{Digest, block, limits, v1};
use tokio::sync::Semaphore;
use tonic::{Status, Streaming};

use super::admission::Peer;
use super::status;
use crate::job::{Answer, DeliveredRecord, JobId, WorkerId};
use crate::service::Handle;
use crate::service::command::Command;
use crate::service::dispatch::Dispatcher;

/// What the header announces.
struct Header {
    worker: WorkerId,
    lease: LeaseName,
    digest: Digest,
    size: u64,
    compressed: u64,
    seconds: [f64; 3],
}

/// What a result must look like.
struct Expected {
    work: WorkUnit,
    layout: Vec<PlaneKind>,
    guide: Option<TileGuide>,
}

/// What the loop says of a lease before its result is read.
enum Standing {
    /// The result would count: what it must look like.
    Due(Expected),
    /// The result would count, but what it must look like is being found out again.
    Unguided,
    /// There is no such job here.
    Unknown,
    /// It would not, or has counted already.
    Over(Answer),
}

/// Takes a result in.
pub(super) async fn deliver(
    handle: &Handle,
    peer: &Peer,
    checks: &Semaphore,
    mut chunks: Streaming<v1::ResultChunk>,
) -> Result<v1::DeliverReply, Status> {
    let Some(Part::Header(header)) = chunks.message().await?.and_then(|chunk| chunk.part) else {
        return Err(Status::invalid_argument("a result must begin with its header"));
    };
    let header = read_header(&header)?;
    peer.require(header.worker)?;
    let (lease, digest) = (header.lease, header.digest);
    let expected = match handle.look(move |dispatcher| standing(dispatcher, lease, digest)).await.map_err(status)? {
        Standing::Due(expected) => expected,
        Standing::Unguided => return Err(Status::unavailable("the guide of this unit is being made again")),
        Standing::Over(answer) => return Ok(reply(answer)),
        Standing::Unknown if handle.may_be_elsewhere(JobId::from_bytes(lease.job)).await.map_err(status)? => {
            return Err(Status::unavailable("another coordinator has this job"));
        }
        Standing::Unknown => return Ok(reply(Answer::Superseded)),
    };
    let allowed = block::encoded_size(expected.work.tile, &expected.layout, limits::LINES);
    let compressed = match receive(&header, allowed, &mut chunks).await? {
        Ok(compressed) => compressed,
        Err(reason) => return refuse(handle, &header, reason).await,
    };
    let checked = {
        let _permit = checks.acquire().await.map_err(|_| Status::unavailable("the coordinator has stopped"))?;
        let (compressed, size) = (compressed.clone(), header.size);
        tokio::task::spawn_blocking(move || check(&compressed, digest, size, allowed, &expected))
            .await
            .map_err(|_| Status::internal("the check of the result broke off"))?
    };
    if let Err(reason) = checked {
        return refuse(handle, &header, reason).await;
    }
    let blob = handle.put_blob(compressed.into()).await.map_err(status)?;
    let [load, compile, render] = header.seconds;
    let result = DeliveredRecord { content: digest, blob, size: header.size, load, compile, render };
    let answer = handle.ask(|answer| Command::Deliver { worker: header.worker, lease, result, reply: answer }).await.map_err(status)?;
    Ok(reply(answer))
}

fn read_header(header: &v1::ResultHeader) -> Result<Header, Status> {
    let seconds = [header.load_seconds, header.compile_seconds, header.render_seconds];
    if seconds.iter().any(|s| !(s.is_finite() && *s >= 0.0)) {
        return Err(Status::invalid_argument(format!("seconds are {seconds:?}, expected finite numbers, 0 or above")));
    }
    Ok(Header {
        worker: WorkerId::from_bytes(uuid("header.worker", &header.worker)?),
        lease: lease_ref(header.lease.clone())?,
        digest: Digest::try_from(header.digest.as_ref()).map_err(|error| Status::invalid_argument(error.to_string()))?,
        size: header.size,
        compressed: header.compressed_size,
        seconds,
    })
}

fn standing(dispatcher: &mut Dispatcher, lease: LeaseName, digest: Digest) -> Standing {
    let Some(job) = dispatcher.job(JobId::from_bytes(lease.job)) else { return Standing::Unknown };
    if job.awaits(lease.unit, lease.epoch) {
        let Ok(guide) = job.guide_of(lease.unit) else { return Standing::Unguided };
        return Standing::Due(Expected { work: job.split.work(lease.unit), layout: job.record.plan.layout(), guide });
    }
    Standing::Over(if job.has_taken(lease.unit, lease.epoch, digest) { Answer::Accepted } else { Answer::Superseded })
}

/// The announced bytes; the inner error is the worker's fault.
async fn receive(header: &Header, allowed: u64, chunks: &mut Streaming<v1::ResultChunk>) -> Result<Result<Vec<u8>, String>, Status> {
    // zstd may add a little to what it cannot compress.
    let most = allowed + allowed / 128 + 1024;
    if header.size > allowed || header.compressed > most {
        return Ok(Err(format!("result of {} bytes ({} compressed), expected at most {allowed}", header.size, header.compressed)));
    }
    let mut bytes = Vec::with_capacity(header.compressed as usize);
    while let Some(chunk) = chunks.message().await? {
        let Some(Part::Data(data)) = chunk.part else { return Ok(Err("a second header".into())) };
        if bytes.len() as u64 + data.len() as u64 > header.compressed {
            return Ok(Err(format!("more than the announced {} bytes", header.compressed)));
        }
        bytes.extend_from_slice(&data);
    }
    if bytes.len() as u64 != header.compressed {
        // The stream broke off: the worker tries again.
        return Err(Status::aborted(format!("{} of {} bytes arrived", bytes.len(), header.compressed)));
    }
    Ok(Ok(bytes))
}

/// Checks that the bytes are the block that the unit needs: digest, tile, samples, planes, lengths, finite values, counts.
fn check(compressed: &[u8], digest: Digest, size: u64, allowed: u64, expected: &Expected) -> Result<(), String> {
    let work = expected.work;
    let block: FilmBlock = block::decode(compressed, digest, size, allowed).map_err(|error| error.to_string())?;
    if (block.tile, block.samples) != (work.tile, work.samples) {
        return Err(format!("block of {:?} {:?}, the unit is {:?} {:?}", block.tile, block.samples, work.tile, work.samples));
    }
    block.check(&expected.layout).map_err(|error| error.to_string())?;
    match &expected.guide {
        Some(guide) if !guide.matches(&block) => Err("the block's pixels do not have the samples that their guide says".into()),
        _ => Ok(()),
    }
}

async fn refuse(handle: &Handle, header: &Header, reason: String) -> Result<v1::DeliverReply, Status> {
    let failed = Command::Failed { worker: header.worker, lease: header.lease, reason: format!("result refused: {reason}") };
    handle.tell(failed).await.map_err(status)?;
    Ok(reply(Answer::Refused(reason)))
}

fn reply(answer: Answer) -> v1::DeliverReply {
    let (outcome, reason) = match answer {
        Answer::Accepted => (Outcome::Accepted, String::new()),
        Answer::Superseded => (Outcome::Superseded, String::new()),
        Answer::Refused(reason) => (Outcome::Refused, reason),
    };
    v1::DeliverReply { outcome: outcome.into(), reason }
}
