//! Any coordinator answers for any job: requests for a job that another one owns are passed on to it.

use std::sync::OnceLock;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures::future;

use super::json::{Job, JobPage, JobSummary};
use super::problem::Problem;
use crate::crypto;
use crate::error::Error;
use crate::job::JobId;
use crate::service::Handle;

/// Says that a request was passed on, so that it is not passed on again.
const RELAYED: HeaderName = HeaderName::from_static("gradfarm-relayed");
/// How long another coordinator may take to answer for its part of a list.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often it is looked whether a job is still where it was.
const LOOK: Duration = Duration::from_millis(500);
/// Headers that are between two neighbours only.
const NEIGHBOURLY: [HeaderName; 6] =
    [header::HOST, header::CONNECTION, header::TRANSFER_ENCODING, header::CONTENT_LENGTH, header::UPGRADE, header::TE];

/// Passes a request on if it is about another coordinator's job.
pub(super) async fn relay(State(service): State<Handle>, request: Request, next: Next) -> Response {
    let Some(job) = job_of(request.uri().path()).filter(|_| !is_relayed(request.headers())) else { return next.run(request).await };
    let (parts, mut body) = request.into_parts();
    loop {
        let base = match service.elsewhere(job).await {
            Ok(None) => return next.run(Request::from_parts(parts, body)).await,
            Ok(Some(base)) => base,
            Err(error) => return Problem::from(error).into_response(),
        };
        let sent = std::mem::take(&mut body);
        tokio::select! {
            answer = forward(&service, &base, &parts, sent) => match answer {
                Ok(response) => return response,
                // Nothing was done yet, or it does no harm to ask twice.
                Err(_) if parts.method.is_safe() => tokio::time::sleep(LOOK).await,
                Err(problem) => return problem.into_response(),
            },
            // Its owner may hang, and be replaced.
            () = moved(&service, job, &base) => {
                if !parts.method.is_safe() {
                    let detail = "another coordinator has taken this job over; whether the one before did as asked is not known";
                    return Problem::unavailable(detail).into_response();
                }
            }
        }
    }
}

/// Ready when a job is no longer at this address.
async fn moved(service: &Handle, job: JobId, base: &str) {
    loop {
        tokio::time::sleep(LOOK).await;
        if !matches!(service.elsewhere(job).await, Ok(Some(found)) if found == base) {
            return;
        }
    }
}

/// Whether another coordinator passed this request on.
pub(super) fn is_relayed(headers: &HeaderMap) -> bool {
    headers.contains_key(RELAYED)
}

/// The job that an address is about.
fn job_of(path: &str) -> Option<JobId> {
    let rest = path.split_once("/jobs/")?.1;
    rest.split('/').next()?.parse().ok()
}

/// Speaks to other coordinators.
fn client(service: &Handle) -> &reqwest::Client {
    if let Some(secured) = service.secured() {
        return &secured.peers;
    }
    plain_client()
}

fn plain_client() -> &'static reqwest::Client {
    static CLIENT: OnceLock<reqwest::Client> = OnceLock::new();
    CLIENT.get_or_init(|| {
        crypto::provide();
        reqwest::Client::new()
    })
}

async fn forward(service: &Handle, base: &str, parts: &Parts, body: Body) -> Result<Response, Problem> {
    // Within the nested routes an address has lost its root.
    let path = parts.uri.path_and_query().map_or("/", |path| path.as_str());
    let root = if path.starts_with(super::ROOT) { "" } else { super::ROOT };
    let target = format!("{}{root}{path}", base.trim_end_matches('/'));
    let mut headers = parts.headers.clone();
    NEIGHBOURLY.iter().for_each(|name| drop(headers.remove(name)));
    let sent = client(service).request(parts.method.clone(), target).headers(headers).header(RELAYED, "1");
    let sent = if parts.method.is_safe() { sent } else { sent.body(reqwest::Body::wrap_stream(body.into_data_stream())) };
    let answer = sent.send().await;
    let answer = answer.map_err(|fault| Problem::unavailable(format!("the coordinator that has this job does not answer: {fault}")))?;
    let mut response = Response::builder().status(answer.status());
    for (name, value) in answer.headers().iter().filter(|(name, _)| !NEIGHBOURLY.contains(name) || *name == header::CONTENT_LENGTH) {
        response = response.header(name, value);
    }
    response.body(Body::from_stream(answer.bytes_stream())).map_err(|fault| Problem::internal(&fault))
}

/// A job that another coordinator has, as that one tells it.
pub(super) async fn job(service: &Handle, job: JobId, token: Option<&HeaderValue>) -> Result<Job, Problem> {
    let base = service.elsewhere(job).await?.ok_or(Error::NoJob(job))?;
    let away = |fault: reqwest::Error| Problem::unavailable(format!("the coordinator that has job {job} does not answer: {fault}"));
    let mut request = client(service).get(format!("{}{}/jobs/{job}", base.trim_end_matches('/'), super::ROOT)).header(RELAYED, "1");
    if let Some(token) = token {
        request = request.header(header::AUTHORIZATION, token);
    }
    request.timeout(PATIENCE).send().await.and_then(reqwest::Response::error_for_status).map_err(away)?.json().await.map_err(away)
}

/// What the other coordinators have on a page of the list that this query asks for. One that does not answer is left out: it is gone, and its jobs are about to be
/// somebody else's.
pub(super) async fn pages(service: &Handle, query: &[(&str, String)], headers: &HeaderMap) -> Result<Vec<JobPage>, Problem> {
    let ask = |base: String| {
        let address = reqwest::Url::parse(&format!("{}{}/jobs", base.trim_end_matches('/'), super::ROOT));
        let request = address.ok().map(|mut address| {
            address.query_pairs_mut().extend_pairs(query);
            let request = client(service).get(address);
            match headers.get(header::AUTHORIZATION) {
                Some(token) => request.header(header::AUTHORIZATION, token),
                None => request,
            }
        });
        async move { request?.header(RELAYED, "1").timeout(PATIENCE).send().await.ok()?.json::<JobPage>().await.ok() }
    };
    Ok(future::join_all(service.peers().await?.into_iter().map(ask)).await.into_iter().flatten().collect())
}

/// One page of several: newest first, each job once, at most so many.
pub(super) fn merge(pages: Vec<JobPage>, limit: usize) -> JobPage {
    let more = pages.iter().any(|page| page.next.is_some());
    let mut jobs: Vec<JobSummary> = pages.into_iter().flat_map(|page| page.jobs).collect();
    jobs.sort_by(|a, b| b.id.cmp(&a.id));
    jobs.dedup_by(|a, b| a.id == b.id);
    let more = more || jobs.len() > limit;
    jobs.truncate(limit);
    let next = if more { jobs.last().map(|job| job.id.clone()) } else { None };
    JobPage { jobs, next }
}
