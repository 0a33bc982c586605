//! Adds a frame's blocks up: for each tile its passes in order, then the tiles into the frame. Every other pass by itself makes a copy of the
//! frame that is independent of the other copy.

use std::time::Instant;

use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use gradfarm_core::film::{Film, FrameFold, PlaneKind, Statistics, TileFold};
use gradfarm_core::lattice::{SampleRange, Tile};
use gradfarm_core::reconstruction::window::MomentFilm;
use gradfarm_proto::{block, limits};

use super::{AssembleError, Task};
use crate::job::DeliveredRecord;
use crate::schedule::Place;
use crate::store::{Blobs, Store};

/// A whole frame.
#[derive(Debug)]
pub(super) struct Stitched {
    /// Its means.
    pub(super) film: Film,
    /// What was counted in each tile, row by row.
    pub(super) tiles: Vec<(Tile, Statistics)>,
    /// How long it took [s].
    pub(super) seconds: f64,
}

/// Which passes of a frame are added up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// All of them.
    Whole,
    /// The first, the third and so on: the first copy.
    Even,
    /// The others: the second copy.
    Odd,
}

impl Part {
    fn takes(self, pass: usize) -> bool {
        match self {
            Part::Whole => true,
            Part::Even => pass.is_multiple_of(2),
            Part::Odd => !pass.is_multiple_of(2),
        }
    }
}

/// Reads the results of a moment and keeps of its two copies what windows need, and of the whole what its files show, if `whole`.
pub(super) async fn moment(
    task: &Task,
    whole: bool,
    store: &dyn Store,
    blobs: &Blobs,
) -> Result<(MomentFilm, Option<Stitched>), AssembleError> {
    let start = Instant::now();
    let parts: &[Part] = if whole { &[Part::Even, Part::Odd, Part::Whole] } else { &[Part::Even, Part::Odd] };
    let (mut frames, tiles) = fold(task, parts, task.passes, |_| true, store, blobs).await?;
    let all = if whole { frames.pop() } else { None };
    let finishing = move || {
        let copies = frames.into_iter().map(FrameFold::finish).collect::<Result<Vec<Film>, _>>()?;
        let moment = MomentFilm::new(&copies.iter().collect::<Vec<_>>())?;
        Ok::<_, AssembleError>((moment, all.map(FrameFold::finish).transpose()?))
    };
    let (moment, film) = tokio::task::spawn_blocking(finishing).await??;
    let seconds = start.elapsed().as_secs_f64();
    Ok((moment, film.map(|film| Stitched { film, tiles, seconds })))
}

/// Reads the results of a frame, as far as it goes, and adds them up.
pub(super) async fn stitch(task: &Task, store: &dyn Store, blobs: &Blobs) -> Result<Stitched, AssembleError> {
    let start = Instant::now();
    let (frames, tiles) = fold(task, &[Part::Whole], task.passes, |_| true, store, blobs).await?;
    let finishing = move || frames.into_iter().next().map(FrameFold::finish).transpose();
    let film = tokio::task::spawn_blocking(finishing).await??.ok_or(AssembleError::Nothing)?;
    Ok(Stitched { film, tiles, seconds: start.elapsed().as_secs_f64() })
}

/// Reads the results of those of a frame's first `passes` passes that are `wanted`, each once, and adds up parts of them: what each part makes
/// of the frame, and what was counted in each tile for the last part. As many tiles are in the making as there are cores; each holds its sums
/// in f64 and one block at a time.
pub(super) async fn fold(
    task: &Task,
    parts: &[Part],
    passes: u32,
    wanted: impl Fn(u32) -> bool,
    store: &dyn Store,
    blobs: &Blobs,
) -> Result<(Vec<FrameFold>, Vec<(Tile, Statistics)>), AssembleError> {
    let first = task.split.units_per_frame() * task.position;
    let results = store.results(task.record.id, first..first + passes * task.split.tiles().len() as u32).await?;
    let result = |unit: u32| {
        let found = results.binary_search_by_key(&unit, |(u, _)| *u).ok().map(|at| results[at].1);
        match found {
            Some(result) => Ok((unit, Some(result))),
            None if task.left_out.contains_key(&unit) => Ok((unit, None)),
            None => Err(AssembleError::Absent { unit }),
        }
    };
    let layout = task.record.plan.layout();
    let empty = if task.left_out.is_empty() { FrameFold::new } else { FrameFold::with_gaps };
    let mut frames = vec![empty(task.record.plan.extent, &layout); parts.len()];
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut tiles = Vec::with_capacity(task.split.tiles().len());
    for (index, tile) in task.split.tiles().iter().enumerate() {
        let unit = |pass| result(task.split.unit(Place { frame: task.position, pass, tile: index as u32 }));
        let run = |(pass, samples): (u32, SampleRange)| match unit(pass) {
            _ if !wanted(pass) => Ok(Run::Skip(samples)),
            Ok((_, None)) => Ok(Run::Skip(samples)),
            Ok((unit, Some(result))) => Ok(Run::Add((unit, result))),
            Err(absent) => Err(absent),
        };
        let samples = task.split.passes().iter().map(|pass| pass.samples);
        let runs = (0..passes).zip(samples).map(run).collect::<Result<_, _>>()?;
        tiles.push(fold_tile(*tile, layout.clone(), parts, runs, blobs.clone()));
    }
    let mut folds = stream::iter(tiles).buffered(cores);
    let mut counted = Vec::with_capacity(task.split.tiles().len());
    while let Some(parts) = folds.try_next().await? {
        // Copying a tile's means takes less than handing it to another thread.
        for (frame, fold) in frames.iter_mut().zip(&parts) {
            frame.place(fold)?;
        }
        counted.extend(parts.last().map(|fold| (fold.tile(), *fold.statistics())));
    }
    Ok((frames, counted))
}

/// A tile's next samples.
enum Run {
    /// The unit that has them, and its result.
    Add((u32, DeliveredRecord)),
    /// They are left out.
    Skip(SampleRange),
}

async fn fold_tile(
    tile: Tile,
    layout: Vec<PlaneKind>,
    parts: &[Part],
    runs: Vec<Run>,
    blobs: Blobs,
) -> Result<Vec<TileFold>, AssembleError> {
    let mut folds: Vec<(Part, TileFold)> = parts.iter().map(|part| (*part, TileFold::new(tile, &layout))).collect();
    for (pass, run) in runs.into_iter().enumerate() {
        match run {
            Run::Add((unit, result)) => {
                let bytes = blobs.get(result.blob).await?;
                folds = tokio::task::spawn_blocking(move || add(folds, pass, unit, result, &bytes)).await??;
            }
            Run::Skip(samples) => folds.iter_mut().for_each(|(_, fold)| fold.skip(samples)),
        }
    }
    Ok(folds.into_iter().map(|(_, fold)| fold).collect())
}

fn add(
    mut folds: Vec<(Part, TileFold)>,
    pass: usize,
    unit: u32,
    result: DeliveredRecord,
    bytes: &Bytes,
) -> Result<Vec<(Part, TileFold)>, AssembleError> {
    let block = block::decode(bytes, result.content, result.size, limits::BLOCK).map_err(|source| AssembleError::Block { unit, source })?;
    for (part, fold) in &mut folds {
        if part.takes(pass) {
            fold.add(&block)?;
        } else {
            fold.skip(block.samples);
        }
    }
    Ok(folds)
}
