//! Jobs: submit, list, show, call off.

use std::time::Duration;

use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::QueryRejection;
use axum::extract::{FromRequest, Multipart, Path, Query, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures::StreamExt;
use schemars::JsonSchema;
use serde::Deserialize;

use super::json::{DryRun, Job, JobPage};
use super::problem::Problem;
use super::{relay, submission};
use crate::error::Error;
use crate::job::{JobId, JobState};
use crate::service::{Handle, JobSummary};

/// How to submit.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct How {
    dry_run: bool,
}

/// `POST /jobs`, with `?dry_run=true` to be checked only: JSON or a form, told apart by the content type. Once this answers 201, the job survives a crash.
pub(super) async fn submit(
    State(service): State<Handle>,
    how: Result<Query<How>, QueryRejection>,
    request: Request,
) -> Result<Response, Problem> {
    let Query(How { dry_run }) = how?;
    let token = request.headers().get(header::AUTHORIZATION).cloned();
    let content_type = request.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let submission = match content_type.split(';').next().unwrap_or_default().trim() {
        "application/json" => {
            let body = Bytes::from_request(request, &()).await?;
            if body.len() > super::JSON_BYTES {
                let detail = format!("the body has {} bytes, at most {} are taken; upload meshes as assets", body.len(), super::JSON_BYTES);
                return Err(Problem::too_large(detail));
            }
            // A large scene takes a while to check; other requests should not wait for it.
            tokio::task::spawn_blocking(move || submission::from_json(&body)).await.map_err(|fault| Problem::internal(&fault))??
        }
        "multipart/form-data" => submission::from_form(Multipart::from_request(request, &()).await?, &service).await?,
        other => {
            let detail = format!("the content type is {other:?}, expected application/json or multipart/form-data");
            return Err(Problem::media_type(detail));
        }
    };
    if dry_run {
        return Ok(Json(DryRun::from(service.dry_run(submission).await?)).into_response());
    }
    let id = service.submit(submission).await?;
    let job = match service.get(id).await {
        // Its token was used before, at another coordinator.
        Err(Error::NoJob(_)) => relay::job(&service, id, token.as_ref()).await?,
        found => Job::from(found?),
    };
    Ok((StatusCode::CREATED, [(header::LOCATION, format!("{}/jobs/{id}", super::ROOT))], Json(job)).into_response())
}

/// Which page of the list.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Page {
    limit: Option<usize>,
    cursor: Option<String>,
    /// A state, or `open` for those that are not over.
    state: Option<String>,
    /// Part of the name, whatever its case, or the beginning of the id.
    search: Option<String>,
}

impl Page {
    /// Whether a job is among those that are asked for.
    fn takes(&self, job: &JobSummary) -> bool {
        let search = self.search.as_deref().unwrap_or_default().to_lowercase();
        let state = match self.state.as_deref() {
            None => true,
            Some(OPEN) => !job.state.is_final(),
            Some(name) => job.state.name() == name,
        };
        state && (search.is_empty() || job.name.to_lowercase().contains(&search) || job.id.to_string().starts_with(&search))
    }
}

/// Stands for all states that are not final.
const OPEN: &str = "open";

/// Jobs on a page unless asked otherwise, and at most.
const PAGE: usize = 50;
const PAGE_MOST: usize = 500;

/// `GET /jobs`: newest first. The cursor is the last job of the page before, so pages stay whole while jobs come in.
pub(super) async fn list(
    State(service): State<Handle>,
    headers: HeaderMap,
    page: Result<Query<Page>, QueryRejection>,
) -> Result<Json<JobPage>, Problem> {
    let Query(page) = page?;
    let limit = page.limit.unwrap_or(PAGE);
    if !(1..=PAGE_MOST).contains(&limit) {
        return Err(Problem::field("limit", format!("limit is {limit}, expected 1 to {PAGE_MOST}")));
    }
    if let Some(name) = page.state.as_deref().filter(|name| *name != OPEN && JobState::ALL.iter().all(|state| state.name() != *name)) {
        let names = JobState::ALL.map(JobState::name).join(", ");
        return Err(Problem::field("state", format!("state is {name:?}, expected {OPEN} or one of {names}")));
    }
    let before = page.cursor.as_deref().map(|cursor| cursor.parse::<JobId>()).transpose();
    let before = before.map_err(|fault| Problem::field("cursor", fault.to_string()))?;
    let mut jobs = service.list().await?;
    jobs.retain(|job| before.is_none_or(|before| job.id < before) && page.takes(job));
    let more = jobs.len() > limit;
    jobs.truncate(limit);
    let next = if more { jobs.last().map(|job| job.id.to_string()) } else { None };
    let own = JobPage { jobs: jobs.into_iter().map(Into::into).collect(), next };
    if relay::is_relayed(&headers) {
        return Ok(Json(own));
    }
    let query = [("limit", Some(limit.to_string())), ("cursor", page.cursor), ("state", page.state), ("search", page.search)];
    let query: Vec<(&str, String)> = query.into_iter().filter_map(|(name, value)| Some((name, value?))).collect();
    let mut pages = relay::pages(&service, &query, &headers).await?;
    pages.push(own);
    Ok(Json(relay::merge(pages, limit)))
}

