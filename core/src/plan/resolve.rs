//! From what a scene calls for and what was asked to one plan, with a reason for every choice.

use super::{Plan, ReconstructionKind, Request, ShiftKind, Technique, stop, switched, temporal};
use crate::effects::{Effect, Effects, analyse};
use crate::lattice::Extent;
use crate::scene::{SceneDescription, limits};

/// Most samples per pixel.
const MOST_SAMPLES: u32 = 1_000_000;
/// Least probability of a shift where nothing else was asked: no roulette.
const DEFAULT_SURVIVAL: f32 = 1.0;
/// Edge of the groups that reuse one another's paths where nothing else was asked [pixels].
const DEFAULT_REUSE_EDGE: u32 = 6;
/// Most links of a pixel where nothing else was asked.
const DEFAULT_LINKS: u32 = 4;

/// Why no plan can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A choice needs something that another choice does not give.
    #[error("{choice} needs {missing}: try {try_instead}")]
    Missing {
        /// The choice that cannot be had.
        choice: String,
        /// What it lacks.
        missing: String,
        /// What can be had instead.
        try_instead: String,
    },
    /// A number outside its domain.
    #[error("{what}: found {found}, expected {expected}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// The number.
        found: String,
        /// Its domain.
        expected: String,
    },
}

/// Makes the plan for a scene and a request.
///
/// # Errors
/// A reconstruction that needs gradients with a technique that measures none; sizes, samples, depth or α outside their domains.
pub fn resolve(scene: &SceneDescription, request: &Request) -> Result<Plan, PlanError> {
    let effects = analyse(scene);
    let mut reasons = Vec::new();
    let extent = extent(scene, request, &mut reasons)?;
    let max_depth = request.max_depth.unwrap_or(scene.integrator.max_depth);
    in_range("longest path", max_depth, limits::PATH_EDGES, "edges")?;
    let technique = technique(request, extent, max_depth, &effects, &mut reasons);
    let shift = shift(request, technique)?;
    if technique.measures_gradients() {
        reasons.push(shift_told(shift, &effects));
    }
    carried(technique, &effects, Technique::carries, &mut reasons)?;
    let (samples, told) = stop::samples(request.samples, &request.stop);
    in_range("samples per pixel", samples, MOST_SAMPLES, "samples")?;
    let timeline = temporal::timeline(request.timeline, scene.is_animated(), &mut reasons)?;
    let temporal = temporal::temporal(request, technique, samples, timeline.is_some(), &mut reasons)?;
    let reconstruction = reconstruction(request, technique, temporal.is_some(), &mut reasons)?;
    reasons.extend(switched::off(&effects));
    reasons.push(told);
    if samples == 1 {
        if reconstruction.needs_halves() {
            return Err(PlanError::Missing {
                choice: format!("reconstruction {}", reconstruction.name()),
                missing: "two halves, and one sample fills half A only".to_string(),
                try_instead: "two samples or more".to_string(),
            });
        }
        reasons.push("one sample fills half A only: no error can be estimated from two halves".to_string());
    }
    let survival = request.shift_survival.unwrap_or(DEFAULT_SURVIVAL);
    if !(survival > 0.0 && survival <= 1.0) {
        let expected = "a number above 0, at most 1".to_string();
        return Err(PlanError::OutOfRange { what: "survival of shifts", found: survival.to_string(), expected });
    }
    let reuse_edge = request.reuse_edge.unwrap_or(DEFAULT_REUSE_EDGE);
    in_range("edge of the groups that reuse paths", reuse_edge, limits::REUSE_EDGE, "pixels")?;
    if technique == Technique::Reuse {
        reasons.push(format!("groups of {reuse_edge} × {reuse_edge} pixels reuse their paths, and those of one column and row beyond"));
    }
    let links = request.links.unwrap_or(DEFAULT_LINKS);
    in_range("links of a pixel", links, limits::LINKS, "links")?;
    if technique == Technique::Graph {
        reasons.push(format!("differences to the {links} most similar pixels nearby, where the choice is mutual"));
    }
    let rounds = rounds(request, technique, samples, &mut reasons)?;
    stop::rule(&request.stop, rounds, &mut reasons)?;
    let alpha = alpha(request, reconstruction, &mut reasons)?;
    if request.clamp {
        reasons.push("negative values of the image become zero, which biases it: asked for".to_string());
    }
    Ok(Plan {
        extent,
        technique,
        reconstruction,
        samples,
        batch: temporal::batch(samples, temporal),
        seed: request.seed,
        alpha,
        clamp: request.clamp,
        max_depth,
        roulette_depth: scene.integrator.roulette_depth,
        shift,
        shift_threshold: shift.threshold(),
        shift_survival: survival,
        reuse_edge,
        links,
        rounds,
        stop: request.stop,
        timeline,
        temporal,
        reasons,
    })
}

