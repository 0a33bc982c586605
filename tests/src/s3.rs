//! An S3 server for tests: in this process, over a temporary folder, with faults on demand.

// Whatever goes wrong here fails the test that asked for it.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use s3s::auth::SimpleAuth;
use s3s::service::{S3Service, S3ServiceBuilder};
use tempfile::TempDir;
use tokio::sync::oneshot;

/// A running server.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    faults: Arc<Faults>,
    folder: TempDir,
    _stop: oneshot::Sender<()>,
}

/// What is still to go wrong.
#[derive(Debug, Default)]
struct Faults {
    /// Requests that are refused.
    refused: AtomicU32,
    /// Writes that are carried out and then answered by an error.
    unanswered: AtomicU32,
}

impl Server {
    /// The one bucket.
    pub const BUCKET: &str = "gradfarm";
    /// The key that is known to the server.
    pub const KEY: &str = "TESTKEY";
    /// Its secret.
    pub const SECRET: &str = "no secret at all";

    /// Starts a server on a thread of its own, which ends with it.
    pub fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join(Self::BUCKET)).unwrap();
        let mut builder = S3ServiceBuilder::new(s3s_fs::FileSystem::new(folder.path()).unwrap());
        builder.set_auth(SimpleAuth::from_single(Self::KEY, Self::SECRET));
        let service = builder.build();
        let faults = Arc::new(Faults::default());
        let listener = std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        let (stop, stopped) = oneshot::channel::<()>();
        let known = faults.clone();
        std::thread::spawn(move || {
            let router = Router::new().fallback(move |request: Request| answer(service.clone(), known.clone(), request));
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async {
                let listener = tokio::net::TcpListener::from_std(listener).unwrap();
                tokio::select! {
                    ended = axum::serve(listener, router) => ended.unwrap(),
                    _ = stopped => {}
                }
            });
        });
        Self { address, faults, folder, _stop: stop }
    }

    /// Where it is.
    pub fn endpoint(&self) -> String {
        format!("http://{}", self.address)
    }

    /// What a program must be told in its environment to use the server.
    pub fn environment(&self) -> [(&'static str, String); 3] {
        [("AWS_ENDPOINT_URL", self.endpoint()), ("AWS_ACCESS_KEY_ID", Self::KEY.into()), ("AWS_SECRET_ACCESS_KEY", Self::SECRET.into())]
    }

    /// Refuses so many of the next requests.
    pub fn fail(&self, requests: u32) {
        self.faults.refused.store(requests, Ordering::SeqCst);
    }

    /// Carries the next writes out and says that they failed.
    pub fn lose_answers(&self, writes: u32) {
        self.faults.unanswered.store(writes, Ordering::SeqCst);
    }

    /// Faults that did not happen yet.
    pub fn faults_left(&self) -> u32 {
        self.faults.refused.load(Ordering::SeqCst) + self.faults.unanswered.load(Ordering::SeqCst)
    }

    /// The folder with the bucket's objects.
    pub fn folder(&self) -> std::path::PathBuf {
        self.folder.path().join(Self::BUCKET)
    }
}

fn take_one(count: &AtomicU32) -> bool {
    count.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).is_ok()
}

async fn answer(service: S3Service, faults: Arc<Faults>, request: Request) -> Response {
    if take_one(&faults.refused) {
        return (StatusCode::SERVICE_UNAVAILABLE, "<Error><Code>SlowDown</Code></Error>").into_response();
    }
    let lost = request.method() == axum::http::Method::PUT && take_one(&faults.unanswered);
    let answer = service.call(request.map(s3s::Body::http_body_unsync)).await.unwrap();
    if lost { StatusCode::INTERNAL_SERVER_ERROR.into_response() } else { answer.map(Body::new) }
}
