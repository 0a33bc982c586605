//! What a worker is told of the leases that it gets, in messages of bounded size.

use std::collections::{BTreeMap, BTreeSet};

use gradfarm_proto::convert::LeaseName;
use gradfarm_proto::{limits, v1};

use crate::job::{Job, JobId};

/// The messages that grant these leases. A lease whose job or guide is gone is left out, and runs out.
pub(super) fn grants(jobs: &BTreeMap<JobId, Job>, leases: &[LeaseName]) -> Vec<v1::Grant> {
    let mut messages = Vec::new();
    let (mut batch, mut size) = (Vec::new(), 0);
    for name in leases {
        let Some(lease) = jobs.get(&JobId::from_bytes(name.job)).and_then(|job| lease(job, *name)) else { continue };
        // A number takes five bytes at most.
        let guide = lease.guide.as_ref().map_or(0, |guide| 5 * 4 * guide.count_a.len());
        if size + guide > limits::CHUNK && !batch.is_empty() {
            messages.push(message(jobs, std::mem::take(&mut batch)));
            size = 0;
        }
        size += guide;
        batch.push((JobId::from_bytes(name.job), lease));
    }
    if !batch.is_empty() {
        messages.push(message(jobs, batch));
    }
    messages
}

fn lease(job: &Job, name: LeaseName) -> Option<v1::Lease> {
    let guide = job.guide_of(name.unit).ok()?;
    Some(v1::Lease { lease: Some(name.into()), unit: Some(job.split.work(name.unit).into()), guide: guide.as_ref().map(Into::into) })
}

fn message(jobs: &BTreeMap<JobId, Job>, leases: Vec<(JobId, v1::Lease)>) -> v1::Grant {
    let ids: BTreeSet<JobId> = leases.iter().map(|(id, _)| *id).collect();
    let spec = |job: &Job| v1::JobSpec {
        job: bytes::Bytes::copy_from_slice(&job.record.id.to_bytes()),
        manifest: job.record.scene.to_bytes(),
        plan: Some(v1::Plan::from(&job.record.plan)),
    };
    v1::Grant {
        jobs: ids.iter().filter_map(|id| jobs.get(id)).map(spec).collect(),
        leases: leases.into_iter().map(|(_, lease)| lease).collect(),
    }
}
