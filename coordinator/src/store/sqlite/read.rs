//! Rows back into records. A row that cannot be is reported, never guessed.

use std::collections::BTreeMap;
use std::ops::Range;

use gradfarm_core::accuracy::{Estimate, Point, Reason};
use gradfarm_core::film::Statistics;
use gradfarm_core::lattice::Moment;
use gradfarm_core::plan::{Plan, by_name};
use gradfarm_core::reconstruction::SolveReport;
use gradfarm_proto::{Digest, v1};
use prost::Message;
use sqlx::sqlite::SqliteRow;
use sqlx::{Row, SqlitePool};

use crate::job::{
    DeliveredRecord, FileKind, FileRecord, Frame, FrameState, JobId, JobRecord, JobState, Seconds, ShareRecord, SolvedWindow, StoredJob,
    StoredUnit, Timestamp, WorkerId,
};
use crate::store::StoreError;

/// Every job in the order of its name, which is the order of submission.
pub(super) async fn jobs(pool: &SqlitePool) -> Result<Vec<StoredJob>, StoreError> {
    // One snapshot for all tables.
    let mut transaction = pool.begin().await?;
    let mut jobs = BTreeMap::new();
    for row in sqlx::query("SELECT * FROM jobs").fetch_all(&mut *transaction).await? {
        let job = job(&row)?;
        jobs.insert(job.record.id, job);
    }
    for row in sqlx::query("SELECT * FROM frames ORDER BY job, position").fetch_all(&mut *transaction).await? {
        let id = JobId::from_bytes(bytes(&row, "job")?);
        if let Some(job) = jobs.get_mut(&id) {
            let (position, samples) = (row.try_get("position")?, job.record.plan.samples);
            job.frames.push((position, frame(&row, samples)?));
        }
    }
    for row in sqlx::query("SELECT * FROM points ORDER BY job, position, samples").fetch_all(&mut *transaction).await? {
        let (id, position) = (JobId::from_bytes(bytes(&row, "job")?), row.try_get::<u32, _>("position")?);
        if let Some(job) = jobs.get_mut(&id)
            && let Ok(at) = job.frames.binary_search_by_key(&position, |(p, _)| *p)
        {
            job.frames[at].1.points.push(point(&row)?);
        }
    }
    for row in sqlx::query("SELECT * FROM windows ORDER BY job, number").fetch_all(&mut *transaction).await? {
        if let Some(job) = jobs.get_mut(&JobId::from_bytes(bytes(&row, "job")?)) {
            job.windows.push((row.try_get("number")?, window(&row)?));
        }
    }
    for row in sqlx::query("SELECT * FROM shares ORDER BY job, number, place").fetch_all(&mut *transaction).await? {
        let number = row.try_get::<u32, _>("number")?;
        if let Some(job) = jobs.get_mut(&JobId::from_bytes(bytes(&row, "job")?))
            && let Ok(at) = job.windows.binary_search_by_key(&number, |(n, _)| *n)
        {
            job.windows[at].1.shares.push(ShareRecord { blob: digest(&row, "blob")?, size: count(&row, "size")? });
        }
    }
    let units = "SELECT units.job, units.unit, units.epoch, failures, losses, worker, content, blob, size, load, compile, render
                 FROM units JOIN jobs ON jobs.id = units.job AND jobs.state <> 'done'
                 LEFT JOIN leases ON leases.job = units.job AND leases.unit = units.unit
                 LEFT JOIN results ON results.job = units.job AND results.unit = units.unit
                 ORDER BY units.job, units.unit";
    for row in sqlx::query(units).fetch_all(&mut *transaction).await? {
        let id = JobId::from_bytes(bytes(&row, "job")?);
        if let Some(job) = jobs.get_mut(&id) {
            job.units.push(unit(&row)?);
        }
    }
    Ok(jobs.into_values().collect())
}

