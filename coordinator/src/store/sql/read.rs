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

use super::{Connection, Row, Statement};
use crate::job::{
    Attempt, DeliveredRecord, Ending, FileKind, FileRecord, Frame, FrameState, JobId, JobRecord, JobState, Needs, Seconds, ShareRecord,
    SolvedWindow, StoredJob, StoredUnit, Timestamp, Witness, WorkerId,
};
use crate::store::StoreError;

/// Which jobs are read.
#[derive(Clone, Copy, Debug)]
pub(in crate::store) enum Scope {
    /// Every one.
    All,
    /// One.
    Job(JobId),
}

impl Scope {
    /// One of two statements: for all jobs, or for the job that is its only value.
    fn statement(self, all: &'static str, one: &'static str) -> Statement {
        match self {
            Scope::All => Statement::new(all),
            Scope::Job(job) => Statement::new(one).bytes(&job.to_bytes()),
        }
    }
}

/// Units with their leases and results.
macro_rules! units {
    ($and:literal) => {
        concat!(
            "SELECT units.job, units.unit, units.epoch, failures, losses, given_up, leases.worker AS worker, content, blob, size, load,
                    compile, render, results.worker AS maker
             FROM units JOIN jobs ON jobs.id = units.job
                  AND (jobs.state <> 'done' OR jobs.id IN (SELECT job FROM units WHERE given_up = 1))",
            $and,
            " LEFT JOIN leases ON leases.job = units.job AND leases.unit = units.unit
             LEFT JOIN results ON results.job = units.job AND results.unit = units.unit
             ORDER BY units.job, units.unit"
        )
    };
}

/// Jobs in the order of their names, which is the order of submission. To be called within a transaction that sees one snapshot.
pub(in crate::store) async fn jobs(connection: &mut Connection<'_>, scope: Scope) -> Result<Vec<StoredJob>, StoreError> {
    let mut jobs = BTreeMap::new();
    let each = |row: Row| {
        let job = job(&row)?;
        jobs.insert(job.record.id, job);
        Ok(())
    };
    connection.each(scope.statement("SELECT * FROM jobs", "SELECT * FROM jobs WHERE id = $1"), each).await?;
    let each = |row: Row| {
        if let Some(job) = jobs.get_mut(&row.job("job")?) {
            let (position, samples) = (row.integer("position")?, job.record.plan.samples);
            job.frames.push((position, frame(&row, samples)?));
        }
        Ok(())
    };
    let frames = scope.statement("SELECT * FROM frames ORDER BY job, position", "SELECT * FROM frames WHERE job = $1 ORDER BY position");
    connection.each(frames, each).await?;
    let each = |row: Row| {
        let position: u32 = row.integer("position")?;
        if let Some(job) = jobs.get_mut(&row.job("job")?)
            && let Ok(at) = job.frames.binary_search_by_key(&position, |(p, _)| *p)
        {
            job.frames[at].1.points.push(point(&row)?);
        }
        Ok(())
    };
    let all = "SELECT * FROM points ORDER BY job, position, samples";
    connection.each(scope.statement(all, "SELECT * FROM points WHERE job = $1 ORDER BY position, samples"), each).await?;
    let each = |row: Row| {
        if let Some(job) = jobs.get_mut(&row.job("job")?) {
            job.windows.push((row.integer("number")?, window(&row)?));
        }
        Ok(())
    };
    let windows = scope.statement("SELECT * FROM windows ORDER BY job, number", "SELECT * FROM windows WHERE job = $1 ORDER BY number");
    connection.each(windows, each).await?;
    let each = |row: Row| {
        let number: u32 = row.integer("number")?;
        if let Some(job) = jobs.get_mut(&row.job("job")?)
            && let Ok(at) = job.windows.binary_search_by_key(&number, |(n, _)| *n)
        {
            job.windows[at].1.shares.push(ShareRecord { blob: row.digest("blob")?, size: row.integer("size")? });
        }
        Ok(())
    };
    let all = "SELECT * FROM shares ORDER BY job, number, place";
    connection.each(scope.statement(all, "SELECT * FROM shares WHERE job = $1 ORDER BY number, place"), each).await?;
    let each = |row: Row| {
        if let Some(job) = jobs.get_mut(&row.job("job")?) {
            job.units.push(unit(&row)?);
        }
        Ok(())
    };
    connection.each(scope.statement(units!(""), units!(" AND jobs.id = $1")), each).await?;
    let each = |row: Row| {
        if let Some(job) = jobs.get_mut(&row.job("job")?) {
            job.attempts.push((row.integer("unit")?, attempt(&row)?));
        }
        Ok(())
    };
    let all = "SELECT * FROM attempts ORDER BY job, unit, number";
    connection.each(scope.statement(all, "SELECT * FROM attempts WHERE job = $1 ORDER BY unit, number"), each).await?;
    let each = |row: Row| {
        if let Some(job) = jobs.get_mut(&row.job("job")?) {
            let worker = WorkerId::from_bytes(row.array("worker")?);
            job.witnesses.push((row.integer("unit")?, Witness { epoch: row.integer("epoch")?, worker, content: row.digest("content")? }));
        }
        Ok(())
    };
    let all = "SELECT * FROM witnesses ORDER BY job, unit, epoch";
    connection.each(scope.statement(all, "SELECT * FROM witnesses WHERE job = $1 ORDER BY unit, epoch"), each).await?;
    Ok(jobs.into_values().collect())
}

