//! Laws of every shift over millions of random base paths. `just laws` runs it.
//!
//! Arguments: base paths for each shift, in millions (1 unless given), then a seed. Base paths are the same for every shift. The process
//! fails where more shifts break a law than rounding explains.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use gradfarm_core::lattice::Extent;
use gradfarm_core::scene::{Scene, load};
use gradfarm_core::shift::ShiftKind;
use gradfarm_tests::laws::{Effort, Tallies, both, count};
use gradfarm_tests::scenes::still_lifes;

type Fault = Box<dyn std::error::Error>;

/// Films with far neighbours and with near ones.
const EXTENTS: [Extent; 2] = [Extent { width: 16, height: 12 }, Extent { width: 96, height: 72 }];
/// The thresholds of most shifts and of replay with reconnection.
const THRESHOLDS: [f32; 2] = [0.001, 0.2];
/// Largest share of a shift's answers that rounding may spoil, all scenes together [1].
const SPOILT: f64 = 2e-5;

fn main() -> ExitCode {
    match laws() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

/// Small rooms, and the scenes that people render.
fn scenes() -> Result<Vec<(String, Scene)>, Fault> {
    let mut scenes: Vec<_> = still_lifes()?.into_iter().map(|life| (life.name.to_owned(), life.scene)).collect();
    for name in ["cornell-box", "door-ajar", "hall"] {
        let loaded = load(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).with_extension("json"))?;
        scenes.push((name.to_owned(), Scene::compile(&loaded.description, &loaded.assets)?));
    }
    Ok(scenes)
}

/// Whether all laws hold.
fn laws() -> Result<bool, Fault> {
    let mut arguments = std::env::args().skip(1);
    let millions: f64 = arguments.next().map_or(Ok(1.0), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let scenes = scenes()?;
    let runs = scenes.len() * EXTENTS.len() * THRESHOLDS.len();
    let mut sum = Tallies::default();
    let mut out = std::io::stdout().lock();
    writeln!(out, "| scene | shift | paths | shifts | answers | cannot be undone | Jacobians | weights | strayed | farthest |")?;
    writeln!(out, "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|")?;
    for (name, scene) in &scenes {
        let mut here = Tallies::default();
        for (extent, threshold) in EXTENTS.into_iter().flat_map(|extent| THRESHOLDS.map(|threshold| (extent, threshold))) {
            let samples = (millions * 1e6 / runs as f64 / extent.pixels() as f64).ceil() as u32;
            here = both(here, count(scene, &Effort { extent, samples, threshold, seed }));
        }
        rows(&mut out, name, &here)?;
        sum = both(sum, here);
    }
    rows(&mut out, "all", &sum)?;
    Ok(sum.iter().all(|tally| tally.broken() <= SPOILT))
}

fn rows(out: &mut impl Write, name: &str, tallies: &Tallies) -> std::io::Result<()> {
    for (kind, t) in ShiftKind::ALL.into_iter().zip(tallies) {
        let (kind, answers) = (kind.name(), 100.0 * t.there as f64 / t.shifts.max(1) as f64);
        writeln!(
            out,
            "| {name} | {kind} | {} | {} | {answers:.1} % | {} | {} | {} | {} | {:.0e} |",
            t.paths, t.shifts, t.lost, t.apart, t.uneven, t.strayed, t.farthest
        )?;
    }
    out.flush()
}