/// How long to wait for a job.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Wait {
    /// A number of seconds, such as `30` or `30s`.
    wait: Option<String>,
}

/// Longest wait of one request [s].
const WAIT_MOST: f64 = 300.0;

/// `GET /jobs/{job}?wait=30s`: at once, or when the job is over, at the latest after so many seconds.
pub(super) async fn show(
    State(service): State<Handle>,
    Path(job): Path<String>,
    wait: Result<Query<Wait>, QueryRejection>,
) -> Result<Json<Job>, Problem> {
    let Query(Wait { wait }) = wait?;
    let job = parse(&job)?;
    if let Some(text) = wait {
        let seconds = text.strip_suffix('s').unwrap_or(&text).parse().ok().filter(|seconds| (0.0..=WAIT_MOST).contains(seconds));
        let fault = || Problem::field("wait", format!("wait is {text:?}, expected 0 to {WAIT_MOST} seconds, such as 30s"));
        let events = service.subscribe(job).await?;
        // The stream ends when the job is over.
        let _late = tokio::time::timeout(Duration::from_secs_f64(seconds.ok_or_else(fault)?), events.for_each(|_| async {})).await;
    }
    Ok(Json(service.get(job).await?.into()))
}

/// `POST /jobs/{job}/cancel` and `DELETE /jobs/{job}`: answers with the job as it then stands.
pub(super) async fn cancel(State(service): State<Handle>, Path(job): Path<String>) -> Result<Json<Job>, Problem> {
    let job = parse(&job)?;
    service.cancel(job).await?;
    Ok(Json(service.get(job).await?.into()))
}

/// `POST /jobs/{job}/pause`: no leases until it is resumed. Answers with the job as it then stands.
pub(super) async fn pause(State(service): State<Handle>, Path(job): Path<String>) -> Result<Json<Job>, Problem> {
    let job = parse(&job)?;
    service.pause(job).await?;
    Ok(Json(service.get(job).await?.into()))
}

/// `POST /jobs/{job}/resume`.
pub(super) async fn resume(State(service): State<Handle>, Path(job): Path<String>) -> Result<Json<Job>, Problem> {
    let job = parse(&job)?;
    service.resume(job).await?;
    Ok(Json(service.get(job).await?.into()))
}

/// What may be changed of a job.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Changes {
    /// Jobs of higher priority come first.
    priority: i32,
}

/// `PATCH /jobs/{job}`: changes its priority. Answers with the job as it then stands.
pub(super) async fn change(State(service): State<Handle>, Path(job): Path<String>, body: Bytes) -> Result<Json<Job>, Problem> {
    let job = parse(&job)?;
    let changes: Changes = serde_json::from_slice(&body).map_err(|fault| Problem::malformed(fault.to_string()))?;
    service.prioritise(job, changes.priority).await?;
    Ok(Json(service.get(job).await?.into()))
}

/// What is tried again.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Retry {
    /// In this frame only.
    frame: Option<u32>,
}

/// `POST /jobs/{job}/retry`: what failed is tried again, in one frame or, without a body, in all. Answers with the job as it then stands.
pub(super) async fn retry(State(service): State<Handle>, Path(job): Path<String>, body: Bytes) -> Result<Json<Job>, Problem> {
    let job = parse(&job)?;
    let what: Retry = if body.is_empty() {
        Retry::default()
    } else {
        serde_json::from_slice(&body).map_err(|fault| Problem::malformed(fault.to_string()))?
    };
    service.retry(job, what.frame).await?;
    Ok(Json(service.get(job).await?.into()))
}

/// The job that an address names.
pub(super) fn parse(text: &str) -> Result<JobId, Problem> {
    text.parse().map_err(|fault: crate::job::ParseIdError| Problem::not_found(fault.to_string()))
}
