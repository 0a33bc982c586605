//! The audit log.

use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::problem::Problem;
use crate::access::AuditEntry;
use crate::service::Handle;

/// Most lines of a page.
const PAGE: u32 = 1000;

/// Which part of the log.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Page {
    limit: Option<u32>,
    before: Option<String>,
}

/// Lines of the log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct AuditPage {
    /// Newest first.
    pub entries: Vec<AuditEntry>,
    /// For the next page: `before`; absent if there is none.
    pub next: Option<String>,
}

/// `GET /audit?limit=&before=`.
pub(super) async fn show(State(service): State<Handle>, page: Result<Query<Page>, QueryRejection>) -> Result<Json<AuditPage>, Problem> {
    let Query(page) = page?;
    let limit = page.limit.unwrap_or(100);
    if !(1..=PAGE).contains(&limit) {
        return Err(Problem::field("limit", format!("limit is {limit}, expected 1 to {PAGE}")));
    }
    let read = service.gate().audit().read(page.before.as_deref(), limit).await?;
    let next = (read.len() == limit as usize).then(|| read.last().map(|(key, _)| key.clone())).flatten();
    Ok(Json(AuditPage { entries: read.into_iter().map(|(_, entry)| entry).collect(), next }))
}
