//! Whether frames stop near the error that was asked for: the same frame with many seeds, each until it stops, then compared with the others.
//!
//! Arguments: a scene, the relMSE to reach, the number of seeds, and the size such as `160x120` unless it is the scene's. The images of the
//! other seeds stand for the truth, so what is found is too large by one over their number.

use std::io::Write;
use std::process::ExitCode;

use gradfarm_core::accuracy::Stop;
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{Request, resolve};
use gradfarm_core::scene::{Scene, load};
use gradfarm_tests::stopping::outcomes;

type Fault = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    match measure(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}; expected SCENE RELMSE SEEDS [WxH]");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &[String]) -> Result<(), Fault> {
    let [scene, target, seeds, more @ ..] = arguments else { return Err("too few arguments".into()) };
    let (target, seeds): (f64, u64) = (target.parse()?, seeds.parse()?);
    let size = |text: &String| -> Result<Extent, Fault> {
        let (width, height) = text.split_once('x').ok_or("a size without an x")?;
        Ok(Extent { width: width.parse()?, height: height.parse()? })
    };
    let extent = more.first().map(size).transpose()?;
    let loaded = load(std::path::Path::new(scene))?;
    let compiled = Scene::compile(&loaded.description, &loaded.assets)?;
    let stop = Stop { error: Some(target), ..Stop::default() };
    let plan = resolve(&loaded.description, &Request { extent, stop, ..Request::default() })?;
    let all = outcomes(&compiled, &plan, 1000, seeds.max(3)).map_err(|fault| format!("{fault:?}"))?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "| seed | samples | estimated relMSE | interval | found | found / target |\n|--:|--:|--:|--:|--:|--:|")?;
    for (seed, outcome) in (1000..).zip(&all) {
        let (told, ratio) = (outcome.told, outcome.found / target);
        let interval = format!("{:.2e} to {:.2e}", told.low, told.high);
        writeln!(out, "| {seed} | {} | {:.2e} | {interval} | {:.2e} | {ratio:.2} |", outcome.samples, told.relmse, outcome.found)?;
    }
    let near = all.iter().filter(|outcome| outcome.found < Stop::SURE * target).count();
    let mean = |of: &dyn Fn(usize) -> f64| (0..all.len()).map(of).sum::<f64>() / all.len() as f64;
    let (samples, ratio) = (mean(&|i| f64::from(all[i].samples)), mean(&|i| all[i].found / target));
    writeln!(out, "\n{near} of {} below {} × target; {samples:.0} samples and {ratio:.2} × target on average", all.len(), Stop::SURE)?;
    Ok(())
}
