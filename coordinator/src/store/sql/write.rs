//! Changes as SQL. Each statement that could meet another writer's work names what it expects, and a miss is a conflict.

use gradfarm_core::accuracy::{Point, Reason};
use gradfarm_proto::v1;
use prost::Message;

use super::{Connection, Statement};
use crate::job::{Change, Frame, FrameState, JobId, Needs, SolvedWindow};
use crate::store::StoreError;

/// Makes one change within a transaction.
pub(in crate::store) async fn make(connection: &mut Connection<'_>, change: &Change) -> Result<(), StoreError> {
    let rows = match change {
        Change::Submitted(record) => {
            let plan = v1::Plan::from(&record.plan).encode_to_vec();
            let asks = record.needs != Needs::default();
            let needs = asks.then(|| serde_json::to_string(&record.needs)).transpose().map_err(|fault| StoreError::Corrupt {
                row: format!("job {}", record.id),
                found: format!("needs that cannot be written: {fault}"),
            })?;
            let moments: Vec<u8> = record.moments.iter().flat_map(|moment| moment.end.to_le_bytes()).collect();
            let insert =
                "INSERT INTO jobs (id, name, priority, created, client_token, scene, plan, tile, first_frame, frame_count, moments, needs, state)
                          VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, 'queued') ON CONFLICT DO NOTHING";
            let query = Statement::new(insert)
                .bytes(&record.id.to_bytes())
                .text(&record.name)
                .integer(record.priority)
                .integer(record.created.millis())
                .text_if(record.client_token.as_deref())
                .bytes(record.scene.as_bytes())
                .bytes(&plan)
                .integer(record.tile)
                .integer(record.first_frame)
                .integer(record.frame_count)
                .bytes(&moments)
                .text_if(needs.as_deref());
            connection.execute(query).await?
        }
        Change::Job { job, state, error, started, finished } => {
            let query = Statement::new("UPDATE jobs SET state = $2, error = $3, started = $4, finished = $5 WHERE id = $1")
                .bytes(&job.to_bytes())
                .text(state.name())
                .text_if(error.as_deref())
                .integer_if(started.map(|t| t.millis()))
                .integer_if(finished.map(|t| t.millis()));
            connection.execute(query).await?
        }
        Change::Frame { job, position, frame } => keep_frame(connection, *job, *position, frame).await?,
        Change::Leased { job, unit, epoch, worker, at } => {
            let claim = if *epoch == 1 {
                Statement::new("INSERT INTO units (job, unit, epoch) VALUES ($1, $2, $3) ON CONFLICT DO NOTHING")
            } else {
                Statement::new(
                    "UPDATE units SET epoch = $3 WHERE job = $1 AND unit = $2 AND epoch = $3 - 1
                     AND NOT EXISTS (SELECT 1 FROM results WHERE job = $1 AND unit = $2)",
                )
            };
            let claimed = connection.execute(claim.bytes(&job.to_bytes()).integer(*unit).integer(*epoch)).await?;
            let lease = "INSERT INTO leases (job, unit, worker, granted) VALUES ($1, $2, $3, $4)
                         ON CONFLICT (job, unit) DO UPDATE SET worker = excluded.worker, granted = excluded.granted";
            if claimed == 1 {
                let query = Statement::new(lease).bytes(&job.to_bytes()).integer(*unit).bytes(&worker.to_bytes()).integer(at.millis());
                connection.execute(query).await?;
            }
            claimed
        }
        Change::Freed { job, unit, failures, losses, given_up } => {
            end_lease(connection, *job, *unit).await?;
            let query = Statement::new("UPDATE units SET failures = $3, losses = $4, given_up = $5 WHERE job = $1 AND unit = $2")
                .bytes(&job.to_bytes())
                .integer(*unit)
                .integer(*failures)
                .integer(*losses)
                .integer(*given_up);
            if *given_up {
                forget_witnesses(connection, *job, *unit).await?;
            }
            connection.execute(query).await?
        }
        Change::Attempt { job, unit, number, attempt } => {
            let insert = "INSERT INTO attempts (job, unit, number, worker, epoch, at, ending, reason)
                          SELECT id, $2, $3, $4, $5, $6, $7, $8 FROM jobs WHERE id = $1 ON CONFLICT DO NOTHING";
            let query = Statement::new(insert)
                .bytes(&job.to_bytes())
                .integer(*unit)
                .integer(*number)
                .bytes(&attempt.worker.to_bytes())
                .integer(attempt.epoch)
                .integer(attempt.at.millis())
                .text(attempt.ending.name())
                .text(&attempt.reason);
            connection.execute(query).await?
        }
        Change::Witness { job, unit, witness } => {
            end_lease(connection, *job, *unit).await?;
            let insert = "INSERT INTO witnesses (job, unit, epoch, worker, content)
                          SELECT job, unit, epoch, $4, $5 FROM units WHERE job = $1 AND unit = $2 AND epoch = $3 ON CONFLICT DO NOTHING";
            let query = Statement::new(insert)
                .bytes(&job.to_bytes())
                .integer(*unit)
                .integer(witness.epoch)
                .bytes(&witness.worker.to_bytes())
                .bytes(witness.content.as_bytes());
            connection.execute(query).await?
        }
        Change::Withdrawn { job, unit, epoch } => {
            let query = Statement::new("DELETE FROM results WHERE job = $1 AND unit = $2");
            connection.execute(query.bytes(&job.to_bytes()).integer(*unit)).await?;
            let query = Statement::new("UPDATE units SET epoch = $3 WHERE job = $1 AND unit = $2 AND epoch = $3 - 1");
            connection.execute(query.bytes(&job.to_bytes()).integer(*unit).integer(*epoch)).await?
        }
        Change::Priority { job, priority } => {
            let query = Statement::new("UPDATE jobs SET priority = $2 WHERE id = $1").bytes(&job.to_bytes()).integer(*priority);
            connection.execute(query).await?
        }
        Change::Delivered { job, unit, epoch, worker, result } => {
            end_lease(connection, *job, *unit).await?;
            let insert = "INSERT INTO results (job, unit, epoch, content, blob, size, load, compile, render, worker)
                          SELECT job, unit, epoch, $4, $5, $6, $7, $8, $9, $10 FROM units WHERE job = $1 AND unit = $2 AND epoch = $3
                          ON CONFLICT DO NOTHING";
            let query = Statement::new(insert)
                .bytes(&job.to_bytes())
                .integer(*unit)
                .integer(*epoch)
                .bytes(result.content.as_bytes())
                .bytes(result.blob.as_bytes())
                .count(result.size)
                .real(result.load)
                .real(result.compile)
                .real(result.render)
                .bytes(&worker.to_bytes());
            connection.execute(query).await?
        }
        Change::File { job, position, file } => {
            let insert = "INSERT INTO files (job, position, kind, blob, size) SELECT id, $2, $3, $4, $5 FROM jobs WHERE id = $1
                          ON CONFLICT (job, position, kind) DO UPDATE SET blob = excluded.blob, size = excluded.size";
            let query = Statement::new(insert)
                .bytes(&job.to_bytes())
                .integer(*position)
                .text(file.kind.name())
                .bytes(file.blob.as_bytes())
                .count(file.size);
            connection.execute(query).await?
        }
        Change::Window { job, window, solved } => keep_window(connection, *job, *window, solved).await?,
        Change::Paused { job, paused } => {
            let query = Statement::new("UPDATE jobs SET paused = $2 WHERE id = $1").bytes(&job.to_bytes()).integer(*paused);
            connection.execute(query).await?
        }
        Change::Forgotten { job } => forget(connection, *job).await?,
        Change::Worker { worker, name, version, threads, at } => {
            let insert = "INSERT INTO workers (id, name, version, threads, connected) VALUES ($1, $2, $3, $4, $5)
                          ON CONFLICT (id) DO UPDATE SET connected = excluded.connected";
            let query = Statement::new(insert).bytes(&worker.to_bytes()).text(name).text(version).integer(*threads).integer(at.millis());
            connection.execute(query).await?
        }
    };
    if rows == 1 { Ok(()) } else { Err(StoreError::conflict(change)) }
}

