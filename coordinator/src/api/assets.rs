//! Assets: files that scenes refer to, by content.

use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use gradfarm_proto::Digest;

use super::json::Asset;
use super::problem::Problem;
use crate::service::Handle;

/// `POST /assets`: stores the body; uploading the same bytes again changes nothing.
pub(super) async fn upload(State(service): State<Handle>, body: Result<Bytes, BytesRejection>) -> Result<Response, Problem> {
    let body = body?;
    let bytes = body.len() as u64;
    let digest = service.put_asset(body).await?.to_string();
    let address = format!("{}/assets/{digest}", super::ROOT);
    Ok((StatusCode::CREATED, [(header::LOCATION, address)], Json(Asset { digest, bytes })).into_response())
}

/// `HEAD /assets/{digest}`: 204 if the file is there, 404 if it must be uploaded.
pub(super) async fn check(State(service): State<Handle>, Path(digest): Path<String>) -> Result<StatusCode, Problem> {
    let digest: Digest = digest.parse().map_err(|fault: gradfarm_proto::ParseDigestError| Problem::malformed(fault.to_string()))?;
    match service.missing_assets(&[digest]).await?.is_empty() {
        true => Ok(StatusCode::NO_CONTENT),
        false => Err(Problem::not_found(format!("no file with the digest {digest}"))),
    }
}