fn alpha(request: &Request, reconstruction: ReconstructionKind, reasons: &mut Vec<String>) -> Result<Option<f32>, PlanError> {
    match request.alpha {
        Some(alpha) if !(alpha.is_finite() && alpha > 0.0) => {
            Err(PlanError::OutOfRange { what: "α", found: alpha.to_string(), expected: "a finite number > 0".to_string() })
        }
        None if reconstruction != ReconstructionKind::None => {
            reasons
                .push("no alpha is asked for: the reconstruction weighs the primal in its own way, most by the measured noise".to_string());
            Ok(None)
        }
        alpha => Ok(alpha),
    }
}

fn in_range(what: &'static str, found: u32, most: u32, unit: &str) -> Result<(), PlanError> {
    if (1..=most).contains(&found) {
        return Ok(());
    }
    Err(PlanError::OutOfRange { what, found: found.to_string(), expected: format!("1 to {most} {unit}") })
}

fn extent(scene: &SceneDescription, request: &Request, reasons: &mut Vec<String>) -> Result<Extent, PlanError> {
    let (width, height) = scene.film.rendered();
    let own = Extent { width, height };
    let extent = request.extent.unwrap_or(own);
    in_range("film width", extent.width, limits::FILM_SIDE, "pixels")?;
    in_range("film height", extent.height, limits::FILM_SIDE, "pixels")?;
    let pixels = u64::from(extent.width) * u64::from(extent.height);
    if pixels > limits::FILM_PIXELS {
        let expected = format!("at most {} pixels in all", limits::FILM_PIXELS);
        return Err(PlanError::OutOfRange { what: "film", found: format!("{} × {}", extent.width, extent.height), expected });
    }
    let whose = if request.extent.is_some() { "asked for" } else { "the scene's own" };
    reasons.push(format!("film of {} × {}: {whose}", extent.width, extent.height));
    Ok(extent)
}

fn technique(request: &Request, extent: Extent, max_depth: u32, effects: &Effects, reasons: &mut Vec<String>) -> Technique {
    let lights = [Effect::AreaLights, Effect::ConcentratedLights, Effect::EnvironmentLight];
    let lit = lights.into_iter().any(|light| effects.has(light));
    let (technique, why) = match request.technique {
        Some(technique) => (technique, "asked for".to_string()),
        None if extent.pixels() == 1 => (Technique::Pt, "a single pixel has no neighbour to measure a gradient to".to_string()),
        None if max_depth == 1 => (Technique::Pt, "paths of one edge show emitters only, which are exact without gradients".to_string()),
        None => {
            (Technique::Gpt, "neighbouring pixels see nearly the same light, so their differences are less noisy than they are".to_string())
        }
    };
    reasons.push(format!("technique {}: {why}", technique.name()));
    if !lit {
        reasons.push("nothing in the scene gives light: the image will be black".to_string());
    }
    if effects.has(Effect::Caustics) {
        let from = effects.told(Effect::Caustics);
        reasons.push(format!("caustics are possible ({from}) and converge slowly: paths find them from the camera's side only"));
    }
    technique
}

/// The shift that was asked for, or the technique's own.
fn shift(request: &Request, technique: Technique) -> Result<ShiftKind, PlanError> {
    let composes = technique == Technique::Reuse;
    let shift = request.shift.unwrap_or(if composes { ShiftKind::Composable } else { ShiftKind::Hybrid });
    if composes && !shift.composes() {
        return Err(PlanError::Missing {
            choice: format!("technique {}", technique.name()),
            missing: format!("shifts that compose, which those of shift {} do not", shift.name()),
            try_instead: format!("shift {}", ShiftKind::Composable.name()),
        });
    }
    Ok(shift)
}

/// How paths are shifted, and what calls for it.
fn shift_told(shift: ShiftKind, effects: &Effects) -> String {
    let told = match shift {
        ShiftKind::Hybrid | ShiftKind::Composable if effects.has(Effect::SpecularChains) || effects.has(Effect::NearSpecular) => {
            let kinds = [Effect::SpecularChains, Effect::NearSpecular, Effect::Refraction];
            let kinds: Vec<&str> = kinds.into_iter().filter(|kind| effects.has(*kind)).map(Effect::words).collect();
            format!("half-vector copy through what is smoother than {}, reconnection behind it: {}", shift.threshold(), kinds.join(", "))
        }
        ShiftKind::Hybrid | ShiftKind::Composable => "reconnection alone: every surface is diffuse".to_string(),
        ShiftKind::Reconnection => "reconnection at the first vertex: asked for".to_string(),
        ShiftKind::Replay => "random replay: asked for".to_string(),
        ShiftKind::ReplayReconnection => {
            format!("random replay until surfaces of roughness {} or more are far enough to join: asked for", shift.threshold())
        }
    };
    if effects.has(Effect::Media) {
        return format!("shift by {told}; inside media distances are copied until both paths can join, there without cosines");
    }
    format!("shift by {told}")
}