async fn keep_frame(connection: &mut Connection<'_>, job: JobId, position: u32, frame: &Frame) -> Result<u64, StoreError> {
    let upsert = "INSERT INTO frames (job, position, state, started, units, samples, load, compile, render, render_span, stitch,
                                      reconstruct, write, estimated_relmse, statistics, goal, stopped, choice,
                                      failed_units, suspect_units, failure)
                  SELECT id, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21 FROM jobs WHERE id = $1
                  ON CONFLICT (job, position) DO UPDATE SET
                      state = excluded.state, started = excluded.started, units = excluded.units, samples = excluded.samples,
                      load = excluded.load, compile = excluded.compile, render = excluded.render, render_span = excluded.render_span,
                      stitch = excluded.stitch, reconstruct = excluded.reconstruct, write = excluded.write,
                      estimated_relmse = excluded.estimated_relmse, statistics = excluded.statistics,
                      goal = excluded.goal, stopped = excluded.stopped, choice = excluded.choice,
                      failed_units = excluded.failed_units, suspect_units = excluded.suspect_units, failure = excluded.failure";
    let statistics: Vec<u8> = frame.statistics.counts().iter().flat_map(|count| count.to_le_bytes()).collect();
    let query = Statement::new(upsert)
        .bytes(&job.to_bytes())
        .integer(position)
        .text(if frame.state == FrameState::Failed { FrameState::Assembling } else { frame.state }.name())
        .integer_if(frame.started.map(|t| t.millis()))
        .integer(frame.units)
        .count(frame.samples)
        .real(frame.seconds.load)
        .real(frame.seconds.compile)
        .real(frame.seconds.render)
        .real(frame.seconds.render_span)
        .real(frame.seconds.stitch)
        .real(frame.seconds.reconstruct)
        .real(frame.seconds.write)
        .real_if(frame.estimated_relmse)
        .bytes(&statistics)
        .integer(frame.goal)
        .text_if(frame.stopped.map(Reason::name))
        .text_if(frame.choice.as_deref())
        .integer(frame.failed_units)
        .integer(frame.suspect_units)
        .text_if(frame.failure.as_deref());
    let rows = connection.execute(query).await?;
    if rows == 1 {
        keep_points(connection, job, position, &frame.points).await?;
    }
    Ok(rows)
}

