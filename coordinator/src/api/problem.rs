//! Errors as people and programs read them over HTTP: problem details (RFC 9457), naming what was wrong and where.

use axum::Json;
use axum::extract::multipart::{MultipartError, MultipartRejection};
use axum::extract::rejection::{BytesRejection, JsonRejection, QueryRejection};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gradfarm_core::scene;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::error::Error;

/// A problem: the body of every answer that is not a success.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Problem {
    /// The sort of problem, as a URN: `urn:gradfarm:problem:` and one of a few words. Programs go by this.
    #[serde(rename = "type")]
    pub kind: String,
    /// The same for people; equal for all problems of the sort.
    pub title: String,
    /// HTTP status.
    pub status: u16,
    /// What was wrong this time.
    pub detail: String,
    /// More about this sort of problem: `file`, `path`, `line`, `column`, `found`, `expected` for scenes, `missing` for assets.
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

/// Media type of a [`Problem`].
pub const MEDIA_TYPE: &str = "application/problem+json";

impl Problem {
    fn new(status: StatusCode, word: &str, title: &str, detail: impl Into<String>) -> Self {
        Self {
            kind: format!("urn:gradfarm:problem:{word}"),
            title: title.to_owned(),
            status: status.as_u16(),
            detail: detail.into(),
            more: Map::new(),
        }
    }

    fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.more.insert(key.to_owned(), value.into());
        self
    }

    /// 400: the request itself cannot be read.
    pub fn malformed(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "malformed", "The request cannot be understood", detail)
    }

    /// 400: a field of a JSON body or a form.
    pub fn field(path: &str, detail: impl Into<String>) -> Self {
        Self::malformed(detail).with("path", path)
    }

    /// 401: nobody knows who asks.
    pub fn unauthorised(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNAUTHORIZED, "unauthorised", "A token is needed", detail)
    }

    /// 429: whoever asks does so too often.
    pub fn too_often(seconds: f64) -> Self {
        let detail = format!("too many requests; there is room for the next one in {seconds:.1} s");
        Self::new(StatusCode::TOO_MANY_REQUESTS, "too-often", "Too many requests", detail)
    }

    /// 408: the request took too long.
    pub fn too_slow(limit: std::time::Duration) -> Self {
        let detail = format!("the request was not done within {} s", limit.as_secs());
        Self::new(StatusCode::REQUEST_TIMEOUT, "too-slow", "The request took too long", detail)
    }

    /// 503: who asks cannot be found out at the moment.
    pub fn unknown_for_now() -> Self {
        let detail = "the store of tokens does not answer; try again";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "The coordinator cannot tell who asks", detail)
    }

    /// 403: the request comes from somewhere it should not.
    pub fn forbidden(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, "forbidden", "The request is not allowed", detail)
    }

    /// 404: the thing or the address does not exist.
    pub fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "not-found", "There is no such thing", detail)
    }

    /// 405: the address exists, but not for this method.
    pub fn method() -> Self {
        let detail = "the `allow` header of this answer lists the methods of this address";
        Self::new(StatusCode::METHOD_NOT_ALLOWED, "method", "The address does not take this method", detail)
    }

    /// 409: right in itself, but not in the state that things are in.
    pub fn conflict(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, "conflict", "Not possible in this state", detail)
    }

    /// 413: more bytes than are taken.
    pub fn too_large(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, "too-large", "More than is taken", detail)
    }

    /// 415: a body of a kind that is not read.
    pub fn media_type(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "media-type", "The body is of another kind than expected", detail)
    }

    /// 503: nobody can answer now, but soon.
    pub fn unavailable(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "Not available at the moment", detail)
    }

    /// 503: requests should go elsewhere for now.
    pub fn unready(reasons: &[String]) -> Self {
        let problem = Self::new(StatusCode::SERVICE_UNAVAILABLE, "unready", "The coordinator is not ready", reasons.join("; "));
        problem.with("reasons", reasons.to_vec())
    }

    /// 503: the coordinator is going down.
    pub fn stopping() -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "stopping", "The coordinator is stopping", "try again when it is back")
    }

    /// 422: right in form, but not possible.
    pub fn unprocessable(word: &str, title: &str, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, word, title, detail)
    }

    /// 422: the scene refers to files that were not uploaded.
    pub fn missing_assets(names: &[String]) -> Self {
        let listed = names.join(", ");
        let detail = format!(
            "the scene refers to files that were not uploaded: {listed}. With curl, add -F 'asset=@FILE;filename=NAME' for each, NAME as in the scene"
        );
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "missing-assets", "The scene is incomplete", detail).with("missing", names.to_vec())
    }

    /// What the HTTP layer found while it read a body.
    fn of_status(status: StatusCode, detail: String) -> Self {
        if status == StatusCode::PAYLOAD_TOO_LARGE {
            Self::too_large(format!("{detail}; at most {} bytes are taken", super::UPLOAD_BYTES))
        } else {
            Self::malformed(detail)
        }
    }

    /// 500: our fault. The cause goes to the log, not to the client.
    pub fn internal(cause: &dyn std::error::Error) -> Self {
        tracing::error!(error = %cause, "request failed");
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", "The coordinator failed", "the cause is in the coordinator's log")
    }
}