/// Results of a run of units.
pub(in crate::store) async fn results(
    connection: &mut Connection<'_>,
    job: JobId,
    units: Range<u32>,
) -> Result<Vec<(u32, DeliveredRecord)>, StoreError> {
    let query = Statement::new("SELECT * FROM results WHERE job = $1 AND unit >= $2 AND unit < $3 ORDER BY unit");
    let mut results = Vec::new();
    let each = |row: Row| {
        results.push((row.integer("unit")?, result(&row)?));
        Ok(())
    };
    connection.each(query.bytes(&job.to_bytes()).integer(units.start).integer(units.end), each).await?;
    Ok(results)
}

/// The contents of all files.
pub(in crate::store) async fn files(connection: &mut Connection<'_>) -> Result<Vec<Digest>, StoreError> {
    let mut files = Vec::new();
    let each = |row: Row| {
        files.push(row.digest("blob")?);
        Ok(())
    };
    connection.each(Statement::new("SELECT blob FROM files"), each).await?;
    Ok(files)
}

/// A file of a frame.
pub(in crate::store) async fn file(
    connection: &mut Connection<'_>,
    job: JobId,
    position: u32,
    kind: FileKind,
) -> Result<Option<FileRecord>, StoreError> {
    let query = Statement::new("SELECT blob, size FROM files WHERE job = $1 AND position = $2 AND kind = $3");
    let row = connection.first(query.bytes(&job.to_bytes()).integer(position).text(kind.name())).await?;
    row.map(|row| Ok(FileRecord { kind, blob: row.digest("blob")?, size: row.integer("size")? })).transpose()
}

