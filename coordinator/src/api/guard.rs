//! Who may ask: programs and pages of this machine, until there are tokens.
//!
//! A web page from elsewhere can make the visitor's browser send requests to loopback. Browsers name that page in `Origin`, and a
//! name that was pointed at 127.0.0.1 in `Host`: both must be of this machine.

use std::net::IpAddr;

use axum::extract::Request;
use axum::http::{HeaderMap, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::problem::Problem;

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
    fn a_page_from_elsewhere_is_refused() {
        let mut headers = HeaderMap::new();
        assert!(check(&headers).is_ok());
        headers.insert(header::HOST, "127.0.0.1:7700".parse().unwrap());
        assert!(check(&headers).is_ok());
        headers.insert(header::ORIGIN, "https://example.org".parse().unwrap());
        assert_eq!(check(&headers).unwrap_err().status, 403);
    }
}
