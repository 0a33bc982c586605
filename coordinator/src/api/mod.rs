//! The HTTP interface for people and their programs: `/api/v1`, one file a resource.
//!
//! Handlers are thin: they read the request, ask the service's handle, and answer in the shapes of `json`, or with a `problem`.
//!
//! | method | address | what |
//! |---|---|---|
//! | GET | `/openapi.json` | all of this for programs |
//! | GET | `/health` | whether the coordinator works |
//! | GET | `/ready` | whether requests should be sent here |
//! | POST | `/jobs` | submit: JSON that refers to uploaded assets, or a form with scene and files |
//! | GET | `/jobs?limit=&cursor=&state=&search=` | list, newest first |
//! | GET, DELETE, PATCH | `/jobs/{id}?wait=` | one job, when it is over or after so many seconds; call it off; change its priority |
//! | POST | `/jobs/{id}/cancel` | call it off |
//! | POST | `/jobs/{id}/retry` | try again what failed |
//! | GET | `/jobs/{id}/events?tiles=` | what happens to it, as server-sent events |
//! | GET | `/jobs/{id}/frames/{n}` | one frame |
//! | GET | `/jobs/{id}/frames/{n}/tiles` | its tiles |
//! | GET | `/jobs/{id}/frames/{n}/frame.exr`, `frame.png` | its files |
//! | GET | `/jobs/{id}/frames/{n}/frame.json` | what was counted, tile by tile |
//! | GET | `/jobs/{id}/frames/{n}/preview.png?view=&exposure=&most=` | what there is of it so far, for the eye; `preview.pfm`: in numbers |
//! | GET | `/jobs/{id}/frames/{n}/accuracy` | its error against samples and seconds, and what more accuracy costs |
//! | GET | `/jobs/{id}/frames/{n}/accuracy.svg` | the same as a plot |
//! | POST | `/assets` | upload a file |
//! | HEAD | `/assets/{digest}` | whether a file is there |
//! | GET | `/workers` | the connected workers |
//! | POST | `/workers/{worker}/drain`, `resume` | a worker gets nothing new; gets work again |
//! | GET, POST | `/tokens` | the tokens; issue one |
//! | DELETE | `/tokens/{token}` | revoke one |
//! | GET | `/audit?limit=&before=` | who changed what, newest first |
//! | GET, POST | `/join-tokens` | the tokens with which workers join; issue one |
//! | DELETE | `/join-tokens/{token}` | revoke one |
//! | GET | `/enrolments` | the workers that joined |
//! | DELETE | `/enrolments/{worker}` | throw one out |
//! | GET | `/metrics` | what is counted and measured, for Prometheus; also at `/metrics` itself |
//! | GET | `/events` | jobs that change and workers, as server-sent events |
//!
//! The web page is at `/`, outside of this.

mod accuracy;
mod accuracy_json;
mod assets;
pub mod audit;
mod convert;
pub mod enrolment;
mod events;
mod farm_events;
mod frames;
mod guard;
mod health;
mod imported;
mod jobs;
pub mod json;
mod metrics;
pub mod openapi;
mod page;
mod preview;
pub mod problem;
mod relay;
pub mod roles;
mod schedule_json;
pub mod submission;
pub mod tokens;
mod workers;

use std::future::Future;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::middleware;
use axum::routing::{delete, get, head, post};
use tokio::net::TcpListener;
use tower_http::trace::TraceLayer;

use crate::service::Handle;
use crate::tls::TlsListener;

/// Where every address begins.
pub const ROOT: &str = "/api/v1";

/// Largest JSON body [bytes].
pub const JSON_BYTES: usize = 64 << 20;
/// Largest uploaded file, and largest form with a scene and its files [bytes].
pub const UPLOAD_BYTES: usize = 1 << 30;

/// All routes, answered through `handle`.
pub fn router(handle: Handle) -> Router {
    let routes = Router::new()
        .route("/openapi.json", get(openapi::show))
        .route("/health", get(health::show))
        .route("/ready", get(health::ready))
        .route("/jobs", post(jobs::submit).layer(DefaultBodyLimit::max(UPLOAD_BYTES)).get(jobs::list))
        .route("/jobs/{job}", get(jobs::show).delete(jobs::cancel).patch(jobs::change))
        .route("/jobs/{job}/cancel", post(jobs::cancel))
        .route("/jobs/{job}/pause", post(jobs::pause))
        .route("/jobs/{job}/resume", post(jobs::resume))
        .route("/jobs/{job}/retry", post(jobs::retry))
        .route("/jobs/{job}/events", get(events::stream))
        .route("/jobs/{job}/frames/{frame}", get(frames::show))
        .route("/jobs/{job}/frames/{frame}/tiles", get(frames::tiles))
        .route("/jobs/{job}/frames/{frame}/frame.exr", get(frames::exr))
        .route("/jobs/{job}/frames/{frame}/frame.png", get(frames::png))
        .route("/jobs/{job}/frames/{frame}/frame.json", get(frames::statistics))
        .route("/jobs/{job}/frames/{frame}/preview.png", get(preview::png))
        .route("/jobs/{job}/frames/{frame}/preview.pfm", get(preview::pfm))
        .route("/jobs/{job}/frames/{frame}/accuracy", get(accuracy::show))
        .route("/jobs/{job}/frames/{frame}/accuracy.svg", get(accuracy::svg))
        .route("/assets", post(assets::upload).layer(DefaultBodyLimit::max(UPLOAD_BYTES)))
        .route("/assets/{digest}", head(assets::check))
        .route("/workers", get(workers::list))
        .route("/workers/{worker}/drain", post(workers::drain))
        .route("/workers/{worker}/resume", post(workers::resume))
        .route("/tokens", get(tokens::list).post(tokens::issue))
        .route("/tokens/{token}", delete(tokens::revoke))
        .route("/audit", get(audit::show))
        .route("/join-tokens", get(enrolment::joins).post(enrolment::create))
        .route("/join-tokens/{token}", delete(enrolment::revoke_join))
        .route("/enrolments", get(enrolment::workers))
        .route("/enrolments/{worker}", delete(enrolment::revoke))
        .route("/events", get(farm_events::stream))
        .route("/metrics", get(metrics::show))
        .layer(middleware::from_fn_with_state(handle.clone(), relay::relay))
        .with_state(handle.clone());
    let measured = handle.clone();
    Router::new()
        .nest(ROOT, routes)
        .merge(Router::new().route("/metrics", get(metrics::show)).with_state(handle.clone()))
        .route_layer(middleware::from_fn_with_state(handle.clone(), guard::authorise))
        // After the guard: the page's files are for anybody.
        .merge(page::routes())
        .fallback(guard::nowhere)
        .method_not_allowed_fallback(guard::no_method)
        .layer(middleware::from_fn_with_state(handle.clone(), guard::identify))
        .layer(middleware::from_fn_with_state(handle, guard::own_pages_only))
        .layer(middleware::from_fn_with_state(measured, metrics::measure))
        .layer(TraceLayer::new_for_http())
}

/// Serves HTTP, over TLS if the service has it, on `listener` until `shutdown` is ready; requests under way are finished first.
///
/// # Errors
/// If the listener fails.
pub async fn serve(listener: TcpListener, handle: Handle, shutdown: impl Future<Output = ()> + Send + 'static) -> std::io::Result<()> {
    let config = handle.secured().map(|secured| secured.http.clone());
    match config {
        Some(config) => axum::serve(TlsListener::start(listener, config)?, router(handle)).with_graceful_shutdown(shutdown).await,
        None => axum::serve(listener, router(handle)).with_graceful_shutdown(shutdown).await,
    }
}
