//! Follows a job on a coordinator until it ends, over server-sent events. A coordinator that goes away is waited for.

use std::ops::Range;
use std::time::{Duration, Instant};

use futures::StreamExt;
use reqwest::{Method, Response};
use serde_json::{Map, Value};

use super::accuracy::measured;
use super::batch::Batch;
use super::client::Client;
use super::error::Error;
use super::progress::Progress;
use super::pull::{self, Puller};
use super::terminal;
use crate::api::json::{Event, Job, is_final};
use crate::job::FrameState;

/// How long a coordinator may be away before it is given up.
const PATIENCE: Duration = Duration::from_secs(60);
/// Pause between two attempts.
const PAUSE: Duration = Duration::from_millis(500);

/// How to tell of what happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Telling {
    /// A progress bar on standard error.
    Bar,
    /// One JSON object for each event on standard output.
    Json,
}

/// Follows `job` until it is done. Frames that become ready are fetched on the way, if somebody wants them.
///
/// # Errors
/// [`Error::Job`] if it failed or was cancelled, [`Error::Flawed`] if it is done without some of its units, [`Error::Unreachable`] if the coordinator stays away; those of the puller.
pub(super) async fn follow(client: &Client, job: &str, telling: Telling, mut puller: Option<&mut Puller>) -> Result<(), Error> {
    let progress = match telling {
        Telling::Bar => Some(Progress::new("waiting")),
        Telling::Json => None,
    };
    let mut batch = None;
    let mut gone_since: Option<Instant> = None;
    loop {
        let fault = match listen(client, job, progress.as_ref(), &mut batch, puller.as_deref_mut()).await {
            Ok(Some(ended)) => return ended,
            Ok(None) => {
                gone_since = None;
                None
            }
            Err(fault @ Error::Unreachable { .. }) => Some(fault),
            Err(fault) => return Err(fault),
        };
        let since = *gone_since.get_or_insert_with(Instant::now);
        if let Some(fault) = fault
            && since.elapsed() > PATIENCE
        {
            return Err(fault);
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// Listens once: how the job ended, or `None` if the stream broke before it did.
async fn listen(
    client: &Client,
    job: &str,
    progress: Option<&Progress>,
    batch: &mut Option<Batch>,
    mut puller: Option<&mut Puller>,
) -> Result<Option<Result<(), Error>>, Error> {
    // Asked after the stream began, so that no change falls between.
    let response = client.send(client.request(Method::GET, &format!("/jobs/{job}/events"))).await?;
    let mut events = Events::new(response);
    let known: Job = client.get(&format!("/jobs/{job}")).await?;
    let batch = batch.get_or_insert_with(|| Batch::new(pull::all(&known).range()));
    for frame in &known.frames {
        let Some(state) = state(&frame.state) else { continue };
        batch.set(frame.number..frame.number + 1, state);
        if let (FrameState::Done, Some(puller)) = (state, puller.as_deref_mut()) {
            puller.ready(frame.number..frame.number + 1).await?;
        }
    }
    if let (Some(progress), Some(waiting)) = (progress, &known.waiting) {
        progress.say(&format!("waiting: {}", waiting.detail));
    }
    let mut last = None;
    while let Some(event) = events.next().await {
        if let Event::Accuracy { frame, point, .. } = &event {
            last = Some(format!("frame {frame}: {}", measured(point)));
        }
        match progress {
            Some(progress) => show(progress, batch, &event),
            None => terminal::json(&event)?,
        }
        if let (Event::Frame { frame, end, state }, Some(puller)) = (&event, puller.as_deref_mut())
            && state == FrameState::Done.name()
        {
            puller.ready(span(*frame, *end)).await?;
        }
        if let Event::State { state, error } = event
            && is_final(&state)
        {
            let reason = error.map(|error| format!(": {error}")).unwrap_or_default();
            if let (Some(progress), Some(last)) = (progress, last) {
                progress.finish();
                terminal::note(last);
            }
            if state != "done" {
                return Ok(Some(Err(Error::Job(format!("job {job} is {state}{reason}")))));
            }
            let known: Job = client.get(&format!("/jobs/{job}")).await?;
            let failed = known.summary.failed_units;
            return Ok(Some(if failed == 0 { Ok(()) } else { Err(Error::flawed(job, failed)) }));
        }
    }
    Ok(None)
}

/// The frames that an event is about; older coordinators tell of one at a time.
fn span(frame: u32, end: u32) -> Range<u32> {
    frame..end.max(frame.saturating_add(1))
}

fn state(name: &str) -> Option<FrameState> {
    FrameState::ALL.into_iter().find(|state| state.name() == name)
}

fn show(progress: &Progress, batch: &mut Batch, event: &Event) {
    match event {
        Event::State { state, .. } => progress.say(state),
        Event::Progress { samples, .. } => progress.show(samples.done, samples.total),
        Event::Frame { frame, end, state } => {
            if let Some(state) = self::state(state) {
                batch.set(span(*frame, *end), state);
            }
            progress.say(&batch.told());
        }
        Event::Accuracy { point, target, seconds_left, .. } => progress.say_error(&point.error.into(), *target, *seconds_left),
        Event::Window(window) => {
            batch.set_window(window.number, window.first..window.end, &window.state);
            progress.say(&batch.told());
        }
        Event::Tile { .. } => {}
    }
}

/// Reads server-sent events from a response.
struct Events {
    response: futures::stream::BoxStream<'static, reqwest::Result<bytes::Bytes>>,
    parser: Parser,
}

impl Events {
    fn new(response: Response) -> Self {
        Self { response: response.bytes_stream().boxed(), parser: Parser::default() }
    }

    /// The next event; `None` once the connection ends, one way or the other.
    async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some(event) = self.parser.next() {
                return Some(event);
            }
            self.parser.buffer.extend_from_slice(&self.response.next().await?.ok()?);
        }
    }
}

/// Cuts a stream of bytes into events.
#[derive(Debug, Default)]
struct Parser {
    buffer: Vec<u8>,
    name: String,
    data: String,
}

impl Parser {
    /// The next event that is whole and of a kind that this version knows.
    fn next(&mut self) -> Option<Event> {
        while let Some(end) = self.buffer.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.buffer.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line);
            let line = line.trim_end_matches(['\r', '\n']);
            if line.is_empty() {
                let (name, data) = (std::mem::take(&mut self.name), std::mem::take(&mut self.data));
                if let Some(event) = event(name, &data) {
                    return Some(event);
                }
            } else if let Some(name) = line.strip_prefix("event:") {
                self.name = name.trim_start().to_owned();
            } else if let Some(data) = line.strip_prefix("data:") {
                self.data.push_str(data.trim_start());
            }
        }
        None
    }
}

fn event(name: String, data: &str) -> Option<Event> {
    let data: Value = serde_json::from_str(data).ok()?;
    serde_json::from_value(Value::Object(Map::from_iter([(name, data)]))).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::json::Count;

    #[test]
    fn events_are_found_however_the_bytes_are_cut() {
        let text = ": hello\n\nevent: state\ndata: {\"state\":\"running\",\"error\":null}\n\nevent: novelty\ndata: {}\n\n\
                    event: tile\r\ndata: {\"frame\":0,\"tile\":3,\"units\":{\"done\":1,\"total\":2}}\r\n\r\nevent: state\n";
        for step in [1, 2, 7, text.len()] {
            let mut parser = Parser::default();
            let mut found = Vec::new();
            for piece in text.as_bytes().chunks(step) {
                parser.buffer.extend_from_slice(piece);
                found.extend(std::iter::from_fn(|| parser.next()));
            }
            let running = Event::State { state: "running".into(), error: None };
            let tile = Event::Tile { frame: 0, tile: 3, units: Count { done: 1, total: 2 } };
            assert_eq!(found, [running, tile], "in pieces of {step}");
        }
    }
}
