//! Moments that are reconstructed together: a window is solved from the films of its moments, and what it says of each is stored; a frame is
//! then blended from what all windows over it say. Both are pure functions of results, whoever rendered them and whenever.
//!
//! Memory: the films of one window, which are read once each, for windows are solved in the order of time; and while it is being solved what
//! the solver needs.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::{Arc, PoisonError};
use std::time::Instant;

use gradfarm_core::reconstruction::window::{MomentFilm, Share, Windows, blend, finish, solve as solve_together};
use gradfarm_core::reconstruction::{Reconstructed, SolveReport};
use gradfarm_proto::image;

use super::measure::Solved;
use super::stitch::{self, Stitched};
use super::{AssembleError, Task, Workshop};
use crate::job::{JobId, ShareRecord, SolvedWindow};

/// What one window says of a moment, and how its solve went.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) share: ShareRecord,
    pub(super) report: SolveReport,
}

/// Films of moments of one job, by position.
#[derive(Debug, Default)]
pub(super) struct Films {
    job: Option<JobId>,
    films: BTreeMap<u32, Arc<MomentFilm>>,
}

impl Workshop {
    /// Takes out the films that the window before left, if they are of this job; films of other jobs go.
    pub(super) fn films(&self, job: JobId) -> BTreeMap<u32, Arc<MomentFilm>> {
        let left = std::mem::take(&mut *self.films.lock().unwrap_or_else(PoisonError::into_inner));
        if left.job == Some(job) { left.films } else { BTreeMap::new() }
    }

    fn keep_films(&self, job: JobId, films: BTreeMap<u32, Arc<MomentFilm>>) {
        *self.films.lock().unwrap_or_else(PoisonError::into_inner) = Films { job: Some(job), films };
    }
}

/// Solves a window and stores what it says of its moments, whose tasks come in order.
pub(super) async fn solve(tasks: &[Task], layout: Windows, window: u32, shop: &Workshop) -> Result<SolvedWindow, AssembleError> {
    let Some(job) = tasks.first().map(|task| task.record.id) else { return Err(AssembleError::Nothing) };
    let start = Instant::now();
    let mut films = shop.films(job);
    let moments = layout.moments(window);
    films.retain(|position, _| moments.contains(position));
    for task in tasks {
        if let Entry::Vacant(place) = films.entry(task.position) {
            let (film, _) = stitch::moment(task, false, shop.store.as_ref(), &shop.blobs).await?;
            place.insert(Arc::new(film));
        }
    }
    let stitch = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let plan = tasks[0].record.plan.clone();
    let row: Vec<Arc<MomentFilm>> = films.values().cloned().collect();
    let solving = tokio::task::spawn_blocking(move || {
        let mut solution = solve_together(&row.iter().map(Arc::as_ref).collect::<Vec<_>>(), plan.reconstruction, plan.alpha)?;
        if !(solution.report.residual.is_finite() && solution.report.alpha.is_finite()) {
            return Err(AssembleError::Diverged);
        }
        for (share, position) in solution.moments.iter_mut().zip(layout.moments(window)) {
            share.scale(layout.weight(window, position));
        }
        let encoded = solution.moments.iter().map(|share| image::encode(&share.to_planes()));
        Ok((encoded.collect::<Result<Vec<_>, _>>().map_err(AssembleError::Compress)?, solution.report))
    });
    let (encoded, report) = solving.await??;
    // The next window begins where this one goes on.
    let next = layout.moments(window + 1);
    films.retain(|position, _| next.contains(position));
    shop.keep_films(job, films);
    let mut shares = Vec::with_capacity(encoded.len());
    for (size, bytes) in encoded {
        shares.push(ShareRecord { blob: shop.blobs.put(bytes).await?, size });
    }
    Ok(SolvedWindow { shares, report, stitch, reconstruct: start.elapsed().as_secs_f64() })
}

/// The frame of a moment from what all windows over it say.
pub(super) async fn frame(task: &Task, shop: &Workshop) -> Result<(Stitched, Solved), AssembleError> {
    let (film, stitched) = stitch::moment(task, true, shop.store.as_ref(), &shop.blobs).await?;
    let stitched = stitched.ok_or(AssembleError::Nothing)?;
    let start = Instant::now();
    let mut encoded = Vec::with_capacity(task.shares.len());
    for part in &task.shares {
        encoded.push((shop.blobs.get(part.share.blob).await?, part.share.size));
    }
    let (kind, clamp) = (task.record.plan.reconstruction, task.record.plan.clamp);
    let reports: Vec<SolveReport> = task.shares.iter().map(|part| part.report).collect();
    let blending = move || {
        let share = |(place, (bytes, size)): (usize, &(bytes::Bytes, u64))| {
            let planes = image::decode(bytes, *size).map_err(|source| AssembleError::Share { place, source })?;
            Share::from_planes(&planes).ok_or(AssembleError::NoShare { place })
        };
        let shares = encoded.iter().enumerate().map(share).collect::<Result<Vec<_>, _>>()?;
        let blended = blend(shares)?.ok_or(AssembleError::Nothing)?;
        let mut reconstructed = finish(blended, &film, kind, together(&reports))?;
        if clamp {
            reconstructed.clamp();
        }
        Ok::<Reconstructed, AssembleError>(reconstructed)
    };
    let reconstructed = tokio::task::spawn_blocking(blending).await??;
    Ok((stitched, Solved { reconstructed, seconds: start.elapsed().as_secs_f64() }))
}

/// How the solves of all windows over a moment went: the mean weight of the primal, and the worst of the rest.
fn together(reports: &[SolveReport]) -> SolveReport {
    let alpha = reports.iter().map(|report| report.alpha).sum::<f32>() / reports.len().max(1) as f32;
    let iterations = reports.iter().map(|report| report.iterations).max().unwrap_or(0);
    let residual = reports.iter().map(|report| report.residual).fold(0.0, f64::max);
    SolveReport { alpha, iterations, residual }
}
