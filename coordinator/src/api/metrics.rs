//! Numbers for those who watch the farm by machine.

use std::time::Instant;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::problem::Problem;
use crate::metrics::MEDIA_TYPE;
use crate::service::Handle;

/// `GET /metrics`: all that is counted and measured, in the text format of OpenMetrics.
pub(super) async fn show(State(service): State<Handle>) -> Result<Response, Problem> {
    let text = service.scrape().await?;
    Ok(([(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE))], text).into_response())
}

/// Counts every request, by the pattern of its route: what is asked for never becomes a label.
pub(super) async fn measure(State(service): State<Handle>, request: Request, next: Next) -> Response {
    let (method, begun) = (request.method().clone(), Instant::now());
    let route = request.extensions().get::<MatchedPath>().map_or_else(String::new, |path| path.as_str().to_owned());
    // What changes something is finished before the coordinator stops.
    let _busy = (!method.is_safe()).then(|| service.busy());
    let response = next.run(request).await;
    service.metrics().answered(method.as_str(), &route, response.status().as_u16(), begun.elapsed());
    response
}