/// A window and its shares, if there is no such window yet.
async fn keep_window(connection: &mut Connection<'_>, job: JobId, window: u32, solved: &SolvedWindow) -> Result<u64, StoreError> {
    let insert = "INSERT INTO windows (job, number, stitch, reconstruct, alpha, iterations, residual)
                  SELECT id, $2, $3, $4, $5, $6, $7 FROM jobs WHERE id = $1 ON CONFLICT DO NOTHING";
    let query = Statement::new(insert)
        .bytes(&job.to_bytes())
        .integer(window)
        .real(solved.stitch)
        .real(solved.reconstruct)
        .real(f64::from(solved.report.alpha))
        .integer(solved.report.iterations)
        .real(solved.report.residual);
    let rows = connection.execute(query).await?;
    if rows == 1 {
        for (place, share) in (0u32..).zip(&solved.shares) {
            let insert = "INSERT INTO shares (job, number, place, blob, size) VALUES ($1, $2, $3, $4, $5)";
            let query =
                Statement::new(insert).bytes(&job.to_bytes()).integer(window).integer(place).bytes(share.blob.as_bytes()).count(share.size);
            connection.execute(query).await?;
        }
    }
    Ok(rows)
}

/// A frame's points as they are now; there are a few dozen at most.
async fn keep_points(connection: &mut Connection<'_>, job: JobId, position: u32, points: &[Point]) -> Result<(), StoreError> {
    let query = Statement::new("DELETE FROM points WHERE job = $1 AND position = $2").bytes(&job.to_bytes()).integer(position);
    connection.execute(query).await?;
    let insert = "INSERT INTO points (job, position, samples, cpu_seconds, wall_seconds, check_seconds, relmse, low, high)
                  VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)";
    for point in points {
        let query = Statement::new(insert)
            .bytes(&job.to_bytes())
            .integer(position)
            .integer(point.samples)
            .real(point.cpu_seconds)
            .real(point.wall_seconds)
            .real(point.check_seconds)
            .real(point.error.relmse)
            .real(point.error.low)
            .real(point.error.high);
        connection.execute(query).await?;
    }
    Ok(())
}

/// Of a unit that is given up nothing more is compared.
async fn forget_witnesses(connection: &mut Connection<'_>, job: JobId, unit: u32) -> Result<(), StoreError> {
    let query = Statement::new("DELETE FROM witnesses WHERE job = $1 AND unit = $2").bytes(&job.to_bytes()).integer(unit);
    connection.execute(query).await?;
    Ok(())
}

async fn end_lease(connection: &mut Connection<'_>, job: JobId, unit: u32) -> Result<(), StoreError> {
    let query = Statement::new("DELETE FROM leases WHERE job = $1 AND unit = $2").bytes(&job.to_bytes()).integer(unit);
    connection.execute(query).await?;
    Ok(())
}

/// Removes a job that is over, from its leaves to its root.
async fn forget(connection: &mut Connection<'_>, job: JobId) -> Result<u64, StoreError> {
    let over = "SELECT 1 FROM jobs WHERE id = $1 AND state IN ('done', 'failed', 'cancelled')";
    if connection.first(Statement::new(over).bytes(&job.to_bytes())).await?.is_none() {
        return Ok(0);
    }
    let parts = [
        "DELETE FROM attempts WHERE job = $1",
        "DELETE FROM witnesses WHERE job = $1",
        "DELETE FROM points WHERE job = $1",
        "DELETE FROM files WHERE job = $1",
        "DELETE FROM shares WHERE job = $1",
        "DELETE FROM windows WHERE job = $1",
        "DELETE FROM leases WHERE job = $1",
        "DELETE FROM results WHERE job = $1",
        "DELETE FROM units WHERE job = $1",
        "DELETE FROM frames WHERE job = $1",
    ];
    for part in parts {
        connection.execute(Statement::new(part).bytes(&job.to_bytes())).await?;
    }
    connection.execute(Statement::new("DELETE FROM jobs WHERE id = $1").bytes(&job.to_bytes())).await
}
