//! A whole frame from the core alone: every unit of the plan, rendered and folded as the farm would.

use gradfarm_core::film::{Film, FoldError, FrameFold, TileFold};
use gradfarm_core::plan::{Plan, WorkUnit};
use gradfarm_core::render::render_unit;
use gradfarm_core::scene::Scene;
use rayon::prelude::*;

/// Edge of the tiles [pixels]: small, so that a small film keeps every core busy.
const TILE: u32 = 8;

/// Renders frame 0 of a plan. The bits are those of the farm for the same plan.
///
/// # Errors
/// If the blocks do not fold to a whole frame, which would be a fault of the core.
pub fn render(scene: &Scene, plan: &Plan) -> Result<Film, FoldError> {
    let layout = plan.layout();
    let folds: Vec<TileFold> = plan
        .extent
        .tiles(TILE)
        .into_par_iter()
        .map(|tile| {
            let mut fold = TileFold::new(tile, &layout);
            for samples in plan.sample_ranges() {
                fold.add(&render_unit(scene, plan, &WorkUnit { frame: 0, tile, samples }))?;
            }
            Ok(fold)
        })
        .collect::<Result<_, FoldError>>()?;
    let mut frame = FrameFold::new(plan.extent, &layout);
    for fold in &folds {
        frame.place(fold)?;
    }
    frame.finish()
}
