//! Tokens of an identity provider (OpenID Connect): JWTs whose signature, issuer, audience and time are checked with the provider's
//! published keys.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use jsonwebtoken::jwk::{Jwk, JwkSet};
use jsonwebtoken::{Algorithm, DecodingKey, Validation, decode, decode_header};
use serde::Deserialize;
use serde_json::{Map, Value};
use tokio::sync::Mutex;

use super::role::Role;
use super::token::{Caller, Denied};

/// Signatures that are taken: with public keys only, so that nobody signs with what everybody may read.
const ALGORITHMS: [Algorithm; 9] = [
    Algorithm::RS256,
    Algorithm::RS384,
    Algorithm::RS512,
    Algorithm::PS256,
    Algorithm::PS384,
    Algorithm::PS512,
    Algorithm::ES256,
    Algorithm::ES384,
    Algorithm::EdDSA,
];
/// By how much clocks may differ [s].
const LEEWAY: u64 = 30;
/// How long keys are believed, and how soon they may be asked for again when a token names one that is not among them.
const KEYS: (Duration, Duration) = (Duration::from_secs(600), Duration::from_secs(10));
/// How long the provider may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// Largest answer of the provider [bytes].
const LARGEST: usize = 1 << 20;
/// What role names may begin with in a claim that other programs use, too.
const PREFIX: &str = "gradfarm-";

/// Which provider is believed, and what of its tokens says the role.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OidcOptions {
    /// Its address, as its tokens name it.
    pub issuer: String,
    /// What its tokens for this farm are for.
    pub audience: String,
    /// The claim that lists roles; steps into objects are separated by dots.
    pub role_claim: String,
}

/// An identity provider.
#[derive(Debug)]
pub(super) struct Oidc {
    options: OidcOptions,
    http: reqwest::Client,
    keys: Mutex<Option<Keys>>,
}

#[derive(Clone, Debug)]
struct Keys {
    set: Arc<JwkSet>,
    read: Instant,
}

#[derive(Deserialize)]
struct Discovery {
    issuer: String,
    jwks_uri: String,
}

#[derive(Deserialize)]
struct Claims {
    sub: String,
    #[serde(flatten)]
    more: HashMap<String, Value>,
}

/// The provider cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("identity provider {issuer}: {reason}")]
pub struct OidcError {
    issuer: String,
    reason: String,
}

/// Whether a text has the form of a JWT.
pub(super) fn is_jwt(token: &str) -> bool {
    token.split('.').count() == 3 && decode_header(token).is_ok()
}

impl Oidc {
    /// A provider; nothing is asked of it yet.
    ///
    /// # Errors
    /// If its address is not one that can be trusted: `https://`, or `http://` on this machine.
    pub(super) fn new(options: OidcOptions) -> Result<Self, OidcError> {
        let fault = |reason: String| OidcError { issuer: options.issuer.clone(), reason };
        check_url(&options.issuer).map_err(fault)?;
        crate::crypto::provide();
        let http = reqwest::Client::builder().timeout(PATIENCE).redirect(reqwest::redirect::Policy::none()).build();
        let http = http.map_err(|problem| fault(problem.to_string()))?;
        Ok(Self { options, http, keys: Mutex::default() })
    }

    /// Who a token is of.
    ///
    /// # Errors
    /// Why it is worth nothing here.
    pub(super) async fn identify(&self, token: &str) -> Result<Caller, Denied> {
        let refused = |reason: &str| Denied::Provider { reason: reason.to_owned() };
        let header = decode_header(token).map_err(|_| Denied::Unknown)?;
        if !ALGORITHMS.contains(&header.alg) {
            return Err(refused("it is signed in a way that is not taken"));
        }
        let kid = header.kid.ok_or_else(|| refused("it names no key"))?;
        let key = self.key(&kid).await.map_err(|problem| {
            tracing::warn!(%problem, "the identity provider could not be asked for its keys");
            refused("the identity provider's keys could not be read")
        })?;
        let key = key.ok_or_else(|| refused("its key is not one of the identity provider's"))?;
        let key = DecodingKey::from_jwk(&key).map_err(|_| refused("its key is of a kind that is not taken"))?;
        let mut validation = Validation::new(header.alg);
        validation.leeway = LEEWAY;
        validation.validate_nbf = true;
        validation.set_audience(&[&self.options.audience]);
        validation.set_issuer(&[&self.options.issuer]);
        validation.set_required_spec_claims(&["exp", "iss", "aud", "sub"]);
        let claims = decode::<Claims>(token, &key, &validation).map_err(|fault| refused(&fault.to_string()))?.claims;
        let role = role_of(&claims.more, &self.options.role_claim);
        let name = ["preferred_username", "email"].iter().find_map(|claim| claims.more.get(*claim)?.as_str());
        let name: String = name.unwrap_or(&claims.sub).chars().filter(|c| !c.is_control()).take(100).collect();
        let role = role.ok_or_else(|| Denied::NoRole { who: name.clone(), claim: self.options.role_claim.clone() })?;
        let id = super::secret::hash(&format!("{} {}", self.options.issuer, claims.sub));
        Ok(Caller { id: format!("oidc-{}", super::token::id_of(&id)), name, role, projects: Vec::new() })
    }