/// Results of a run of units.
pub(super) async fn results(pool: &SqlitePool, job: JobId, units: Range<u32>) -> Result<Vec<(u32, DeliveredRecord)>, StoreError> {
    let query = sqlx::query("SELECT * FROM results WHERE job = $1 AND unit >= $2 AND unit < $3 ORDER BY unit")
        .bind(job.to_bytes().to_vec())
        .bind(units.start)
        .bind(units.end);
    let rows = query.fetch_all(pool).await?;
    rows.iter().map(|row| Ok((row.try_get("unit")?, result(row)?))).collect()
}

/// A file of a frame.
pub(super) async fn file(pool: &SqlitePool, job: JobId, position: u32, kind: FileKind) -> Result<Option<FileRecord>, StoreError> {
    let query = sqlx::query("SELECT blob, size FROM files WHERE job = $1 AND position = $2 AND kind = $3")
        .bind(job.to_bytes().to_vec())
        .bind(position)
        .bind(kind.name());
    let row = query.fetch_optional(pool).await?;
    row.map(|row| Ok(FileRecord { kind, blob: digest(&row, "blob")?, size: count(&row, "size")? })).transpose()
}

fn job(row: &SqliteRow) -> Result<StoredJob, StoreError> {
    let id = JobId::from_bytes(bytes(row, "id")?);
    let corrupt = |found: String| StoreError::Corrupt { row: format!("job {id}"), found };
    let plan: Vec<u8> = row.try_get("plan")?;
    let message = v1::Plan::decode(plan.as_slice()).map_err(|error| corrupt(format!("a plan that is none: {error}")))?;
    let state: String = row.try_get("state")?;
    let (first_frame, frame_count) = (row.try_get("first_frame")?, row.try_get("frame_count")?);
    let record = JobRecord {
        id,
        name: row.try_get("name")?,
        priority: row.try_get("priority")?,
        created: Timestamp::from_millis(row.try_get("created")?),
        client_token: row.try_get("client_token")?,
        scene: digest(row, "scene")?,
        plan: Plan::try_from(message).map_err(|error| corrupt(error.to_string()))?,
        tile: row.try_get("tile")?,
        first_frame,
        frame_count,
        moments: moments(row.try_get("moments")?, first_frame, frame_count).ok_or_else(|| corrupt("moments that are none".into()))?,
    };
    Ok(StoredJob {
        record,
        state: by_name(&JobState::ALL, JobState::name, &state).ok_or_else(|| corrupt(format!("state {state:?}")))?,
        error: row.try_get("error")?,
        started: time(row, "started")?,
        finished: time(row, "finished")?,
        paused: row.try_get("paused")?,
        windows: Vec::new(),
        frames: Vec::new(),
        units: Vec::new(),
    })
}

/// From the frames after the last ones. Before there were moments each frame was rendered.
fn moments(ends: Option<Vec<u8>>, first: u32, count: u32) -> Option<Vec<Moment>> {
    let range = first..first.checked_add(count)?;
    let Some(ends) = ends else { return Some(range.map(Moment::of).collect()) };
    let mut next = first;
    let mut moments = Vec::with_capacity(ends.len() / 4);
    for end in ends.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])) {
        let moment = Moment { first: next, end };
        if end <= next {
            return None;
        }
        next = end;
        moments.push(moment);
    }
    (next == range.end).then_some(moments)
}

