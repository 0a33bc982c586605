//! A whole frame from the core alone: every pass of the plan over every tile, rendered and folded as the farm would.

use gradfarm_core::film::{Film, FilmBlock, FoldError, FrameFold, Noise, TileFold};
use gradfarm_core::lattice::{Moment, Tile};
use gradfarm_core::plan::{Guide, Pass, Plan, WorkUnit};
use gradfarm_core::render::{render_guided, render_unit};
use gradfarm_core::scene::Scene;
use rayon::prelude::*;

/// Edge of the tiles [pixels]: small, so that a small film keeps every core busy.
const TILE: u32 = 8;

/// Renders frame 0 of a plan. The bits are those of the farm for the same plan.
///
/// # Errors
/// If the blocks do not fold to a whole frame, which would be a fault of the core.
pub fn render(scene: &Scene, plan: &Plan) -> Result<Film, FoldError> {
    render_steered(scene, plan, TILE, |noise| noise)
}

/// The same with tiles of another size, and with other noise to steer by than what was measured: `steer` may change it.
///
/// # Errors
/// As [`render`].
pub fn render_steered(scene: &Scene, plan: &Plan, edge: u32, steer: impl Fn([Noise; 2]) -> [Noise; 2]) -> Result<Film, FoldError> {
    let layout = plan.layout();
    let fold = |folds: &[[TileFold; 2]], which: usize| {
        let mut frame = FrameFold::new(plan.extent, &layout);
        folds.iter().try_for_each(|folds| frame.place(&folds[which]))?;
        Ok::<_, FoldError>(frame)
    };
    // All samples of each tile, and the even ones alone, which steer.
    let empty = |tile: Tile| [(); 2].map(|()| TileFold::new(tile, &layout));
    let mut folds: Vec<[TileFold; 2]> = plan.extent.tiles(edge).into_iter().map(empty).collect();
    let mut guides: Vec<Guide> = Vec::new();
    for pass in plan.passes() {
        // Each round's guide is made as soon as the even samples of the rounds before it are there.
        let round = guides.len() as u32 + 1;
        if round < plan.rounds && pass.samples.first == plan.steered_until(round) {
            guides.push(Guide::new(plan, 0, round, &steer(fold(&folds, 1)?.noise()?), &guides));
        }
        let tiles = plan.extent.tiles(edge);
        let render = |([all, even], tile): (&mut [TileFold; 2], Tile)| {
            let block = block(scene, plan, tile, &pass, &guides);
            if pass.slice.is_none() {
                even.add(&block)?
            } else {
                even.skip(pass.samples)
            }
            all.add(&block)
        };
        folds.par_iter_mut().zip(tiles).try_for_each(render)?;
    }
    fold(&folds, 0)?.finish()
}

/// A pass over a tile, by the guides that are there.
pub(crate) fn block(scene: &Scene, plan: &Plan, tile: Tile, pass: &Pass, guides: &[Guide]) -> FilmBlock {
    let unit = WorkUnit { moment: Moment::of(0), tile, samples: pass.samples };
    match pass.slice.and_then(|slice| Guide::of_tile(guides, &slice, tile)) {
        Some(guide) => render_guided(scene, plan, &unit, &guide),
        None => render_unit(scene, plan, &unit),
    }
}
