//! What happens to a job, as server-sent events.

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::response::sse::{Event, KeepAlive, Sse};
use futures::{Stream, StreamExt};
use serde::Deserialize;
use serde_json::Value;

use super::json;
use super::problem::Problem;
use crate::service::Handle;

/// What a listener may choose.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Options {
    /// Whether to tell of every tile, too.
    tiles: bool,
}

/// `GET /jobs/{job}/events`: first the present state, then what happens; ends after a final state.
pub(super) async fn stream(
    State(service): State<Handle>,
    Path(job): Path<String>,
    options: Result<Query<Options>, QueryRejection>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let Query(options) = options?;
    let events = service.subscribe(super::jobs::parse(&job)?).await?;
    let told = events.map(json::Event::from).filter(move |event| {
        let wanted = options.tiles || !matches!(event, json::Event::Tile { .. });
        std::future::ready(wanted)
    });
    // A comment now and then tells proxies, and us, that the other side is still there.
    Ok(Sse::new(told.map(|event| Ok(encode(&event)))).keep_alive(KeepAlive::new().interval(Duration::from_secs(10))))
}

/// The event's kind becomes its name, the rest its data.
fn encode(event: &json::Event) -> Event {
    match serde_json::to_value(event) {
        Ok(Value::Object(fields)) => match fields.into_iter().next() {
            Some((name, data)) => Event::default().event(name).data(data.to_string()),
            None => Event::default().comment("empty"),
        },
        _ => Event::default().comment("unreadable"),
    }
}
