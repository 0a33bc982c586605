//! Tokens of an identity provider: a small one of our own, and everything that can be wrong with what it signs.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::{SystemTime, UNIX_EPOCH};

use axum::routing::get;
use axum::{Json, Router};
use common::{Server, client_with};
use jsonwebtoken::jwk::Jwk;
use jsonwebtoken::{Algorithm, EncodingKey, Header, encode};
use reqwest::StatusCode;
use serde_json::{Value, json};

/// A key of the provider.
struct Key {
    kid: &'static str,
    key: EncodingKey,
}

impl Key {
    fn draw(kid: &'static str) -> Self {
        let pair = rcgen::KeyPair::generate().unwrap();
        Self { kid, key: EncodingKey::from_ec_pem(pair.serialize_pem().as_bytes()).unwrap() }
    }

    fn public(&self) -> Value {
        let mut jwk = Jwk::from_encoding_key(&self.key, Algorithm::ES256).unwrap();
        jwk.common.key_id = Some(self.kid.to_owned());
        serde_json::to_value(jwk).unwrap()
    }

    fn sign(&self, claims: &Value) -> String {
        let header = Header { kid: Some(self.kid.to_owned()), ..Header::new(Algorithm::ES256) };
        encode(&header, claims, &self.key).unwrap()
    }
}

/// A provider that publishes these keys.
async fn provider(keys: Arc<Mutex<Vec<Value>>>) -> String {
    let listener = tokio::net::TcpListener::bind(SocketAddr::from(([127, 0, 0, 1], 0))).await.unwrap();
    let issuer = format!("http://{}", listener.local_addr().unwrap());
    let discovery = json!({ "issuer": issuer, "jwks_uri": format!("{issuer}/keys") });
    let router = Router::new()
        .route("/.well-known/openid-configuration", get(move || async move { Json(discovery) }))
        .route("/keys", get(move || async move { Json(json!({ "keys": *keys.lock().unwrap() })) }));
    tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
    issuer
}

fn claims(issuer: &str, roles: &[&str], seconds: i64) -> Value {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs() as i64;
    json!({ "iss": issuer, "aud": "gradfarm", "sub": "7", "preferred_username": "anna", "exp": now + seconds, "farm": { "roles": roles } })
}

async fn ask(server: &Server, token: &str, path: &str) -> (StatusCode, String) {
    let response = client_with(Some(token)).get(server.url(path)).send().await.unwrap();
    (response.status(), response.text().await.unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_good_token_of_a_provider_is_worth_its_role_and_nothing_else_is() {
    let (first, stranger) = (Key::draw("first"), Key::draw("first"));
    let keys = Arc::new(Mutex::new(vec![first.public()]));
    let issuer = provider(keys.clone()).await;
    let server = Server::start_with(0, &["--oidc-issuer", &issuer, "--oidc-audience", "gradfarm", "--oidc-roles", "farm.roles"]);
    let good = claims(&issuer, &["other", "gradfarm-viewer"], 600);
    assert_eq!(ask(&server, &first.sign(&good), "/jobs").await.0, StatusCode::OK);
    let (status, said) = ask(&server, &first.sign(&good), "/tokens").await;
    assert_eq!(status, StatusCode::FORBIDDEN);
    assert!(said.contains("admin") && said.contains("anna"), "{said}");
    assert_eq!(ask(&server, &first.sign(&claims(&issuer, &["admin"], 600)), "/tokens").await.0, StatusCode::OK);
    let roleless = ask(&server, &first.sign(&claims(&issuer, &["worker"], 600)), "/jobs").await;
    assert_eq!(roleless.0, StatusCode::FORBIDDEN, "{}", roleless.1);

    let changed = |field: &str, value: Value| {
        let mut claims = good.clone();
        claims[field] = value;
        claims
    };
    let half = first.sign(&good);
    let (signed, _) = half.rsplit_once('.').unwrap();
    let shared = EncodingKey::from_secret(first.public().to_string().as_bytes());
    let shared = encode(&Header { kid: Some("first".into()), ..Header::new(Algorithm::HS256) }, &good, &shared).unwrap();
    let nameless = encode(&Header::new(Algorithm::ES256), &good, &first.key).unwrap();
    for (what, token) in [
        ("another's key under the same name", stranger.sign(&good)),
        ("expired", first.sign(&claims(&issuer, &["admin"], -600))),
        ("another issuer", first.sign(&changed("iss", json!("https://elsewhere.example.org")))),
        ("another audience", first.sign(&changed("aud", json!("other")))),
        ("no audience", first.sign(&changed("aud", Value::Null))),
        ("not yet", first.sign(&changed("nbf", json!(i64::from(u32::MAX))))),
        ("never ends", first.sign(&changed("exp", Value::Null))),
        ("no signature", format!("{signed}.")),
        ("a shared secret", shared),
        ("no key named", nameless),
        ("a key that is not known", Key::draw("other").sign(&good)),
    ] {
        let (status, said) = ask(&server, &token, "/jobs").await;
        assert_eq!(status, StatusCode::UNAUTHORIZED, "{what}: {said}");
    }
    // Our own tokens are as good as before.
    assert_eq!(ask(&server, &server.token(), "/tokens").await.0, StatusCode::OK);

    // A new key is found without a restart.
    let second = Key::draw("second");
    keys.lock().unwrap().push(second.public());
    let since = std::time::Instant::now();
    while ask(&server, &second.sign(&good), "/jobs").await.0 != StatusCode::OK {
        assert!(since.elapsed().as_secs() < 120, "the new key is not found");
        tokio::time::sleep(std::time::Duration::from_millis(300)).await;
    }
}
