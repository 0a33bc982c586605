//! The workers.

use axum::Json;
use axum::extract::State;

use super::json::Workers;
use super::problem::Problem;
use crate::service::Handle;

/// `GET /workers`: those that are connected.
pub(super) async fn list(State(service): State<Handle>) -> Result<Json<Workers>, Problem> {
    Ok(Json(Workers { workers: service.workers().await?.into_iter().map(Into::into).collect() }))
}
