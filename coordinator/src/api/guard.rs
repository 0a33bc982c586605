//! Who may ask: whoever has a token with the role that an address needs, and pages of this machine alone.
//!
//! Everybody is identified first, even where nothing lives: without a token there is nothing to be found out. What an address needs
//! stands in the table of `roles`.
//!
//! A web page from elsewhere can make the visitor's browser send requests to loopback. Browsers name that page in `Origin`, and a
//! name that was pointed at 127.0.0.1 in `Host`: without TLS both must be of this machine.

use std::net::IpAddr;
use std::time::Duration;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::problem::Problem;
use super::roles::{self, Needs};
use crate::access::{Caller, Denied, Rate, Refusal};
use crate::service::Handle;

/// Who asks, as far as that could be found out.
#[derive(Clone, Debug)]
pub(super) enum Standing {
    /// Somebody with a good token.
    Known(Caller),
    /// Anybody else, and what to tell them.
    Stranger(Problem),
}

/// Finds out who asks, for what comes after.
pub(super) async fn identify(State(service): State<Handle>, mut request: Request, next: Next) -> Response {
    let standing = match bearer(request.headers()) {
        Ok(token) => match service.gate().identify(token).await {
            Ok(caller) => Standing::Known(caller),
            Err(refusal) => Standing::Stranger(refusal.into()),
        },
        Err(denied) => Standing::Stranger(denied.into()),
    };
    let (who, rate) = match &standing {
        Standing::Known(caller) => (caller.id.as_str(), KNOWN),
        Standing::Stranger(_) => ("strangers", STRANGERS),
    };
    let open =
        request.uri().path().strip_prefix(super::ROOT).is_some_and(|path| roles::needs(request.method(), path) == Some(Needs::Nothing));
    if !open && let Err(seconds) = service.gate().bear(who, rate) {
        let wait = HeaderValue::from(seconds.ceil().max(1.0) as u64);
        return ([(header::RETRY_AFTER, wait)], Problem::too_often(seconds)).into_response();
    }
    let changes = ![Method::GET, Method::HEAD, Method::OPTIONS].contains(request.method());
    if !changes {
        request.extensions_mut().insert(standing);
        return next.run(request).await;
    }
    let (name, id) = match &standing {
        Standing::Known(caller) => (caller.name.clone(), caller.id.clone()),
        Standing::Stranger(_) => ("nobody".to_owned(), String::new()),
    };
    let what = format!("{} {}", request.method(), request.uri().path());
    // Strangers must not be able to fill the log.
    let told = matches!(standing, Standing::Known(_)) || service.gate().bear("strangers in the log", LOGGED).is_ok();
    request.extensions_mut().insert(standing);
    let response = next.run(request).await;
    if told {
        service.gate().audit().note(&name, &id, &what, response.status().as_str()).await;
    }
    response
}

/// How often one token may be used: more than people and their programs do.
const KNOWN: Rate = Rate { per_second: 200.0, burst: 2000.0 };
/// How often all those who are not let in may ask, together.
const STRANGERS: Rate = Rate { per_second: 50.0, burst: 200.0 };
/// How many of their attempts are written down.
const LOGGED: Rate = Rate { per_second: 0.1, burst: 20.0 };
/// How long a request may take until its answer begins; with what it uploads, longer.
const PATIENCE: (Duration, Duration) = (Duration::from_secs(60), Duration::from_secs(3600));

/// Runs a request, for so long as one may take.
async fn run(path: &str, request: Request, next: Next) -> Response {
    let uploads = request.method() == Method::POST && ["/jobs", "/assets"].contains(&path);
    let limit = if uploads { PATIENCE.1 } else { PATIENCE.0 };
    match tokio::time::timeout(limit, next.run(request)).await {
        Ok(response) => response,
        Err(_) => Problem::too_slow(limit).into_response(),
    }
}

/// Lets a request through to an address if whoever asks has the role that it needs.
pub(super) async fn authorise(State(service): State<Handle>, path: MatchedPath, mut request: Request, next: Next) -> Response {
    let below = path.as_str().strip_prefix(super::ROOT).unwrap_or(path.as_str());
    let needed = match roles::needs(request.method(), below) {
        Some(Needs::Role(_)) if below == "/metrics" && service.metrics_open() => return run(below, request, next).await,
        Some(Needs::Nothing) => return run(below, request, next).await,
        Some(Needs::Role(role)) => role,
        // Nothing runs that has no place in the table.
        None => return undeclared(&request, below).into_response(),
    };
    let caller = match request.extensions().get::<Standing>() {
        Some(Standing::Known(caller)) => caller.clone(),
        _ => return stranger(&request).into_response(),
    };
    match caller.require(needed) {
        Ok(()) => {
            request.extensions_mut().insert(caller);
            run(below, request, next).await
        }
        Err(denied) => Problem::from(denied).into_response(),
    }
}

/// What somebody who was not identified is told.
fn stranger(request: &Request) -> Problem {
    match request.extensions().get::<Standing>() {
        Some(Standing::Stranger(problem)) => problem.clone(),
        _ => Denied::Missing.into(),
    }
}

/// The answer where nothing lives: to strangers the same as everywhere.
pub(super) async fn nowhere(request: Request) -> Problem {
    match request.extensions().get::<Standing>() {
        Some(Standing::Known(_)) => Problem::not_found(format!("nothing lives at {}", request.uri().path())),
        _ => stranger(&request),
    }
}

