//! The API's own description, OpenAPI 3.1: one table of operations, with the schemas of the JSON shapes as the code has them.

use axum::Json;
use schemars::generate::{SchemaGenerator, SchemaSettings};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};

use super::audit::AuditPage;
use super::enrolment::{EnrolledWorker, EnrolledWorkers, JoinInfo, JoinRequest, JoinTokens};
use super::jobs::{Changes, Retry};
use super::json::{Accuracy, Asset, Event, FarmJobs, Frame, Health, Job, JobPage, Tiles, Workers};
use super::problem::{self, Problem};
use super::submission::{JobOptions, JobRequest};
use super::tokens::{TokenInfo, TokenRequest, Tokens};

/// A parameter of the query.
type Parameter = (&'static str, &'static str, &'static str);

/// What an operation answers with.
enum Answer {
    /// JSON of this shape.
    Shape(fn(&mut SchemaGenerator) -> Schema),
    /// A stream of events; the data of each is one of the variants of this shape.
    Events(fn(&mut SchemaGenerator) -> Schema),
    /// Bytes of one of these media types.
    Bytes(&'static str),
    /// Nothing.
    Nothing,
}

/// One operation.
struct Operation {
    method: &'static str,
    path: &'static str,
    says: &'static str,
    query: &'static [Parameter],
    status: u16,
    answer: Answer,
}

fn shape<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<T>()
}

const fn get(path: &'static str, says: &'static str, query: &'static [Parameter], answer: Answer) -> Operation {
    Operation { method: "get", path, says, query, status: 200, answer }
}

const fn act(path: &'static str, says: &'static str) -> Operation {
    Operation { method: "post", path, says, query: &[], status: 200, answer: Answer::Shape(shape::<Job>) }
}

const PREVIEW: &[Parameter] = &[
    ("view", "string", "`primal`, `dx`, `dy`, `reconstructed` or `error`"),
    ("exposure", "number", "stops, PNG only"),
    ("most", "integer", "most pixels"),
];

/// All operations.
const OPERATIONS: &[Operation] = &[
    get("/openapi.json", "This description", &[], Answer::Bytes("application/json")),
    get("/metrics", "What is counted and measured, for Prometheus", &[], Answer::Bytes("application/openmetrics-text")),
    get("/ready", "Whether requests should be sent here", &[], Answer::Shape(shape::<Health>)),
    get("/health", "Whether the coordinator works", &[], Answer::Shape(shape::<Health>)),
    get(
        "/jobs",
        "Jobs, newest first",
        &[
            ("limit", "integer", "jobs on a page, 1 to 500"),
            ("cursor", "string", "`next` of the page before"),
            ("state", "string", "a state, or `open` for those that are not over"),
            ("search", "string", "part of the name, or the beginning of the id"),
        ],
        Answer::Shape(shape::<JobPage>),
    ),
    Operation {
        method: "post",
        path: "/jobs",
        says: "Submit a job",
        query: &[("dry_run", "boolean", "check it only; answers with 200 and what would become of it")],
        status: 201,
        answer: Answer::Shape(shape::<Job>),
    },
    get(
        "/jobs/{job}",
        "One job",
        &[("wait", "string", "answer when the job is over, at the latest after so many seconds, such as `30s`")],
        Answer::Shape(shape::<Job>),
    ),
    Operation {
        method: "delete",
        path: "/jobs/{job}",
        says: "Call a job off",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<Job>),
    },
    Operation {
        method: "patch",
        path: "/jobs/{job}",
        says: "Change a job's priority",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<Job>),
    },
    act("/jobs/{job}/cancel", "Call a job off"),
    act("/jobs/{job}/pause", "No leases until it is resumed"),
    act("/jobs/{job}/resume", "Let a paused job go on"),
    act("/jobs/{job}/retry", "Try again what failed"),
    get(
        "/jobs/{job}/events",
        "What happens to a job",
        &[("tiles", "boolean", "whether to tell of every tile, too")],
        Answer::Events(shape::<Event>),
    ),
    Operation {
        method: "post",
        path: "/workers/{worker}/drain",
        says: "Let a worker finish what it holds, and give it nothing new",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<Workers>),
    },
    Operation {
        method: "post",
        path: "/workers/{worker}/resume",
        says: "Give a worker work again",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<Workers>),
    },
    get("/jobs/{job}/frames/{frame}", "One frame", &[], Answer::Shape(shape::<Frame>)),
    get("/jobs/{job}/frames/{frame}/tiles", "The tiles of a frame, row by row", &[], Answer::Shape(shape::<Tiles>)),
    get("/jobs/{job}/frames/{frame}/frame.exr", "The image with all layers", &[], Answer::Bytes("image/x-exr")),
    get("/jobs/{job}/frames/{frame}/frame.png", "The image for the eye", &[], Answer::Bytes("image/png")),
    get("/jobs/{job}/frames/{frame}/frame.json", "What was counted, tile by tile", &[], Answer::Bytes("application/json")),
    get("/jobs/{job}/frames/{frame}/preview.png", "What there is of a frame, for the eye", PREVIEW, Answer::Bytes("image/png")),
    get(
        "/jobs/{job}/frames/{frame}/preview.pfm",
        "What there is of a frame, in numbers",
        PREVIEW,
        Answer::Bytes("image/x-portable-floatmap"),
    ),
    get("/jobs/{job}/frames/{frame}/accuracy", "Error against samples and seconds, and prices", &[], Answer::Shape(shape::<Accuracy>)),
    get("/jobs/{job}/frames/{frame}/accuracy.svg", "The same as a plot", &[], Answer::Bytes("image/svg+xml")),
    Operation { method: "post", path: "/assets", says: "Upload a file", query: &[], status: 201, answer: Answer::Shape(shape::<Asset>) },
    Operation {
        method: "head",
        path: "/assets/{digest}",
        says: "Whether a file is there",
        query: &[],
        status: 204,
        answer: Answer::Nothing,
    },
    get("/workers", "The connected workers", &[], Answer::Shape(shape::<Workers>)),
    get("/tokens", "The tokens, newest first", &[], Answer::Shape(shape::<Tokens>)),
    Operation {
        method: "post",
        path: "/tokens",
        says: "Issue a token",
        query: &[],
        status: 201,
        answer: Answer::Shape(shape::<TokenInfo>),
    },
    Operation {
        method: "delete",
        path: "/tokens/{token}",
        says: "Revoke a token",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<TokenInfo>),
    },
    get(
        "/audit",
        "Who changed what, newest first",
        &[("limit", "integer", "lines on a page, 1 to 1000"), ("before", "string", "`next` of the page before")],
        Answer::Shape(shape::<AuditPage>),
    ),
    get("/join-tokens", "The tokens with which workers join", &[], Answer::Shape(shape::<JoinTokens>)),
    Operation {
        method: "post",
        path: "/join-tokens",
        says: "Issue a join token",
        query: &[],
        status: 201,
        answer: Answer::Shape(shape::<JoinInfo>),
    },
    Operation {
        method: "delete",
        path: "/join-tokens/{token}",
        says: "Revoke a join token",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<JoinInfo>),
    },
    get("/enrolments", "The workers that joined", &[], Answer::Shape(shape::<EnrolledWorkers>)),
    Operation {
        method: "delete",
        path: "/enrolments/{worker}",
        says: "Throw a worker out",
        query: &[],
        status: 200,
        answer: Answer::Shape(shape::<EnrolledWorker>),
    },
    get("/events", "Jobs that change, and the workers", &[], Answer::Events(shape::<FarmJobs>)),
];

