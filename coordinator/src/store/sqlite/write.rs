//! Changes as SQL. Each statement that could meet another writer's work names what it expects, and a miss is a conflict.

use gradfarm_core::accuracy::{Point, Reason};
use gradfarm_proto::v1;
use prost::Message;
use sqlx::{Sqlite, Transaction};

use crate::job::{Change, Frame, JobId, SolvedWindow};
use crate::store::StoreError;

/// Makes one change within a transaction.
pub(super) async fn make(transaction: &mut Transaction<'static, Sqlite>, change: &Change) -> Result<(), StoreError> {
    let rows = match change {
        Change::Submitted(record) => {
            let plan = v1::Plan::from(&record.plan).encode_to_vec();
            let moments: Vec<u8> = record.moments.iter().flat_map(|moment| moment.end.to_le_bytes()).collect();
            let insert =
                "INSERT INTO jobs (id, name, priority, created, client_token, scene, plan, tile, first_frame, frame_count, moments, state)
                          VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, 'queued') ON CONFLICT DO NOTHING";
            let query = sqlx::query(insert)
                .bind(id(record.id))
                .bind(&record.name)
                .bind(record.priority)
                .bind(record.created.millis())
                .bind(&record.client_token)
                .bind(record.scene.as_bytes().to_vec())
                .bind(plan)
                .bind(record.tile)
                .bind(record.first_frame)
                .bind(record.frame_count)
                .bind(moments);
            query.execute(&mut **transaction).await?.rows_affected()
        }
        Change::Job { job, state, error, started, finished } => {
            let query = sqlx::query("UPDATE jobs SET state = $2, error = $3, started = $4, finished = $5 WHERE id = $1")
                .bind(id(*job))
                .bind(state.name())
                .bind(error)
                .bind(started.map(|t| t.millis()))
                .bind(finished.map(|t| t.millis()));
            query.execute(&mut **transaction).await?.rows_affected()
        }
        Change::Frame { job, position, frame } => keep_frame(transaction, *job, *position, frame).await?,
        Change::Leased { job, unit, epoch, worker, at } => {
            let claim = if *epoch == 1 {
                sqlx::query("INSERT INTO units (job, unit, epoch) VALUES ($1, $2, $3) ON CONFLICT DO NOTHING")
            } else {
                sqlx::query(
                    "UPDATE units SET epoch = $3 WHERE job = $1 AND unit = $2 AND epoch = $3 - 1
                     AND NOT EXISTS (SELECT 1 FROM results WHERE job = $1 AND unit = $2)",
                )
            };
            let claimed = claim.bind(id(*job)).bind(unit).bind(epoch).execute(&mut **transaction).await?.rows_affected();
            let lease = "INSERT INTO leases (job, unit, worker, granted) VALUES ($1, $2, $3, $4)
                         ON CONFLICT (job, unit) DO UPDATE SET worker = excluded.worker, granted = excluded.granted";
            if claimed == 1 {
                let query = sqlx::query(lease).bind(id(*job)).bind(unit).bind(worker.to_bytes().to_vec()).bind(at.millis());
                query.execute(&mut **transaction).await?;
            }
            claimed
        }
        Change::Freed { job, unit, failures, losses } => {
            end_lease(transaction, *job, *unit).await?;
            let query = sqlx::query("UPDATE units SET failures = $3, losses = $4 WHERE job = $1 AND unit = $2")
                .bind(id(*job))
                .bind(unit)
                .bind(failures)
                .bind(losses);
            query.execute(&mut **transaction).await?.rows_affected()
        }
        Change::Delivered { job, unit, epoch, result } => {
            end_lease(transaction, *job, *unit).await?;
            let insert = "INSERT INTO results (job, unit, epoch, content, blob, size, load, compile, render)
                          SELECT job, unit, epoch, $4, $5, $6, $7, $8, $9 FROM units WHERE job = $1 AND unit = $2 AND epoch = $3
                          ON CONFLICT DO NOTHING";
            let query = sqlx::query(insert)
                .bind(id(*job))
                .bind(unit)
                .bind(epoch)
                .bind(result.content.as_bytes().to_vec())
                .bind(result.blob.as_bytes().to_vec())
                .bind(result.size as i64)
                .bind(result.load)
                .bind(result.compile)
                .bind(result.render);
            query.execute(&mut **transaction).await?.rows_affected()
        }
        Change::File { job, position, file } => {
            let insert = "INSERT INTO files (job, position, kind, blob, size) SELECT id, $2, $3, $4, $5 FROM jobs WHERE id = $1
                          ON CONFLICT (job, position, kind) DO UPDATE SET blob = excluded.blob, size = excluded.size";
            let query = sqlx::query(insert)
                .bind(id(*job))
                .bind(position)
                .bind(file.kind.name())
                .bind(file.blob.as_bytes().to_vec())
                .bind(file.size as i64);
            query.execute(&mut **transaction).await?.rows_affected()
        }
        Change::Window { job, window, solved } => keep_window(transaction, *job, *window, solved).await?,
        Change::Paused { job, paused } => {
            let query = sqlx::query("UPDATE jobs SET paused = $2 WHERE id = $1").bind(id(*job)).bind(paused);
            query.execute(&mut **transaction).await?.rows_affected()
        }
        Change::Worker { worker, name, version, threads, at } => {
            let insert = "INSERT INTO workers (id, name, version, threads, connected) VALUES ($1, $2, $3, $4, $5)
                          ON CONFLICT (id) DO UPDATE SET connected = excluded.connected";
            let query = sqlx::query(insert).bind(worker.to_bytes().to_vec()).bind(name).bind(version).bind(threads).bind(at.millis());
            query.execute(&mut **transaction).await?.rows_affected()
        }
    };
    if rows == 1 { Ok(()) } else { Err(StoreError::conflict(change)) }
}

