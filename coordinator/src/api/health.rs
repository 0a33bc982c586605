//! Whether the coordinator works.

use axum::Json;
use axum::extract::State;

use super::json::Health;
use super::problem::Problem;
use crate::service::Handle;

/// `GET /health`: asks the service something cheap, so that `ok` means that it answers.
pub(super) async fn show(State(service): State<Handle>) -> Result<Json<Health>, Problem> {
    service.workers().await?;
    Ok(Json(Health { status: "ok".to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() }))
}