fn job(row: &Row) -> Result<StoredJob, StoreError> {
    let id = row.job("id")?;
    let corrupt = |found: String| StoreError::Corrupt { row: format!("job {id}"), found };
    let plan = row.bytes("plan")?;
    let message = v1::Plan::decode(plan.as_slice()).map_err(|error| corrupt(format!("a plan that is none: {error}")))?;
    let needs = row.text_if("needs")?.map(|text| serde_json::from_str::<Needs>(&text));
    let state = row.text("state")?;
    let (first_frame, frame_count) = (row.integer("first_frame")?, row.integer("frame_count")?);
    let record = JobRecord {
        id,
        name: row.text("name")?,
        priority: row.integer("priority")?,
        created: Timestamp::from_millis(row.integer("created")?),
        client_token: row.text_if("client_token")?,
        scene: row.digest("scene")?,
        plan: Plan::try_from(message).map_err(|error| corrupt(error.to_string()))?,
        tile: row.integer("tile")?,
        first_frame,
        frame_count,
        moments: moments(row.bytes_if("moments")?, first_frame, frame_count).ok_or_else(|| corrupt("moments that are none".into()))?,
        needs: needs.transpose().map_err(|fault| corrupt(format!("needs that are none: {fault}")))?.unwrap_or_default(),
    };
    Ok(StoredJob {
        record,
        state: by_name(&JobState::ALL, JobState::name, &state).ok_or_else(|| corrupt(format!("state {state:?}")))?,
        error: row.text_if("error")?,
        started: row.time_if("started")?,
        finished: row.time_if("finished")?,
        paused: row.integer::<u8>("paused")? != 0,
        windows: Vec::new(),
        frames: Vec::new(),
        units: Vec::new(),
        attempts: Vec::new(),
        witnesses: Vec::new(),
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
fn frame(row: &Row, samples: u32) -> Result<Frame, StoreError> {
    let state = row.text("state")?;
    let stopped = row.text_if("stopped")?;
    let corrupt = |found: String| StoreError::Corrupt { row: "frame".into(), found };
    let stopped = stopped.map(|name| by_name(&Reason::ALL, Reason::name, &name).ok_or_else(|| corrupt(format!("stopped {name:?}"))));
    let statistics = row.bytes("statistics")?;
    let counts: Vec<u64> =
        statistics.chunks_exact(8).map(|b| u64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])).collect();
    let failure = row.text_if("failure")?;
    let stood = by_name(&FrameState::ALL, FrameState::name, &state).ok_or_else(|| corrupt(format!("state {state:?}")))?;
    Ok(Frame {
        state: if failure.is_some() { FrameState::Failed } else { stood },
        started: row.time_if("started")?,
        units: row.integer("units")?,
        samples: row.integer("samples")?,
        seconds: Seconds {
            load: row.real("load")?,
            compile: row.real("compile")?,
            render: row.real("render")?,
            render_span: row.real("render_span")?,
            stitch: row.real("stitch")?,
            reconstruct: row.real("reconstruct")?,
            write: row.real("write")?,
        },
        estimated_relmse: row.real_if("estimated_relmse")?,
        choice: row.text_if("choice")?,
        statistics: Statistics::from_counts(&counts),
        goal: row.integer_if("goal")?.unwrap_or(samples),
        stopped: stopped.transpose()?,
        failed_units: row.integer("failed_units")?,
        suspect_units: row.integer("suspect_units")?,
        failure,
        points: Vec::new(),
    })
}

fn window(row: &Row) -> Result<SolvedWindow, StoreError> {
    Ok(SolvedWindow {
        shares: Vec::new(),
        report: SolveReport { alpha: row.real("alpha")? as f32, iterations: row.integer("iterations")?, residual: row.real("residual")? },
        stitch: row.real("stitch")?,
        reconstruct: row.real("reconstruct")?,
    })
}

fn point(row: &Row) -> Result<Point, StoreError> {
    Ok(Point {
        samples: row.integer("samples")?,
        cpu_seconds: row.real("cpu_seconds")?,
        wall_seconds: row.real("wall_seconds")?,
        check_seconds: row.real("check_seconds")?,
        error: Estimate { relmse: row.real("relmse")?, low: row.real("low")?, high: row.real("high")? },
    })
}

fn attempt(row: &Row) -> Result<Attempt, StoreError> {
    let ending = row.text("ending")?;
    let corrupt = || StoreError::Corrupt { row: "attempt".into(), found: format!("ending {ending:?}") };
    Ok(Attempt {
        worker: WorkerId::from_bytes(row.array("worker")?),
        epoch: row.integer("epoch")?,
        at: Timestamp::from_millis(row.integer("at")?),
        ending: by_name(&Ending::ALL, Ending::name, &ending).ok_or_else(corrupt)?,
        reason: row.text("reason")?,
    })
}

fn unit(row: &Row) -> Result<StoredUnit, StoreError> {
    let lease = row.bytes_if("worker")?;
    let (content, maker) = (row.bytes_if("content")?, row.bytes_if("maker")?);
    Ok(StoredUnit {
        unit: row.integer("unit")?,
        epoch: row.integer("epoch")?,
        failures: row.integer("failures")?,
        losses: row.integer("losses")?,
        given_up: row.integer::<u8>("given_up")? != 0,
        lease: lease.map(|_| row.array("worker").map(WorkerId::from_bytes)).transpose()?,
        result: content.map(|_| result(row)).transpose()?,
        worker: maker.map(|_| row.array("maker").map(WorkerId::from_bytes)).transpose()?,
    })
}

fn result(row: &Row) -> Result<DeliveredRecord, StoreError> {
    Ok(DeliveredRecord {
        content: row.digest("content")?,
        blob: row.digest("blob")?,
        size: row.integer("size")?,
        load: row.real("load")?,
        compile: row.real("compile")?,
        render: row.real("render")?,
    })
}
