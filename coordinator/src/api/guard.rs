//! Who may ask: whoever has a token with the role that an address needs, and pages of this machine alone.
//!
//! Everybody is identified first, even where nothing lives: without a token there is nothing to be found out. What an address needs
//! stands in the table of `roles`.
//!
//! A web page from elsewhere can make the visitor's browser send requests to loopback. Browsers name that page in `Origin`, and a
//! name that was pointed at 127.0.0.1 in `Host`: both must be of this machine.

use std::net::IpAddr;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::problem::Problem;
use super::roles::{self, Needs};
use crate::access::{Caller, Denied, Refusal};
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
    request.extensions_mut().insert(standing);
    next.run(request).await
}

/// Lets a request through to an address if whoever asks has the role that it needs.
pub(super) async fn authorise(path: MatchedPath, mut request: Request, next: Next) -> Response {
    let below = path.as_str().strip_prefix(super::ROOT).unwrap_or(path.as_str());
    let needed = match roles::needs(request.method(), below) {
        Some(Needs::Nothing) => return next.run(request).await,
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
            next.run(request).await
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

/// Lets a request through if neither its `Host` nor its `Origin` is of another machine.
pub(super) async fn local_only(request: Request, next: Next) -> Response {
    match check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

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
}