    /// A key by name. One that is not known is asked for, but not for everybody who makes up a name.
    async fn key(&self, kid: &str) -> Result<Option<Jwk>, OidcError> {
        let mut keys = self.keys.lock().await;
        let found = |keys: &Keys| keys.set.find(kid).cloned();
        if let Some(known) = &*keys {
            let age = known.read.elapsed();
            if let Some(key) = found(known).filter(|_| age < KEYS.0) {
                return Ok(Some(key));
            }
            if age < KEYS.1 {
                return Ok(found(known));
            }
        }
        match self.read_keys().await {
            Ok(set) => {
                let read = keys.insert(Keys { set: Arc::new(set), read: Instant::now() });
                Ok(found(read))
            }
            // While the provider is away, the keys that are known stay good.
            Err(problem) => match keys.as_ref().and_then(found) {
                Some(key) => Ok(Some(key)),
                None => Err(problem),
            },
        }
    }

    async fn read_keys(&self) -> Result<JwkSet, OidcError> {
        let fault = |reason: String| OidcError { issuer: self.options.issuer.clone(), reason };
        let url = format!("{}/.well-known/openid-configuration", self.options.issuer.trim_end_matches('/'));
        let discovery: Discovery = self.read(&url).await.map_err(fault)?;
        if discovery.issuer != self.options.issuer {
            return Err(fault(format!("it calls itself {:?}", discovery.issuer)));
        }
        check_url(&discovery.jwks_uri).map_err(fault)?;
        self.read(&discovery.jwks_uri).await.map_err(fault)
    }

    async fn read<T: for<'a> Deserialize<'a>>(&self, url: &str) -> Result<T, String> {
        let mut response = self.http.get(url).send().await.map_err(|problem| problem.to_string())?;
        if !response.status().is_success() {
            return Err(format!("{url} answered {}", response.status()));
        }
        let mut body = Vec::new();
        while let Some(chunk) = response.chunk().await.map_err(|problem| problem.to_string())? {
            if body.len() + chunk.len() > LARGEST {
                return Err(format!("{url} answered more than {LARGEST} bytes"));
            }
            body.extend_from_slice(&chunk);
        }
        serde_json::from_slice(&body).map_err(|problem| format!("{url}: {problem}"))
    }
}

/// Keys come over encrypted connections, or from this machine.
fn check_url(url: &str) -> Result<(), String> {
    let read = reqwest::Url::parse(url).map_err(|fault| format!("{url:?} is no address: {fault}"))?;
    let host = read.host_str().unwrap_or_default();
    let here = host == "localhost" || host.trim_matches(['[', ']']).parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback());
    match read.scheme() {
        "https" => Ok(()),
        "http" if here => Ok(()),
        _ => Err(format!("{url:?} found, expected an address that begins with https://")),
    }
}

/// The highest role that a claim lists: a text or a list of texts, each a role's name, with `gradfarm-` in front or without. Workers'
/// roles are not for people.
fn role_of(claims: &HashMap<String, Value>, path: &str) -> Option<Role> {
    let mut steps = path.split('.');
    let first = claims.get(steps.next()?)?;
    let value = steps.try_fold(first, |value, step| value.as_object().and_then(|object: &Map<String, Value>| object.get(step)))?;
    let texts: Vec<&str> = match value {
        Value::String(text) => text.split_whitespace().collect(),
        Value::Array(all) => all.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    let roles = texts.iter().filter_map(|text| text.strip_prefix(PREFIX).unwrap_or(text).parse::<Role>().ok());
    roles.filter(|role| *role != Role::Worker).reduce(|best, role| if role.covers(best) { role } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn role(claims: Value, path: &str) -> Option<Role> {
        role_of(&serde_json::from_value(claims).unwrap(), path)
    }

    #[test]
    fn the_highest_role_of_the_claim_counts() {
        assert_eq!(role(json!({ "roles": ["viewer", "gradfarm-operator", "other"] }), "roles"), Some(Role::Operator));
        assert_eq!(role(json!({ "scope": "openid gradfarm-submitter" }), "scope"), Some(Role::Submitter));
        assert_eq!(role(json!({ "realm_access": { "roles": ["admin"] } }), "realm_access.roles"), Some(Role::Admin));
        for (claims, path) in [
            (json!({}), "roles"),
            (json!({ "roles": ["worker", "root"] }), "roles"),
            (json!({ "roles": 7 }), "roles"),
            (json!({ "roles": { "a": 1 } }), "roles.b"),
            (json!({ "roles": ["admin"] }), "roles.x"),
        ] {
            assert_eq!(role(claims.clone(), path), None, "{claims}");
        }
    }

    #[test]
    fn keys_do_not_come_in_the_clear() {
        for good in ["https://id.example.org", "http://127.0.0.1:8080/realm", "http://localhost:1"] {
            assert!(check_url(good).is_ok(), "{good}");
        }
        for bad in ["http://id.example.org", "ftp://127.0.0.1", "id.example.org", ""] {
            assert!(check_url(bad).is_err(), "{bad}");
        }
    }
}
