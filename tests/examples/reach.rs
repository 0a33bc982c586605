//! How far changes reach in an animation: each frame is rendered with the very numbers of the one before, and tiles and pixels that come out
//! the same to the bit are counted, with paths of any length that the plan allows and with direct light alone. No proof can save more tiles than
//! these: a tile that changes with the same numbers has a path that met a change.
//!
//! Arguments: file of an animated scene, frames per second, frames, samples per pixel, and a film size such as 96x72.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use gradfarm_core::film::Film;
use gradfarm_core::lattice::{Extent, Moment, Tile};
use gradfarm_core::plan::{Plan, Request, Technique, Timeline, resolve};
use gradfarm_core::scene::{Scene, load};
use gradfarm_tests::animation::whole;

type Fault = Box<dyn std::error::Error>;

/// Edge of the tiles that are counted [pixels].
const EDGE: u32 = 16;

fn main() -> ExitCode {
    match count(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

fn count(arguments: &[String]) -> Result<(), Fault> {
    let expected = "expected: scene, frames per second, frames, samples, size";
    let [file, fps, frames, samples, size] = arguments else { return Err(expected.into()) };
    let (fps, frames, samples): (f64, u32, u32) = (fps.parse()?, frames.parse()?, samples.parse()?);
    let (width, height) = size.split_once('x').ok_or(expected)?;
    let extent = Extent { width: width.parse()?, height: height.parse()? };
    let loaded = load(Path::new(file))?;
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{file}: {frames} frames at {fps} a second, {width} × {height}, {samples} samples; the same to the bit as the frame before:"
    )?;
    for depth in [None, Some(2)] {
        let request = Request {
            technique: Some(Technique::Pt),
            samples: Some(samples),
            extent: Some(extent),
            max_depth: depth,
            frames,
            timeline: Some(Timeline { fps, ..Timeline::default() }),
            temporal: Some(false),
            ..Request::default()
        };
        let plan: Plan = resolve(&loaded.description, &request)?;
        let (mut same, mut before): ([usize; 2], Option<Film>) = ([0; 2], None);
        for moment in plan.moments(&loaded.description, 0..frames)? {
            let still = loaded.description.at(f64::from(moment.first) / fps)?;
            let scene = Scene::compile(&still, &loaded.assets)?;
            let film = whole(&(&scene).into(), &plan, Moment::of(0))?;
            if let Some(before) = &before {
                let tiles = extent.tiles(EDGE);
                same[0] += tiles.iter().filter(|tile| unchanged(before, &film, **tile)).count();
                let pixels = (0..extent.height).flat_map(|y| (0..extent.width).map(move |x| Tile { x, y, width: 1, height: 1 }));
                same[1] += pixels.filter(|pixel| unchanged(before, &film, *pixel)).count();
            }
            before = Some(film);
        }
        let pairs = plan.moments(&loaded.description, 0..frames)?.len().saturating_sub(1).max(1);
        let share = |same: usize, of: usize| 100.0 * same as f64 / (of * pairs) as f64;
        writeln!(
            out,
            "  paths up to {} edges: {:.1} % of tiles of {EDGE} × {EDGE}, {:.1} % of pixels, over {pairs} pairs of moments",
            plan.max_depth,
            share(same[0], extent.tiles(EDGE).len()),
            share(same[1], extent.pixels()),
        )?;
    }
    Ok(())
}

/// Whether a tile has the same bits in both films.
fn unchanged(a: &Film, b: &Film, tile: Tile) -> bool {
    let places = (tile.y..tile.y + tile.height).flat_map(|y| (tile.x..tile.x + tile.width).map(move |x| (x, y)));
    places.into_iter().all(|(x, y)| {
        a.halves
            .iter()
            .zip(&b.halves)
            .all(|(a, b)| (0..3).all(|c| a.primal.at(x, y, c) == b.primal.at(x, y, c) && a.direct.at(x, y, c) == b.direct.at(x, y, c)))
    })
}
