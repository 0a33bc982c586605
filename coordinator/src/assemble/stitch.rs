//! Adds a frame's blocks up: for each tile its passes in order, then the tiles into the frame.

use std::time::Instant;

use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use gradfarm_core::film::{Film, FrameFold, PlaneKind, Statistics, TileFold};
use gradfarm_core::lattice::Tile;
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

/// Reads the results of a frame, as far as it goes, and adds them up.
pub(super) async fn stitch(task: &Task, store: &dyn Store, blobs: &Blobs) -> Result<Stitched, AssembleError> {
    let start = Instant::now();
    let (frame, tiles) = fold(task, task.passes, store, blobs).await?;
    let film = tokio::task::spawn_blocking(move || frame.finish()).await??;
    Ok(Stitched { film, tiles, seconds: start.elapsed().as_secs_f64() })
}

/// Reads the results of a frame's first `passes` passes and adds them up: the frame, and what was counted in each tile. As many tiles are
/// in the making as there are cores; each holds its sums in f64 and one block at a time.
pub(super) async fn fold(
    task: &Task,
    passes: u32,
    store: &dyn Store,
    blobs: &Blobs,
) -> Result<(FrameFold, Vec<(Tile, Statistics)>), AssembleError> {
    let first = task.split.units_per_frame() * task.position;
    let results = store.results(task.record.id, first..first + passes * task.split.tiles().len() as u32).await?;
    let result = |unit: u32| {
        let found = results.binary_search_by_key(&unit, |(u, _)| *u).ok().map(|at| results[at].1);
        found.map(|result| (unit, result)).ok_or(AssembleError::Absent { unit })
    };
    let layout = task.record.plan.layout();
    let mut frame = FrameFold::new(task.record.plan.extent, &layout);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut tiles = Vec::with_capacity(task.split.tiles().len());
    for (index, tile) in task.split.tiles().iter().enumerate() {
        let unit = |pass| result(task.split.unit(Place { frame: task.position, pass, tile: index as u32 }));
        tiles.push(fold_tile(*tile, layout.clone(), (0..passes).map(unit).collect::<Result<_, _>>()?, blobs.clone()));
    }
    let mut folds = stream::iter(tiles).buffered(cores);
    let mut counted = Vec::with_capacity(task.split.tiles().len());
    while let Some(fold) = folds.try_next().await? {
        // Copying a tile's means takes less than handing it to another thread.
        frame.place(&fold)?;
        counted.push((fold.tile(), *fold.statistics()));
    }
    Ok((frame, counted))
}

async fn fold_tile(
    tile: Tile,
    layout: Vec<PlaneKind>,
    units: Vec<(u32, DeliveredRecord)>,
    blobs: Blobs,
) -> Result<TileFold, AssembleError> {
    let mut fold = TileFold::new(tile, &layout);
    for (unit, result) in units {
        let bytes = blobs.get(result.blob).await?;
        fold = tokio::task::spawn_blocking(move || add(fold, unit, result, &bytes)).await??;
    }
    Ok(fold)
}

fn add(mut fold: TileFold, unit: u32, result: DeliveredRecord, bytes: &Bytes) -> Result<TileFold, AssembleError> {
    let block = block::decode(bytes, result.content, result.size, limits::BLOCK).map_err(|source| AssembleError::Block { unit, source })?;
    fold.add(&block)?;
    Ok(fold)
}
