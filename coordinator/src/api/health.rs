//! Whether the coordinator works, and whether it should be asked.

use axum::Json;
use axum::extract::State;

use super::json::Health;
use super::problem::Problem;
use crate::service::Handle;

/// `GET /health`: asks the service something cheap, so that `ok` means that it answers. If not, start it again.
pub(super) async fn show(State(service): State<Handle>) -> Result<Json<Health>, Problem> {
    service.workers().await?;
    Ok(health("ok"))
}

/// `GET /ready`: whether requests should be sent here. If not, send them elsewhere, or wait.
pub(super) async fn ready(State(service): State<Handle>) -> Result<Json<Health>, Problem> {
    let reasons = service.unready().await;
    if reasons.is_empty() { Ok(health("ready")) } else { Err(Problem::unready(&reasons)) }
}

fn health(status: &str) -> Json<Health> {
    Json(Health { status: status.to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() })
}