impl From<scene::Error> for Problem {
    fn from(error: scene::Error) -> Self {
        let detail = error.to_string();
        let mut problem = Self::new(StatusCode::UNPROCESSABLE_ENTITY, "scene", "The scene is wrong", detail)
            .with("file", error.place.file)
            .with("path", error.place.path)
            .with("found", error.found)
            .with("expected", error.expected);
        for (key, value) in [("line", error.place.line), ("column", error.place.column)] {
            if let Some(value) = value {
                problem = problem.with(key, value);
            }
        }
        problem
    }
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        let detail = error.to_string();
        match error {
            Error::NoJob(_) | Error::NoFrame { .. } | Error::NoToken(_) | Error::NoWorker(_) => Self::not_found(detail),
            Error::NotReady { .. } | Error::NotShown { .. } | Error::Over { .. } | Error::NothingFailed(_) | Error::TokenReused { .. } => {
                Self::conflict(detail)
            }
            Error::Invalid { what, .. } => Self::field(what, detail),
            Error::Scene(fault) => fault.into(),
            Error::Plan(_) | Error::Units(_) => Self::unprocessable("plan", "The scene cannot be rendered as asked", detail),
            Error::Unlisted { names } => Self::missing_assets(&names),
            Error::MissingAssets { digests } => {
                let digests: Vec<String> = digests.iter().map(ToString::to_string).collect();
                Self::unprocessable("missing-assets", "The scene is incomplete", detail).with("missing", digests)
            }
            Error::Stopped => Self::stopping(),
            Error::Unowned { .. } => Self::unavailable(detail),
            Error::NotLoopback(_)
            | Error::Private(_)
            | Error::Tls(_)
            | Error::Oidc(_)
            | Error::Listen { .. }
            | Error::Io { .. }
            | Error::Transport(_)
            | Error::InUse(_)
            | Error::Store(_)
            | Error::Blob(_) => Self::internal(&error),
        }
    }
}

impl From<BytesRejection> for Problem {
    fn from(rejection: BytesRejection) -> Self {
        Self::of_status(rejection.status(), rejection.body_text())
    }
}

impl From<MultipartRejection> for Problem {
    fn from(rejection: MultipartRejection) -> Self {
        Self::of_status(rejection.status(), rejection.body_text())
    }
}

impl From<MultipartError> for Problem {
    fn from(error: MultipartError) -> Self {
        Self::of_status(error.status(), error.body_text())
    }
}

impl From<JsonRejection> for Problem {
    fn from(rejection: JsonRejection) -> Self {
        Self::of_status(rejection.status(), rejection.body_text())
    }
}

impl From<QueryRejection> for Problem {
    fn from(rejection: QueryRejection) -> Self {
        Self::malformed(rejection.body_text())
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = (status, Json(self)).into_response();
        response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
        if status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer realm=\"gradfarm\""));
        }
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scene_errors_keep_their_place() {
        let error = scene::Error::new(scene::ErrorKind::Invalid, "a.json", "film.width", "0", "1 to 65536").at(3, 7);
        let value = serde_json::to_value(Problem::from(error)).unwrap();
        assert_eq!(value["type"], "urn:gradfarm:problem:scene");
        assert_eq!(value["status"], 422);
        assert_eq!(value["path"], "film.width");
        assert_eq!(value["line"], 3);
        assert_eq!(value["expected"], "1 to 65536");
        let back: Problem = serde_json::from_value(value).unwrap();
        assert_eq!(back.more["found"], "0");
    }
}
