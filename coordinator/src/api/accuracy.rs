//! The accuracy of a frame: numbers and a plot.

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use super::frames::{Address, parse};
use super::json::Accuracy;
use super::problem::Problem;
use crate::plot::{self, PlotError};
use crate::service::Handle;

/// `GET /jobs/{job}/frames/{frame}/accuracy`.
pub(super) async fn show(State(service): State<Handle>, address: Address) -> Result<Json<Accuracy>, Problem> {
    let (job, frame) = parse(address)?;
    Ok(Json(Accuracy::from(&service.accuracy(job, frame).await?)))
}

/// `GET /jobs/{job}/frames/{frame}/accuracy.svg`: there once the error was measured for the first time.
pub(super) async fn svg(State(service): State<Handle>, address: Address) -> Result<Response, Problem> {
    let (job, frame) = parse(address)?;
    let view = service.accuracy(job, frame).await?;
    match plot::accuracy(&view.name, frame, &view.curve, &view.stop).to_svg() {
        // It changes with each measurement.
        Ok(text) => Ok(([(header::CONTENT_TYPE, "image/svg+xml"), (header::CACHE_CONTROL, "no-cache")], text).into_response()),
        Err(PlotError::Empty) => Err(Problem::conflict(format!("the error of frame {frame} of job {job} was not measured yet"))),
        Err(fault) => Err(Problem::internal(&fault)),
    }
}
