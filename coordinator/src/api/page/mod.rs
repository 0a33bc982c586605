//! The web page: a few files inside the program, which speak to the API like any other client.
//!
//! Nothing is loaded from elsewhere, and the browser is told to see to that. The files hold no secret, so anybody may read them; what they
//! ask the API for needs whatever the API asks for.

use axum::Router;
use axum::extract::Path;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use super::problem::Problem;

/// What the page may load and do: its own files and its own coordinator.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
                      form-action 'none'; base-uri 'none'; frame-ancestors 'none'";

/// A file of the page.
struct Part {
    name: &'static str,
    media_type: &'static str,
    bytes: &'static [u8],
}

const SCRIPT: &str = "text/javascript; charset=utf-8";

const INDEX: Part = Part { name: "index.html", media_type: "text/html; charset=utf-8", bytes: include_bytes!("index.html") };

const PARTS: &[Part] = &[
    Part { name: "style.css", media_type: "text/css; charset=utf-8", bytes: include_bytes!("style.css") },
    Part { name: "icon.svg", media_type: "image/svg+xml", bytes: include_bytes!("icon.svg") },
    Part { name: "app.js", media_type: SCRIPT, bytes: include_bytes!("app.js") },
    Part { name: "client.js", media_type: SCRIPT, bytes: include_bytes!("client.js") },
    Part { name: "dom.js", media_type: SCRIPT, bytes: include_bytes!("dom.js") },
    Part { name: "jobs.js", media_type: SCRIPT, bytes: include_bytes!("jobs.js") },
    Part { name: "job.js", media_type: SCRIPT, bytes: include_bytes!("job.js") },
    Part { name: "facts.js", media_type: SCRIPT, bytes: include_bytes!("facts.js") },
    Part { name: "curve.js", media_type: SCRIPT, bytes: include_bytes!("curve.js") },
    Part { name: "picture.js", media_type: SCRIPT, bytes: include_bytes!("picture.js") },
    Part { name: "colour.js", media_type: SCRIPT, bytes: include_bytes!("colour.js") },
    Part { name: "workers.js", media_type: SCRIPT, bytes: include_bytes!("workers.js") },
    Part { name: "api.js", media_type: SCRIPT, bytes: include_bytes!("api.js") },
    Part { name: "submit.js", media_type: SCRIPT, bytes: include_bytes!("submit.js") },
];

/// The routes of the page: `/` and its files below `/page/`.
pub(super) fn routes() -> Router {
    Router::new().route("/", get(|headers: HeaderMap| async move { INDEX.answer(&headers) })).route("/page/{name}", get(part))
}

async fn part(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, Problem> {
    let part = PARTS.iter().find(|part| part.name == name);
    part.map(|part| part.answer(&headers)).ok_or_else(|| Problem::not_found(format!("the page has no file {name:?}")))
}

impl Part {
    fn answer(&self, headers: &HeaderMap) -> Response {
        let tag = format!("\"{}\"", &blake3::hash(self.bytes).to_hex()[..16]);
        let fixed = [
            (header::CONTENT_TYPE, self.media_type),
            // Asked for again each time, and answered in a few bytes unless the program was replaced.
            (header::CACHE_CONTROL, "no-cache"),
            (header::CONTENT_SECURITY_POLICY, POLICY),
            (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
            (header::REFERRER_POLICY, "no-referrer"),
        ];
        let known = headers.get(header::IF_NONE_MATCH).and_then(|value| value.to_str().ok()).unwrap_or_default();
        if known.split(',').any(|one| one.trim() == tag) {
            return (StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response();
        }
        (fixed, [(header::ETAG, tag)], self.bytes).into_response()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_that_is_named_is_there_and_nothing_comes_from_elsewhere() {
        for part in PARTS.iter().chain([&INDEX]) {
            let text = std::str::from_utf8(part.bytes).unwrap();
            for other in ["https://", "//cdn", "@import url"] {
                assert!(!text.contains(other), "{} holds {other}", part.name);
            }
            for name in text.split(['"', '\'']).filter_map(|word| word.strip_prefix("./").or(word.strip_prefix("/page/"))) {
                assert!(PARTS.iter().any(|part| part.name == name), "{} names {name:?}", part.name);
            }
            assert!(text.lines().count() <= 500, "{} is long", part.name);
        }
    }
}
