//! Brings a result home: sends it again and again until the coordinator has answered.

use std::sync::Arc;

use gradfarm_proto::block::EncodedBlock;
use gradfarm_proto::convert::LeaseName;
use gradfarm_proto::v1::deliver_reply::Outcome;
use gradfarm_proto::v1::result_chunk::Part;
use gradfarm_proto::{limits, v1};
use tonic::Code;

use crate::backoff::Backoff;
use crate::dial::Dial;
use crate::lease_loop::job_of;
use crate::metrics::Metrics;

/// A result on its way.
#[derive(Clone, Debug)]
pub(crate) struct Delivery {
    pub(crate) worker: [u8; 16],
    pub(crate) lease: LeaseName,
    pub(crate) block: EncodedBlock,
    pub(crate) load_seconds: f64,
    pub(crate) compile_seconds: f64,
    pub(crate) render_seconds: f64,
}

/// Delivers to one coordinator after the other; returns once one has answered, whatever it said.
pub(crate) async fn deliver(mut dials: Vec<Dial>, delivery: Delivery, metrics: Arc<Metrics>) {
    let mut backoff = Backoff::new();
    let lease = delivery.lease;
    loop {
        let Some(dial) = dials.first() else { return };
        // Asked for each time: there may be a new certificate to show.
        let sent = match dial.client() {
            Ok(mut client) => client.deliver(tokio_stream::iter(chunks(&delivery))).await,
            Err(status) => Err(status),
        };
        match sent {
            Ok(reply) => {
                let reply = reply.into_inner();
                metrics.delivered(match reply.outcome() {
                    Outcome::Accepted => "accepted",
                    Outcome::Superseded => "superseded",
                    Outcome::Refused | Outcome::Unspecified => "refused",
                });
                match reply.outcome() {
                    Outcome::Accepted => tracing::debug!(job = %job_of(&lease), unit = lease.unit, epoch = lease.epoch, "delivered"),
                    Outcome::Superseded => {
                        tracing::info!(job = %job_of(&lease), unit = lease.unit, epoch = lease.epoch, "superseded: result dropped")
                    }
                    Outcome::Refused | Outcome::Unspecified => {
                        tracing::error!(job = %job_of(&lease), unit = lease.unit, epoch = lease.epoch, reason = %reply.reason, "result refused");
                    }
                }
                return;
            }
            // The coordinator will not understand it better the next time, nor let this worker deliver it.
            Err(status) if matches!(status.code(), Code::InvalidArgument | Code::PermissionDenied) => {
                metrics.delivered("refused");
                tracing::error!(job = %job_of(&lease), unit = lease.unit, epoch = lease.epoch, reason = status.message(), "result not understood");
                return;
            }
            Err(status) => tracing::debug!(unit = lease.unit, problem = %status, "result kept, trying again"),
        }
        metrics.delivery_retries.inc();
        // Another coordinator may have taken the job over.
        dials.rotate_left(1);
        tokio::time::sleep(backoff.wait()).await;
    }
}

/// Header and data; the data is shared, not copied.
fn chunks(delivery: &Delivery) -> Vec<v1::ResultChunk> {
    let header = v1::ResultHeader {
        worker: bytes::Bytes::copy_from_slice(&delivery.worker),
        lease: Some(delivery.lease.into()),
        digest: delivery.block.digest.to_bytes(),
        size: delivery.block.size,
        compressed_size: delivery.block.compressed.len() as u64,
        load_seconds: delivery.load_seconds,
        compile_seconds: delivery.compile_seconds,
        render_seconds: delivery.render_seconds,
    };
    let mut chunks = vec![v1::ResultChunk { part: Some(Part::Header(header)) }];
    let mut rest = delivery.block.compressed.clone();
    while !rest.is_empty() {
        let data = rest.split_to(rest.len().min(limits::CHUNK));
        chunks.push(v1::ResultChunk { part: Some(Part::Data(data)) });
    }
    chunks
}
