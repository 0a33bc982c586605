//! Frames of a job: state, tiles, files.

use axum::Json;
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};

use super::json::{Frame, Tiles};
use super::problem::Problem;
use crate::error::Error;
use crate::job::{FileKind, JobId};
use crate::service::Handle;

/// The two variable parts of a frame's address.
pub(super) type Address = Path<(String, String)>;

/// `GET /jobs/{job}/frames/{frame}`.
pub(super) async fn show(State(service): State<Handle>, address: Address) -> Result<Json<Frame>, Problem> {
    let (job, number) = parse(address)?;
    let view = service.get(job).await?;
    let (first, last) = (view.frames.first().map_or(0, |frame| frame.number), view.frames.last().map_or(0, |frame| frame.number));
    let frame = view.frames.iter().find(|frame| frame.number == number);
    let frame = frame.ok_or(Error::NoFrame { job, frame: number, first, last })?;
    Ok(Json(Frame::of(job, frame)))
}

/// `GET /jobs/{job}/frames/{frame}/tiles`.
pub(super) async fn tiles(State(service): State<Handle>, address: Address) -> Result<Json<Tiles>, Problem> {
    let (job, frame) = parse(address)?;
    Ok(Json(Tiles { tiles: service.tiles(job, frame).await?.into_iter().map(Into::into).collect() }))
}

/// `GET /jobs/{job}/frames/{frame}/frame.exr`.
pub(super) async fn exr(service: State<Handle>, address: Address) -> Result<Response, Problem> {
    file(service, address, FileKind::Exr, "image/x-exr").await
}

/// `GET /jobs/{job}/frames/{frame}/frame.png`.
pub(super) async fn png(service: State<Handle>, address: Address) -> Result<Response, Problem> {
    file(service, address, FileKind::Png, "image/png").await
}

/// `GET /jobs/{job}/frames/{frame}/frame.json`: what was counted, tile by tile.
pub(super) async fn statistics(service: State<Handle>, address: Address) -> Result<Response, Problem> {
    file(service, address, FileKind::Statistics, "application/json").await
}

async fn file(State(service): State<Handle>, address: Address, kind: FileKind, media_type: &'static str) -> Result<Response, Problem> {
    let (job, frame) = parse(address)?;
    let bytes = service.frame_file(job, frame, kind).await?;
    // The file of a frame never changes once it is there.
    let headers = [(header::CONTENT_TYPE, media_type), (header::CACHE_CONTROL, "private, max-age=31536000, immutable")];
    Ok((headers, bytes).into_response())
}

/// The job and the frame number that an address names.
pub(super) fn parse(Path((job, frame)): Address) -> Result<(JobId, u32), Problem> {
    let number = frame.parse().map_err(|_| Problem::malformed(format!("{frame:?} is no frame number, expected 0, 1, 2 …")))?;
    Ok((super::jobs::parse(&job)?, number))
}