async fn keep_frame(transaction: &mut Transaction<'static, Sqlite>, job: JobId, position: u32, frame: &Frame) -> Result<u64, StoreError> {
    let upsert = "INSERT INTO frames (job, position, state, started, units, samples, load, compile, render, render_span, stitch,
                                      reconstruct, write, estimated_relmse, statistics, goal, stopped, choice)
                  SELECT id, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18 FROM jobs WHERE id = $1
                  ON CONFLICT (job, position) DO UPDATE SET
                      state = excluded.state, started = excluded.started, units = excluded.units, samples = excluded.samples,
                      load = excluded.load, compile = excluded.compile, render = excluded.render, render_span = excluded.render_span,
                      stitch = excluded.stitch, reconstruct = excluded.reconstruct, write = excluded.write,
                      estimated_relmse = excluded.estimated_relmse, statistics = excluded.statistics,
                      goal = excluded.goal, stopped = excluded.stopped, choice = excluded.choice";
    let statistics: Vec<u8> = frame.statistics.counts().iter().flat_map(|count| count.to_le_bytes()).collect();
    let query = sqlx::query(upsert)
        .bind(id(job))
        .bind(position)
        .bind(frame.state.name())
        .bind(frame.started.map(|t| t.millis()))
        .bind(frame.units)
        .bind(frame.samples as i64)
        .bind(frame.seconds.load)
        .bind(frame.seconds.compile)
        .bind(frame.seconds.render)
        .bind(frame.seconds.render_span)
        .bind(frame.seconds.stitch)
        .bind(frame.seconds.reconstruct)
        .bind(frame.seconds.write)
        .bind(frame.estimated_relmse)
        .bind(statistics)
        .bind(frame.goal)
        .bind(frame.stopped.map(Reason::name))
        .bind(&frame.choice);
    let rows = query.execute(&mut **transaction).await?.rows_affected();
    if rows == 1 {
        keep_points(transaction, job, position, &frame.points).await?;
    }
    Ok(rows)
}

/// A window and its shares, if there is no such window yet.
async fn keep_window(
    transaction: &mut Transaction<'static, Sqlite>,
    job: JobId,
    window: u32,
    solved: &SolvedWindow,
) -> Result<u64, StoreError> {
    let insert = "INSERT INTO windows (job, number, stitch, reconstruct, alpha, iterations, residual)
                  SELECT id, $2, $3, $4, $5, $6, $7 FROM jobs WHERE id = $1 ON CONFLICT DO NOTHING";
    let query = sqlx::query(insert)
        .bind(id(job))
        .bind(window)
        .bind(solved.stitch)
        .bind(solved.reconstruct)
        .bind(f64::from(solved.report.alpha))
        .bind(solved.report.iterations)
        .bind(solved.report.residual);
    let rows = query.execute(&mut **transaction).await?.rows_affected();
    if rows == 1 {
        for (place, share) in (0u32..).zip(&solved.shares) {
            let insert = "INSERT INTO shares (job, number, place, blob, size) VALUES ($1, $2, $3, $4, $5)";
            let query =
                sqlx::query(insert).bind(id(job)).bind(window).bind(place).bind(share.blob.as_bytes().to_vec()).bind(share.size as i64);
            query.execute(&mut **transaction).await?;
        }
    }
    Ok(rows)
}

/// A frame's points as they are now; there are a few dozen at most.
async fn keep_points(
    transaction: &mut Transaction<'static, Sqlite>,
    job: JobId,
    position: u32,
    points: &[Point],
) -> Result<(), StoreError> {
    let query = sqlx::query("DELETE FROM points WHERE job = $1 AND position = $2").bind(id(job)).bind(position);
    query.execute(&mut **transaction).await?;
    let insert = "INSERT INTO points (job, position, samples, cpu_seconds, wall_seconds, check_seconds, relmse, low, high)
                  VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)";
    for point in points {
        let query = sqlx::query(insert)
            .bind(id(job))
            .bind(position)
            .bind(point.samples)
            .bind(point.cpu_seconds)
            .bind(point.wall_seconds)
            .bind(point.check_seconds)
            .bind(point.error.relmse)
            .bind(point.error.low)
            .bind(point.error.high);
        query.execute(&mut **transaction).await?;
    }
    Ok(())
}

async fn end_lease(transaction: &mut Transaction<'static, Sqlite>, job: JobId, unit: u32) -> Result<(), StoreError> {
    let query = sqlx::query("DELETE FROM leases WHERE job = $1 AND unit = $2").bind(id(job)).bind(unit);
    query.execute(&mut **transaction).await?;
    Ok(())
}

fn id(job: JobId) -> Vec<u8> {
    job.to_bytes().to_vec()
}