/// Refuses a technique that cannot carry an effect, if another one can; where none can, says what is lost.
fn carried(
    technique: Technique,
    effects: &Effects,
    carries: impl Fn(Technique, Effect) -> bool,
    reasons: &mut Vec<String>,
) -> Result<(), PlanError> {
    for (effect, _) in effects.iter().filter(|(effect, _)| !carries(technique, *effect)) {
        let because = effects.told(effect);
        if let Some(other) = Technique::ALL.into_iter().find(|other| carries(*other, effect)) {
            return Err(PlanError::Missing {
                choice: format!("technique {}", technique.name()),
                missing: format!("a way to simulate {effect} ({because})"),
                try_instead: format!("technique {}", other.name()),
            });
        }
        reasons.push(format!("{effect} are lost ({because}): no technique here finds that light; give the light some extent to see it"));
    }
    Ok(())
}

fn rounds(request: &Request, technique: Technique, samples: u32, reasons: &mut Vec<String>) -> Result<u32, PlanError> {
    let rounds = request.rounds.unwrap_or(1);
    in_range("rounds", rounds, limits::ROUNDS, "rounds")?;
    if rounds == 1 {
        return Ok(rounds);
    }
    if !technique.takes_rounds() {
        return Err(PlanError::Missing {
            choice: format!("placing samples in {rounds} rounds"),
            missing: format!("pixels that are measured each by itself, which technique {} does not do", technique.name()),
            try_instead: format!("technique {} or {}, or one round", Technique::Pt.name(), Technique::Gpt.name()),
        });
    }
    let steer = if technique.measures_gradients() { "primal and differences are" } else { "the primal is" };
    if request.stop.has_checks() {
        reasons.push(format!(
            "{rounds} rounds at most: asked for; as nobody knows where the frame ends they double, and after {} samples a part of them go \
             where {steer} noisiest for their brightness",
            Plan::FIRST_ROUND
        ));
        return Ok(rounds);
    }
    let most = samples / Plan::ROUND;
    if rounds > most {
        let expected = format!("1 to {} with {samples} samples per pixel, {} for each round", most.max(1), Plan::ROUND);
        return Err(PlanError::OutOfRange { what: "rounds", found: rounds.to_string(), expected });
    }
    reasons.push(format!(
        "{rounds} rounds: asked for; after the first one samples go where {steer} noisiest for their brightness, and {samples} is their mean"
    ));
    Ok(rounds)
}

fn reconstruction(
    request: &Request,
    technique: Technique,
    together: bool,
    reasons: &mut Vec<String>,
) -> Result<ReconstructionKind, PlanError> {
    let (kind, why) = match request.reconstruction.filter(|kind| !(together && *kind == ReconstructionKind::Auto)) {
        Some(kind) if !technique.takes(kind) => {
            let what = if kind == ReconstructionKind::Graph { "differences along links" } else { "gradients" };
            let other = if kind == ReconstructionKind::Graph { Technique::Graph } else { Technique::Gpt };
            let own = ReconstructionKind::ALL.into_iter().rev().filter(|own| technique.takes(*own) && *own != ReconstructionKind::Auto);
            return Err(PlanError::Missing {
                choice: format!("reconstruction {}", kind.name()),
                missing: format!("{what}, which technique {} does not measure", technique.name()),
                try_instead: format!(
                    "technique {}, or reconstruction {}",
                    other.name(),
                    own.map(ReconstructionKind::name).collect::<Vec<_>>().join(" or ")
                ),
            });
        }
        Some(kind) => (kind, "asked for"),
        None => match technique {
            Technique::Pt => (ReconstructionKind::None, "there are no gradients to reconstruct from"),
            _ if together => (ReconstructionKind::L2, "unbiased, and exact over whole windows"),
            Technique::Gpt | Technique::Reuse => {
                (ReconstructionKind::Auto, "each frame takes the one that its two halves tell the least error of")
            }
            Technique::Graph => (ReconstructionKind::Graph, "unbiased, and made for differences along links"),
        },
    };
    reasons.push(format!("reconstruction {}: {why}", kind.name()));
    Ok(kind)
}

#[cfg(test)]
mod tests;
