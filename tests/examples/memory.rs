//! What a window costs in memory and time: moments of noise, their films dropped as on a farm, are solved for together, and the most memory
//! that the process held is read from the system (Linux).
//!
//! Arguments: a film size such as 1920x1080, moments, a reconstruction such as `l2`, and `rests` or `moves`.

use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

use gradfarm_core::film::{Features, Film, Gradients, HalfFilm, Image, Statistics};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::ReconstructionKind;
use gradfarm_core::reconstruction::window::{MomentFilm, solve};

type Fault = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    match measure(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &[String]) -> Result<(), Fault> {
    let expected = "expected: size, moments, reconstruction, rests or moves";
    let [size, count, kind, motion] = arguments else { return Err(expected.into()) };
    let (width, height) = size.split_once('x').ok_or(expected)?;
    let extent = Extent { width: width.parse()?, height: height.parse()? };
    let count: u32 = count.parse()?;
    let kind = ReconstructionKind::ALL.into_iter().find(|known| known.name() == kind.as_str()).ok_or("no such reconstruction")?;
    let moves = match motion.as_str() {
        "moves" => true,
        "rests" => false,
        _ => return Err(expected.into()),
    };
    let mut moments = Vec::new();
    for moment in 0..count {
        let films = [0, 1].map(|copy| film(extent, moment, copy, moves && moment > 0));
        moments.push(MomentFilm::new(&films.each_ref())?);
    }
    let held = memory("VmRSS")?;
    let start = Instant::now();
    let solved = solve(&moments.iter().collect::<Vec<_>>(), kind, None)?;
    let seconds = start.elapsed().as_secs_f64();
    let pixels = f64::from(count) * extent.pixels() as f64;
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{size}, {count} moments, {}, {motion}: {:.2} GB of moments ({:.0} bytes a pixel), at most {:.2} GB ({:.0}) while solving; {seconds:.1} s, {} iterations",
        kind.name(),
        held / 1e9,
        held / pixels,
        memory("VmHWM")? / 1e9,
        memory("VmHWM")? / pixels,
        solved.report.iterations,
    )?;
    Ok(())
}

/// Memory of this process [bytes].
fn memory(name: &str) -> Result<f64, Fault> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix(name)).ok_or("the system does not tell")?;
    let kilobytes = line.trim_matches(|c: char| !c.is_ascii_digit());
    Ok(kilobytes.parse::<f64>()? * 1024.0)
}

/// A number in [−½, ½).
fn noise(mut z: u64) -> f32 {
    z = (z ^ (z >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z ^= z >> 32;
    (z & 0xff_ffff) as f32 / (1 << 24) as f32 - 0.5
}

/// Noise with a picture in it, which moves by a column a moment.
fn film(extent: Extent, moment: u32, copy: u32, moves: bool) -> Film {
    let (w, h) = (extent.width, extent.height);
    let half = |key: u32, back: u32, own: u32| {
        let mut images = [0, 1, 2].map(|_| Image::new(extent, 3));
        for (plane, image) in images.iter_mut().enumerate() {
            for (y, x, c) in (0..h).flat_map(|y| (0..w).flat_map(move |x| (0..3).map(move |c| (y, x, c)))) {
                let place = u64::from(x.wrapping_sub(back)) | u64::from(y) << 16 | (plane as u64) << 50;
                // Half A shares most of its noise with half B of the moment before.
                let noise = 0.9 * noise(place | u64::from(2 * key + copy) << 32)
                    + 0.4 * noise(place | u64::from(4 * moment + 2 * copy + own) << 54);
                image.set(x, y, c, if plane == 0 { 0.5 + 0.4 * noise } else { 0.1 * noise });
            }
        }
        let [primal, dx, dy] = images;
        let (mut rgb, mut grey) = (Image::new(extent, 3), Image::new(extent, 1));
        rgb.data_mut().fill(0.0133);
        grey.data_mut().fill(0.0025);
        let gradients = Some(Gradients { dx, dy, dx_variance: grey.clone(), dy_variance: grey });
        HalfFilm { samples: 2, primal, primal_variance: rgb, direct: Image::new(extent, 3), gradients, graph: None }
    };
    let mut motion = Image::new(extent, 3);
    for (y, x) in (0..h).flat_map(|y| (1..w).map(move |x| (y, x))) {
        motion.set(x, y, 0, -1.0);
        motion.set(x, y, 2, 1.0);
    }
    let features = Features { albedo: Image::new(extent, 3), normal: Image::new(extent, 3), depth: Image::new(extent, 1) };
    let halves = [half(moment, u32::from(moves), 0), half(moment + 1, 0, 1)];
    Film { extent, halves, counts: None, motion: moves.then_some(motion), features, statistics: Statistics::default() }
}