/// The answer to a method that an address does not have.
pub(super) async fn no_method(request: Request) -> Problem {
    match request.extensions().get::<Standing>() {
        Some(Standing::Known(_)) => Problem::method(),
        _ => stranger(&request),
    }
}

/// The answer to an address that nobody gave a role.
fn undeclared(request: &Request, path: &str) -> Problem {
    match request.extensions().get::<Standing>() {
        Some(Standing::Known(_)) => Problem::forbidden(format!("no role is declared for {} {path}", request.method())),
        _ => stranger(request),
    }
}

/// The token of a request, if it sent one.
fn bearer(headers: &HeaderMap) -> Result<Option<&str>, Denied> {
    let mut values = headers.get_all(header::AUTHORIZATION).iter();
    let Some(value) = values.next() else { return Ok(None) };
    let (scheme, token) = value.to_str().ok().and_then(|text| text.split_once(' ')).ok_or(Denied::Malformed)?;
    if values.next().is_some() || !scheme.eq_ignore_ascii_case("bearer") || token.trim().is_empty() {
        return Err(Denied::Malformed);
    }
    Ok(Some(token.trim()))
}

impl From<Denied> for Problem {
    fn from(denied: Denied) -> Self {
        let detail = denied.to_string();
        if denied.is_about_identity() { Problem::unauthorised(detail) } else { Problem::forbidden(detail) }
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Denied(denied) => denied.into(),
            Refusal::Store(fault) => {
                tracing::error!(%fault, "tokens cannot be read");
                Problem::unknown_for_now()
            }
        }
    }
}

/// Lets a request through if no page from elsewhere made a browser send it.
pub(super) async fn own_pages_only(State(service): State<Handle>, request: Request, next: Next) -> Response {
    let checked = if service.secured().is_some() { check_origin(request.headers()) } else { check(request.headers()) };
    match checked {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

/// With TLS: a name that was pointed at this machine has no certificate here, so the browser itself stops there, and `Host` is sound. A
/// page must have come from the same host.
fn check_origin(headers: &HeaderMap) -> Result<(), Problem> {
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    for origin in headers.get_all(header::ORIGIN) {
        let from = origin.to_str().ok().and_then(|origin| origin.strip_prefix("https://"));
        if from.is_none() || from != host {
            return Err(Problem::forbidden(format!("origin is {origin:?}, expected a page of this host or none")));
        }
    }
    Ok(())
}

/// Without TLS: both must be of this machine.
fn check(headers: &HeaderMap) -> Result<(), Problem> {
    for name in [header::HOST, header::ORIGIN] {
        for value in headers.get_all(&name) {
            let text = value.to_str().unwrap_or_default();
            if !is_local(text) {
                return Err(Problem::forbidden(format!("{name} is {text:?}, expected an address of this machine such as 127.0.0.1")));
            }
        }
    }
    Ok(())
}

/// Whether the host in `127.0.0.1:7700`, `[::1]`, `http://localhost:7700` … is this machine.
fn is_local(authority_or_origin: &str) -> bool {
    let Ok(uri) = authority_or_origin.parse::<Uri>() else { return false };
    let Some(host) = uri.host() else { return false };
    host.eq_ignore_ascii_case("localhost")
        || host.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_loopback_is_local() {
        for good in
            ["127.0.0.1:7700", "127.0.0.1", "localhost:1", "[::1]:7700", "http://127.0.0.1:7700", "http://localhost", "https://[::1]"]
        {
            assert!(is_local(good), "{good}");
        }
        for bad in
            ["", "null", "example.org", "http://example.org", "http://127.0.0.1.example.org", "10.0.0.1:7700", "localhost.example.org:7700"]
        {
            assert!(!is_local(bad), "{bad}");
        }
    }

    #[test]
    fn tokens_are_taken_from_one_header_alone() {
        let with = |value: &str| HeaderMap::from_iter([(header::AUTHORIZATION, value.parse().unwrap())]);
        assert_eq!(bearer(&HeaderMap::new()), Ok(None));
        assert_eq!(bearer(&with("Bearer abc")), Ok(Some("abc")));
        assert_eq!(bearer(&with("bearer  abc ")), Ok(Some("abc")));
        for bad in ["Basic abc", "Bearer", "Bearer ", "abc"] {
            assert_eq!(bearer(&with(bad)), Err(Denied::Malformed), "{bad}");
        }
        let mut twice = with("Bearer abc");
        twice.append(header::AUTHORIZATION, "Bearer def".parse().unwrap());
        assert_eq!(bearer(&twice), Err(Denied::Malformed));
    }

    #[test]
    fn a_page_from_elsewhere_is_refused() {
        let mut headers = HeaderMap::new();
        assert!(check(&headers).is_ok());
        headers.insert(header::HOST, "127.0.0.1:7700".parse().unwrap());
        assert!(check(&headers).is_ok());
        headers.insert(header::ORIGIN, "https://example.org".parse().unwrap());
        assert_eq!(check(&headers).unwrap_err().status, 403);
    }

    #[test]
    fn with_tls_pages_of_the_same_host_may_ask() {
        let mut headers = HeaderMap::from_iter([(header::HOST, "farm.example.org:7700".parse().unwrap())]);
        assert!(check_origin(&headers).is_ok(), "no page at all");
        for (origin, good) in [
            ("https://farm.example.org:7700", true),
            ("https://farm.example.org", false),
            ("http://farm.example.org:7700", false),
            ("https://evil.example.org:7700", false),
            ("null", false),
        ] {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
            assert_eq!(check_origin(&headers).is_ok(), good, "{origin}");
        }
    }
}
