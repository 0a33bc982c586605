//! Tokens: issued, listed, revoked.

use std::time::Duration;

use axum::extract::rejection::JsonRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::problem::Problem;
use crate::access::{Caller, NewToken, Role, Secret, TokenView};
use crate::clock::Timestamp;
use crate::service::Handle;

/// A token to be issued.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TokenRequest {
    /// For people: whose it is, or what it is for.
    pub name: String,
    /// What its bearer may do.
    #[schemars(with = "String")]
    pub role: Role,
    /// The projects that it is for; all if there are none.
    #[serde(default)]
    pub projects: Vec<String>,
    /// How long it is good [s]; for ever if absent.
    #[serde(default)]
    pub ttl_seconds: Option<u32>,
}

/// A token as it is shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TokenInfo {
    /// What to call it, for instance to revoke it.
    pub id: String,
    /// For people.
    pub name: String,
    /// What its bearer may do.
    #[schemars(with = "String")]
    pub role: Role,
    /// The projects that it is for; all if there are none.
    pub projects: Vec<String>,
    /// When it was issued [ms since 1970].
    pub created_ms: i64,
    /// From when on it is worth nothing [ms since 1970].
    pub expires_ms: Option<i64>,
    /// When it was revoked [ms since 1970].
    pub revoked_ms: Option<i64>,
    /// When it was last used, to a minute [ms since 1970].
    pub used_ms: Option<i64>,
    /// Who issued it.
    pub issued_by: String,
    /// The token itself: only in the answer to the request that issued it.
    #[serde(default, with = "shown", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub token: Option<Secret>,
}

/// Secrets as JSON: here alone, where one is handed to whoever asked for it.
pub(super) mod shown {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    use crate::access::Secret;

    pub(in crate::api) fn serialize<S: Serializer>(secret: &Option<Secret>, serializer: S) -> Result<S::Ok, S::Error> {
        secret.as_ref().map(Secret::expose).serialize(serializer)
    }

    pub(in crate::api) fn deserialize<'a, D: Deserializer<'a>>(deserializer: D) -> Result<Option<Secret>, D::Error> {
        let text = Option::<String>::deserialize(deserializer)?;
        text.map(|text| Secret::parse(&text).map_err(de::Error::custom)).transpose()
    }
}

/// All tokens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Tokens {
    /// Newest first.
    pub tokens: Vec<TokenInfo>,
}

impl From<TokenView> for TokenInfo {
    fn from(TokenView { id, token, used }: TokenView) -> Self {
        Self {
            id,
            name: token.name,
            role: token.role,
            projects: token.projects,
            created_ms: token.created_ms,
            expires_ms: token.expires_ms,
            revoked_ms: token.revoked_ms,
            used_ms: used.map(Timestamp::millis),
            issued_by: token.issued_by,
            token: None,
        }
    }
}

/// `GET /tokens`.
pub(super) async fn list(State(service): State<Handle>) -> Result<Json<Tokens>, Problem> {
    Ok(Json(Tokens { tokens: service.gate().tokens().await?.into_iter().map(Into::into).collect() }))
}

/// `POST /tokens`: the answer holds the token, and no later one does.
pub(super) async fn issue(
    State(service): State<Handle>,
    Extension(caller): Extension<Caller>,
    body: Result<Json<TokenRequest>, JsonRejection>,
) -> Result<Response, Problem> {
    let Json(asked) = body?;
    if !asked.projects.is_empty() {
        // A bound that nobody keeps is worse than none.
        let detail = "tokens are good for all projects: whose job is whose is not asked of them; leave `projects` out";
        return Err(Problem::field("projects", detail));
    }
    let ttl = asked.ttl_seconds.map(|seconds| Duration::from_secs(seconds.into()));
    let new = NewToken { name: asked.name, role: asked.role, projects: asked.projects, ttl };
    let issued = service.gate().issue(new, &caller.name).await?;
    tracing::info!(id = %issued.view.id, name = %issued.view.token.name, role = %issued.view.token.role, by = %caller.name, "token issued");
    let info = TokenInfo { token: Some(issued.secret.clone()), ..issued.view.into() };
    Ok((StatusCode::CREATED, [(axum::http::header::CACHE_CONTROL, "no-store")], Json(info)).into_response())
}

/// `DELETE /tokens/{token}`.
pub(super) async fn revoke(
    State(service): State<Handle>,
    Extension(caller): Extension<Caller>,
    Path(token): Path<String>,
) -> Result<Json<TokenInfo>, Problem> {
    let view = service.gate().revoke(&token).await?;
    tracing::info!(id = %view.id, name = %view.token.name, by = %caller.name, "token revoked");
    Ok(Json(view.into()))
}