/// `samples` is the plan's number, to which frames went before they could stop early.
fn frame(row: &SqliteRow, samples: u32) -> Result<Frame, StoreError> {
    let state: String = row.try_get("state")?;
    let stopped: Option<String> = row.try_get("stopped")?;
    let corrupt = |found: String| StoreError::Corrupt { row: "frame".into(), found };
    let stopped = stopped.map(|name| by_name(&Reason::ALL, Reason::name, &name).ok_or_else(|| corrupt(format!("stopped {name:?}"))));
    let statistics: Vec<u8> = row.try_get("statistics")?;
    let counts: Vec<u64> =
        statistics.chunks_exact(8).map(|b| u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])).collect();
    Ok(Frame {
        state: by_name(&FrameState::ALL, FrameState::name, &state).ok_or_else(|| corrupt(format!("state {state:?}")))?,
        started: time(row, "started")?,
        units: row.try_get("units")?,
        samples: count(row, "samples")?,
        seconds: Seconds {
            load: row.try_get("load")?,
            compile: row.try_get("compile")?,
            render: row.try_get("render")?,
            render_span: row.try_get("render_span")?,
            stitch: row.try_get("stitch")?,
            reconstruct: row.try_get("reconstruct")?,
            write: row.try_get("write")?,
        },
        estimated_relmse: row.try_get("estimated_relmse")?,
        choice: row.try_get("choice")?,
        statistics: Statistics::from_counts(&counts),
        goal: row.try_get::<Option<u32>, _>("goal")?.unwrap_or(samples),
        stopped: stopped.transpose()?,
        points: Vec::new(),
    })
}

fn window(row: &SqliteRow) -> Result<SolvedWindow, StoreError> {
    Ok(SolvedWindow {
        shares: Vec::new(),
        report: SolveReport {
            alpha: row.try_get::<f64, _>("alpha")? as f32,
            iterations: row.try_get("iterations")?,
            residual: row.try_get("residual")?,
        },
        stitch: row.try_get("stitch")?,
        reconstruct: row.try_get("reconstruct")?,
    })
}

fn point(row: &SqliteRow) -> Result<Point, StoreError> {
    Ok(Point {
        samples: row.try_get("samples")?,
        cpu_seconds: row.try_get("cpu_seconds")?,
        wall_seconds: row.try_get("wall_seconds")?,
        check_seconds: row.try_get("check_seconds")?,
        error: Estimate { relmse: row.try_get("relmse")?, low: row.try_get("low")?, high: row.try_get("high")? },
    })
}

fn unit(row: &SqliteRow) -> Result<StoredUnit, StoreError> {
    let lease: Option<Vec<u8>> = row.try_get("worker")?;
    let content: Option<Vec<u8>> = row.try_get("content")?;
    Ok(StoredUnit {
        unit: row.try_get("unit")?,
        epoch: row.try_get("epoch")?,
        failures: row.try_get("failures")?,
        losses: row.try_get("losses")?,
        lease: lease.map(|_| bytes(row, "worker").map(WorkerId::from_bytes)).transpose()?,
        result: content.map(|_| result(row)).transpose()?,
    })
}

fn result(row: &SqliteRow) -> Result<DeliveredRecord, StoreError> {
    Ok(DeliveredRecord {
        content: digest(row, "content")?,
        blob: digest(row, "blob")?,
        size: count(row, "size")?,
        load: row.try_get("load")?,
        compile: row.try_get("compile")?,
        render: row.try_get("render")?,
    })
}

fn bytes<const N: usize>(row: &SqliteRow, column: &'static str) -> Result<[u8; N], StoreError> {
    let value: Vec<u8> = row.try_get(column)?;
    let length = value.len();
    value.try_into().map_err(|_| StoreError::Corrupt { row: column.into(), found: format!("{length} bytes instead of {N}") })
}

fn digest(row: &SqliteRow, column: &'static str) -> Result<Digest, StoreError> {
    bytes(row, column).map(Digest::from)
}

fn count(row: &SqliteRow, column: &'static str) -> Result<u64, StoreError> {
    let value: i64 = row.try_get(column)?;
    u64::try_from(value).map_err(|_| StoreError::Corrupt { row: column.into(), found: value.to_string() })
}

fn time(row: &SqliteRow, column: &'static str) -> Result<Option<Timestamp>, StoreError> {
    let value: Option<i64> = row.try_get(column)?;
    Ok(value.map(Timestamp::from_millis))
}