/// `GET /openapi.json`.
pub(super) async fn show() -> Json<Value> {
    Json(document())
}

/// The description.
pub fn document() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.definitions_path = "/components/schemas".into());
    let mut generator = SchemaGenerator::new(settings);
    let fault = shape::<Problem>(&mut generator);
    let mut paths: Map<String, Value> = Map::new();
    for operation in OPERATIONS {
        let mut told = json!({
            "summary": operation.says,
            "operationId": name(operation),
            "parameters": parameters(operation),
            "responses": {
                operation.status.to_string(): { "description": operation.says, "content": content(&operation.answer, &mut generator) },
                "default": { "description": "What was wrong", "content": { problem::MEDIA_TYPE: { "schema": fault } } },
            },
        });
        if let Some(body) = body(operation, &mut generator) {
            told["requestBody"] = body;
        }
        let path = paths.entry(format!("{}{}", super::ROOT, operation.path)).or_insert_with(|| json!({}));
        path[operation.method] = told;
    }
    let schemas = generator.take_definitions(true);
    json!({
        "openapi": "3.1.0",
        "info": { "title": "gradfarm", "version": env!("CARGO_PKG_VERSION"), "description": "A render farm in the gradient domain." },
        "paths": paths,
        "components": { "schemas": schemas, "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } } },
        "security": [{ "token": [] }],
    })
}

