//! Join tokens, and the workers that were enrolled with them.

use std::time::Duration;

use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::problem::Problem;
use super::tokens::shown;
use crate::access::{Caller, Secret};
use crate::authority::{EnrolledView, JoinView, NewJoin, Registry};
use crate::job::{ParseIdError, WorkerId};
use crate::service::Handle;

/// How long a join token is good if nobody says otherwise [s].
const HOUR: u32 = 3600;

/// A join token to be issued.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JoinRequest {
    /// The pool that its workers belong to.
    #[serde(default)]
    pub pool: Option<String>,
    /// How many workers may join with it; one if absent.
    #[serde(default)]
    pub uses: Option<u32>,
    /// How long it is good [s]; an hour if absent.
    #[serde(default)]
    pub ttl_seconds: Option<u32>,
}

/// A join token as it is shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct JoinInfo {
    /// What to call it, for instance to revoke it.
    pub id: String,
    /// The pool that its workers belong to.
    pub pool: Option<String>,
    /// How many workers may still join with it.
    pub left: u32,
    /// When it was issued [ms since 1970].
    pub created_ms: i64,
    /// From when on nobody joins with it [ms since 1970].
    pub expires_ms: i64,
    /// Who issued it.
    pub issued_by: String,
    /// The token itself: only in the answer to the request that issued it.
    #[serde(default, with = "shown", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub token: Option<Secret>,
    /// The certificate that the worker shall trust (PEM): only there, too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub authority: Option<String>,
}

/// All join tokens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct JoinTokens {
    /// Newest first.
    pub join_tokens: Vec<JoinInfo>,
}

/// A worker with a certificate.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EnrolledWorker {
    /// Its identifier, also in the list of connected workers.
    pub id: String,
    /// For people.
    pub name: String,
    /// The pool that it belongs to.
    pub pool: Option<String>,
    /// When it joined [ms since 1970].
    pub enrolled_ms: i64,
    /// When its certificate was last renewed [ms since 1970].
    pub renewed_ms: Option<i64>,
    /// When it was thrown out [ms since 1970].
    pub revoked_ms: Option<i64>,
}

/// All workers that were ever enrolled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EnrolledWorkers {
    /// Newest first.
    pub workers: Vec<EnrolledWorker>,
}

impl From<JoinView> for JoinInfo {
    fn from(JoinView { id, join }: JoinView) -> Self {
        let crate::authority::Join { pool, left, created_ms, expires_ms, issued_by } = join;
        Self { id, pool, left, created_ms, expires_ms, issued_by, token: None, authority: None }
    }
}

impl From<EnrolledView> for EnrolledWorker {
    fn from(EnrolledView { worker, enrolled }: EnrolledView) -> Self {
        Self {
            id: worker.to_string(),
            name: enrolled.name,
            pool: enrolled.pool,
            enrolled_ms: enrolled.enrolled_ms,
            renewed_ms: enrolled.renewed_ms,
            revoked_ms: enrolled.revoked_ms,
        }
    }
}

fn registry(service: &Handle) -> Result<&Registry, Problem> {
    let off = "workers are enrolled over TLS, and this coordinator speaks none: start it with --tls";
    service.secured().map(|secured| &secured.registry).ok_or_else(|| Problem::conflict(off))
}

/// `POST /join-tokens`: the answer holds the token, and no later one does.
pub(super) async fn create(
    State(service): State<Handle>,
    Extension(caller): Extension<Caller>,
    body: Result<Json<JoinRequest>, JsonRejection>,
) -> Result<Response, Problem> {
    let Json(asked) = body?;
    let ttl = Duration::from_secs(asked.ttl_seconds.unwrap_or(HOUR).into());
    let registry = registry(&service)?;
    let new = NewJoin { pool: asked.pool, uses: asked.uses.unwrap_or(1), ttl };
    let (view, token) = registry.create_join(new, &caller.name).await?;
    tracing::info!(id = %view.id, uses = view.join.left, pool = view.join.pool.as_deref(), by = %caller.name, "join token issued");
    let authority = Some(registry.authority().pem().to_owned());
    let info = JoinInfo { token: Some(token), authority, ..view.into() };
    Ok((StatusCode::CREATED, [(header::CACHE_CONTROL, "no-store")], Json(info)).into_response())
}

/// `GET /join-tokens`.
pub(super) async fn joins(State(service): State<Handle>) -> Result<Json<JoinTokens>, Problem> {
    Ok(Json(JoinTokens { join_tokens: registry(&service)?.joins().await?.into_iter().map(Into::into).collect() }))
}

/// `DELETE /join-tokens/{token}`.
pub(super) async fn revoke_join(State(service): State<Handle>, Path(token): Path<String>) -> Result<Json<JoinInfo>, Problem> {
    Ok(Json(registry(&service)?.revoke_join(&token).await?.into()))
}

/// `GET /enrolments`.
pub(super) async fn workers(State(service): State<Handle>) -> Result<Json<EnrolledWorkers>, Problem> {
    Ok(Json(EnrolledWorkers { workers: registry(&service)?.workers().await?.into_iter().map(Into::into).collect() }))
}

/// `DELETE /enrolments/{worker}`: the worker is thrown out.
pub(super) async fn revoke(State(service): State<Handle>, Path(worker): Path<String>) -> Result<Json<EnrolledWorker>, Problem> {
    let worker: WorkerId = worker.parse().map_err(|fault: ParseIdError| Problem::not_found(fault.to_string()))?;
    Ok(Json(registry(&service)?.revoke(worker).await?.into()))
}
