//! The table of truth: every scene with a reference image by another renderer, rendered here and compared. `just truth` runs it.
//!
//! Arguments: names of scenes, without which all are compared, and `--effort N`, which renders N times as many samples. The process fails
//! where a difference is more than chance.

use std::io::Write;
use std::process::ExitCode;

use gradfarm_core::plan::{ReconstructionKind, Technique};
use gradfarm_tests::statistics::sidak;
use gradfarm_tests::truth::{Effort, Row, measure, names, scenes};

/// Correct code fails the whole table with this probability.
const LEVEL: f64 = 1e-2;
/// Independent renders of each scene, and samples per pixel of each.
const EFFORT: Effort = Effort { seeds: 16, samples: 16 };

fn main() -> ExitCode {
    let (mut wanted, mut effort, mut arguments) = (Vec::new(), EFFORT, std::env::args().skip(1));
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--effort" => match arguments.next().and_then(|number| number.parse::<u32>().ok()) {
                Some(number) if (1..=1_000).contains(&number) => effort.samples *= number,
                _ => return say("--effort wants a number from 1 to 1000"),
            },
            _ => wanted.push(argument),
        }
    }
    let Some(folder) = scenes() else { return say("there is no ../shared/scenes beside the workspace: nothing to compare with") };
    let known = names(&folder);
    if let Some(unknown) = wanted.iter().find(|name| !known.contains(name)) {
        return say(&format!("no scene {unknown}; there are {}", known.join(", ")));
    }
    let chosen: Vec<&String> = known.iter().filter(|name| wanted.is_empty() || wanted.contains(name)).collect();
    // A mean and its blocks, before reconstruction and after it.
    let level = sidak(LEVEL, 4 * chosen.len());
    match table(&folder, &chosen, effort, level) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(differences) => say(&format!("{differences} comparisons show more than chance")),
        Err(fault) => say(&fault.to_string()),
    }
}

fn table(folder: &std::path::Path, chosen: &[&String], effort: Effort, level: f64) -> std::io::Result<usize> {
    let mut out = std::io::stdout().lock();
    let spp = u64::from(effort.samples) * effort.seeds;
    writeln!(out, "{spp} samples per pixel; blocks of 8 × 8 pixels; z: difference over its standard error\n")?;
    writeln!(
        out,
        "| scene | by | ours | reference | ratio | z of mean | worst block z | mean z | rms z | error of blocks (expected) | time | |"
    )?;
    writeln!(out, "|---|---|---|---|---|---|---|---|---|---|---|---|")?;
    let mut differences = 0;
    let mut beyond = Vec::new();
    for name in chosen {
        // The gradient technique's image before reconstruction is that of path tracing, bit for bit.
        match measure(&folder.join(name), "scene.xml", Technique::Gpt, effort) {
            Ok(rows) => {
                for row in rows {
                    differences += usize::from(row.agrees(level).is_err());
                    line(&mut out, name, &row, level)?;
                    out.flush()?;
                }
            }
            Err(reason) => beyond.push(format!("- {name}: {reason}")),
        }
    }
    if !beyond.is_empty() {
        writeln!(out, "\nOut of reach:\n\n{}", beyond.join("\n"))?;
    }
    Ok(differences)
}

fn line(out: &mut impl Write, name: &str, row: &Row, level: f64) -> std::io::Result<()> {
    let (verdict, blocks) = (row.agrees(level).err().unwrap_or("agrees".to_string()), &row.blocks);
    writeln!(
        out,
        "| {name} | {} | {:.5} | {:.5} | {:.4} | {:.2} | {:.2} | {:.3} | {:.3} | {:.2} % ({:.2} %) | {:.0} s | {verdict} |",
        if row.reconstruction == ReconstructionKind::None { "paths" } else { "gradients" },
        row.ours,
        row.theirs,
        row.ours / row.theirs,
        row.t,
        blocks.worst,
        blocks.mean,
        blocks.mean_square.sqrt(),
        100.0 * row.error,
        100.0 * row.expected_error,
        row.seconds,
    )
}

fn say(fault: &str) -> ExitCode {
    eprintln!("{fault}");
    ExitCode::FAILURE
}
