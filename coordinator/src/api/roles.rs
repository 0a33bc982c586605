//! Who may use which address: one table. An address that is not in it is closed to everybody.

use axum::http::Method;

use crate::access::Role;

/// What an address needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing: anybody may ask, without a token.
    Nothing,
    /// A token with at least this role.
    Role(Role),
}

/// One address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its method; what is said of `GET` holds for `HEAD` as well.
    pub method: &'static str,
    /// Its path below the root, as the router writes it.
    pub path: &'static str,
    /// What it needs.
    pub needs: Needs,
}

const fn entry(method: &'static str, path: &'static str, role: Role) -> Entry {
    Entry { method, path, needs: Needs::Role(role) }
}

/// Every address.
pub const TABLE: &[Entry] = &[
    Entry { method: "GET", path: "/health", needs: Needs::Nothing },
    Entry { method: "GET", path: "/ready", needs: Needs::Nothing },
    entry("GET", "/jobs", Role::Viewer),
    entry("POST", "/jobs", Role::Submitter),
    entry("GET", "/jobs/{job}", Role::Viewer),
    entry("DELETE", "/jobs/{job}", Role::Submitter),
    entry("PATCH", "/jobs/{job}", Role::Submitter),
    entry("POST", "/jobs/{job}/cancel", Role::Submitter),
    entry("POST", "/jobs/{job}/pause", Role::Submitter),
    entry("POST", "/jobs/{job}/resume", Role::Submitter),
    entry("POST", "/jobs/{job}/retry", Role::Submitter),
    entry("GET", "/jobs/{job}/events", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/tiles", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/frame.exr", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/frame.png", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/frame.json", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/preview.png", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/preview.pfm", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/accuracy", Role::Viewer),
    entry("GET", "/jobs/{job}/frames/{frame}/accuracy.svg", Role::Viewer),
    entry("POST", "/assets", Role::Submitter),
    entry("HEAD", "/assets/{digest}", Role::Viewer),
    entry("GET", "/workers", Role::Viewer),
    entry("POST", "/workers/{worker}/drain", Role::Operator),
    entry("POST", "/workers/{worker}/resume", Role::Operator),
    entry("GET", "/events", Role::Viewer),
    entry("GET", "/metrics", Role::Viewer),
    entry("GET", "/openapi.json", Role::Viewer),
    entry("GET", "/tokens", Role::Admin),
    entry("POST", "/tokens", Role::Admin),
    entry("DELETE", "/tokens/{token}", Role::Admin),
    entry("GET", "/audit", Role::Admin),
    entry("GET", "/join-tokens", Role::Admin),
    entry("POST", "/join-tokens", Role::Admin),
    entry("DELETE", "/join-tokens/{token}", Role::Admin),
    entry("GET", "/enrolments", Role::Operator),
    entry("DELETE", "/enrolments/{worker}", Role::Operator),
];

/// What the table says of a method and a path below the root.
pub(super) fn needs(method: &Method, path: &str) -> Option<Needs> {
    let find = |method: &str| TABLE.iter().find(|entry| entry.method == method && entry.path == path).map(|entry| entry.needs);
    find(method.as_str()).or_else(|| if method == Method::HEAD { find("GET") } else { None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_and_the_router_name_the_same_addresses() {
        let router = include_str!("mod.rs");
        let routes = router.lines().filter_map(|line| line.trim().strip_prefix(".route(\"")?.split_once('"'));
        let mut named: Vec<&str> = routes.map(|(path, _)| path).collect();
        let mut listed: Vec<&str> = TABLE.iter().map(|entry| entry.path).collect();
        for paths in [&mut named, &mut listed] {
            paths.sort_unstable();
            paths.dedup();
        }
        assert_eq!(named, listed);
        assert!(named.len() > 10, "is the router still where it was?");
    }

    #[test]
    fn only_health_and_readiness_are_open() {
        let open: Vec<&str> = TABLE.iter().filter(|entry| entry.needs == Needs::Nothing).map(|entry| entry.path).collect();
        assert_eq!(open, ["/health", "/ready"]);
        assert_eq!(needs(&Method::HEAD, "/health"), Some(Needs::Nothing));
        assert_eq!(needs(&Method::PATCH, "/health"), None);
        assert!(TABLE.iter().all(|entry| entry.needs != Needs::Role(Role::Worker)), "workers have a port of their own");
    }
}
