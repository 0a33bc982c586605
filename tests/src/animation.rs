//! Moments of an animation from the core alone, rendered and folded as the farm would.

use gradfarm_core::film::{Film, FoldError, FrameFold, TileFold};
use gradfarm_core::lattice::{Moment, Tile};
use gradfarm_core::plan::{Plan, WorkUnit};
use gradfarm_core::render::render_unit;
use gradfarm_core::scene::Instants;
use rayon::prelude::*;

/// Edge of the tiles [pixels].
const TILE: u32 = 16;

/// Renders a moment in its two copies: the even passes and the odd ones of the plan, which must have both.
///
/// # Errors
/// If the blocks do not fold to whole frames, which would be a fault of the core.
pub fn copies(scene: &Instants, plan: &Plan, moment: Moment) -> Result<[Film; 2], FoldError> {
    let layout = plan.layout();
    let passes = plan.passes();
    let tiles = plan.extent.tiles(TILE);
    let both = |tile: &Tile| {
        let mut folds = [0, 1].map(|_| TileFold::new(*tile, &layout));
        for (k, pass) in passes.iter().enumerate() {
            let unit = WorkUnit { moment, tile: *tile, samples: pass.samples };
            folds[k % 2].add(&render_unit(scene.clone(), plan, &unit))?;
            folds[1 - k % 2].skip(pass.samples);
        }
        Ok::<_, FoldError>(folds)
    };
    let folds = tiles.par_iter().map(both).collect::<Result<Vec<_>, _>>()?;
    let film = |copy: usize| {
        let mut frame = FrameFold::new(plan.extent, &layout);
        folds.iter().try_for_each(|folds| frame.place(&folds[copy]))?;
        frame.finish()
    };
    Ok([film(0)?, film(1)?])
}

/// Renders a moment as one film.
///
/// # Errors
/// As [`copies`].
pub fn whole(scene: &Instants, plan: &Plan, moment: Moment) -> Result<Film, FoldError> {
    let layout = plan.layout();
    let one = |tile: &Tile| {
        let mut fold = TileFold::new(*tile, &layout);
        for pass in plan.passes() {
            fold.add(&render_unit(scene.clone(), plan, &WorkUnit { moment, tile: *tile, samples: pass.samples }))?;
        }
        Ok::<_, FoldError>(fold)
    };
    let folds = plan.extent.tiles(TILE).par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    let mut frame = FrameFold::new(plan.extent, &layout);
    folds.iter().try_for_each(|fold| frame.place(fold))?;
    frame.finish()
}