/// A name that clients can make a method of: `get_jobs_job_frames_frame`.
fn name(operation: &Operation) -> String {
    let words = operation.path.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.fold(operation.method.to_owned(), |name, word| format!("{name}_{word}"))
}

fn parameters(operation: &Operation) -> Vec<Value> {
    let within = operation.path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let kind = |name: &str| if name == "frame" { "integer" } else { "string" };
    let within = within.map(|name| json!({ "name": name, "in": "path", "required": true, "schema": { "type": kind(name) } }));
    let query = operation
        .query
        .iter()
        .map(|(name, kind, says)| json!({ "name": name, "in": "query", "description": says, "schema": { "type": kind } }));
    within.chain(query).collect()
}

fn content(answer: &Answer, generator: &mut SchemaGenerator) -> Value {
    match answer {
        Answer::Shape(shape) => json!({ "application/json": { "schema": shape(generator) } }),
        Answer::Events(shape) => json!({ "text/event-stream": { "schema": { "type": "string" }, "x-event": shape(generator) } }),
        Answer::Bytes(media_type) => json!({ (*media_type): {} }),
        Answer::Nothing => json!({}),
    }
}

fn body(operation: &Operation, generator: &mut SchemaGenerator) -> Option<Value> {
    match (operation.method, operation.path) {
        ("post", "/jobs") => {
            let mut form = JobOptions::json_schema(generator).to_value();
            form["properties"]["scene"] =
                json!({ "type": "string", "description": "the scene's file: gradfarm JSON, glTF, GLB, Mitsuba or pbrt" });
            let files = "files that the scene names, by their file names";
            form["properties"]["asset"] = json!({ "type": "array", "items": { "type": "string" }, "description": files });
            form["required"] = json!(["scene"]);
            let json = shape::<JobRequest>(generator);
            Some(
                json!({ "required": true, "content": { "application/json": { "schema": json }, "multipart/form-data": { "schema": form } } }),
            )
        }
        ("post", "/tokens") => Some(json_body(true, shape::<TokenRequest>(generator))),
        ("post", "/join-tokens") => Some(json_body(true, shape::<JoinRequest>(generator))),
        ("patch", "/jobs/{job}") => Some(json_body(true, shape::<Changes>(generator))),
        ("post", "/jobs/{job}/retry") => Some(json_body(false, shape::<Retry>(generator))),
        ("post", "/assets") => Some(json!({ "required": true, "content": { "application/octet-stream": {} } })),
        _ => None,
    }
}

fn json_body(required: bool, schema: Schema) -> Value {
    json!({ "required": required, "content": { "application/json": { "schema": schema } } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_route_is_described_and_nothing_else_is() {
        let source = include_str!("mod.rs");
        let routes = source.split(".route(\"").skip(1).map(|rest| rest.split('"').next().unwrap_or_default());
        let routes: BTreeSet<&str> = routes.collect();
        let told: BTreeSet<&str> = OPERATIONS.iter().map(|operation| operation.path).collect();
        assert_eq!(told, routes);
        let named = |method: &str, path: &'static str| (method.to_uppercase(), path);
        let told: BTreeSet<_> = OPERATIONS.iter().map(|operation| named(operation.method, operation.path)).collect();
        let table: BTreeSet<_> = super::super::roles::TABLE.iter().map(|entry| named(entry.method, entry.path)).collect();
        assert_eq!(told, table);
    }

    #[test]
    fn every_reference_leads_somewhere_and_names_are_unique() {
        let document = document();
        let text = document.to_string();
        for reference in text.split("\"$ref\":\"#").skip(1).map(|rest| rest.split('"').next().unwrap_or_default()) {
            assert!(document.pointer(reference).is_some(), "{reference}");
        }
        let names: BTreeSet<String> = OPERATIONS.iter().map(name).collect();
        assert_eq!(names.len(), OPERATIONS.len());
    }
}
