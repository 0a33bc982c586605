//! The workers.

use axum::Json;
use axum::extract::{Path, State};

use super::json::{Worker, Workers};
use super::problem::Problem;
use crate::error::Error;
use crate::job::{ParseIdError, WorkerId};
use crate::service::Handle;

/// `GET /workers`: those that are connected.
pub(super) async fn list(State(service): State<Handle>) -> Result<Json<Workers>, Problem> {
    Ok(Json(Workers { workers: service.workers().await?.into_iter().map(Into::into).collect() }))
}

/// `POST /workers/{worker}/drain`: the worker finishes what it holds and gets nothing new.
pub(super) async fn drain(State(service): State<Handle>, Path(worker): Path<String>) -> Result<Json<Workers>, Problem> {
    rest(&service, &worker, true).await
}

/// `POST /workers/{worker}/resume`: the worker gets work again.
pub(super) async fn resume(State(service): State<Handle>, Path(worker): Path<String>) -> Result<Json<Workers>, Problem> {
    rest(&service, &worker, false).await
}

/// The answer is the worker alone, or nobody where it is not connected.
async fn rest(service: &Handle, worker: &str, rests: bool) -> Result<Json<Workers>, Problem> {
    let worker: WorkerId = worker.parse().map_err(|fault: ParseIdError| Problem::not_found(fault.to_string()))?;
    service.rest(worker, rests).await.map_err(|error| match error {
        Error::NoWorker(worker) => Problem::not_found(format!("worker {worker} is not connected")),
        other => other.into(),
    })?;
    let all = service.workers().await?.into_iter();
    let one = all.filter(|view| view.id == worker).map(Worker::from).collect();
    Ok(Json(Workers { workers: one }))
}
