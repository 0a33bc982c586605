//! From what a scene calls for and what was asked to one plan, with a reason for every choice.

use super::{Plan, ReconstructionKind, Request, ShiftKind, Technique, stop, switched};
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
    let reconstruction = reconstruction(request, technique, &mut reasons)?;
    reasons.extend(switched::off(&effects));
    let (samples, told) = stop::samples(request.samples, &request.stop);
    in_range("samples per pixel", samples, MOST_SAMPLES, "samples")?;
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
        batch: Plan::BATCH,
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
    let most = samples / Plan::ROUND;
    if rounds > most {
        let expected = format!("1 to {} with {samples} samples per pixel, {} for each round", most.max(1), Plan::ROUND);
        return Err(PlanError::OutOfRange { what: "rounds", found: rounds.to_string(), expected });
    }
    let steer = if technique.measures_gradients() { "primal and differences are" } else { "the primal is" };
    reasons.push(format!(
        "{rounds} rounds: asked for; after the first one samples go where {steer} noisiest for their brightness, and {samples} is their mean"
    ));
    Ok(rounds)
}

fn reconstruction(request: &Request, technique: Technique, reasons: &mut Vec<String>) -> Result<ReconstructionKind, PlanError> {
    let (kind, why) = match request.reconstruction {
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
mod tests {
    use super::*;
    use crate::accuracy::Stop;
    use crate::film::PlaneKind;

    fn scene(shapes: &str, rest: &str) -> SceneDescription {
        let text = format!(
            r#"{{ "version": 1, "camera": {{ "perspective": {{ "fov": 40 }} }}, "film": {{ "width": 32, "height": 24 }},
                "materials": {{ "white": {{ "diffuse": {{ "reflectance": 0.5 }} }}, "glass": {{ "dielectric": {{}} }} }},
                "shapes": [{shapes}] {rest} }}"#
        );
        SceneDescription::from_json(&text, "test.json").unwrap()
    }

    fn lit() -> SceneDescription {
        scene(r#"{ "geometry": "cube", "material": "white", "emission": { "radiance": 1 } }"#, "")
    }

    fn says(plan: &Plan, part: &str) -> bool {
        plan.reasons.iter().any(|reason| reason.contains(part))
    }

    #[test]
    fn one_sample_is_no_two_halves() {
        let asked = |kind, samples| Request { reconstruction: Some(kind), samples: Some(samples), ..Request::default() };
        let fault = resolve(&scene("", ""), &asked(ReconstructionKind::Nfor, 1)).unwrap_err().to_string();
        assert!(fault.contains("reconstruction nfor needs two halves") && fault.contains("two samples or more"), "{fault}");
        assert!(resolve(&scene("", ""), &asked(ReconstructionKind::Nfor, 2)).is_ok());
        assert!(resolve(&scene("", ""), &asked(ReconstructionKind::L2, 1)).is_ok());
    }

    #[test]
    fn left_alone_it_measures_gradients_and_lets_the_frame_choose() {
        let plan = resolve(&lit(), &Request::default()).unwrap();
        assert_eq!((plan.technique, plan.reconstruction), (Technique::Gpt, ReconstructionKind::Auto));
        assert!(says(&plan, "reconstruction auto: each frame takes"));
        assert_eq!((plan.samples, plan.batch, plan.alpha, plan.seed), (64, Plan::BATCH, None, 0));
        assert_eq!((plan.max_depth, plan.roulette_depth), (16, 5));
        assert_eq!(plan.extent, Extent { width: 32, height: 24 });
        assert!(says(&plan, "technique gpt: neighbouring") && says(&plan, "reconnection alone"));
    }

    #[test]
    fn what_was_asked_is_done() {
        let request = Request {
            technique: Some(Technique::Gpt),
            reconstruction: Some(ReconstructionKind::L1),
            samples: Some(1_000_000),
            extent: Some(Extent { width: 7, height: 5 }),
            seed: 9,
            alpha: Some(1.5),
            clamp: true,
            max_depth: Some(2),
            shift: Some(ShiftKind::Hybrid),
            shift_survival: Some(0.5),
            reuse_edge: Some(3),
            links: Some(4),
            rounds: Some(1),
            stop: Stop::default(),
        };
        let plan = resolve(&lit(), &request).unwrap();
        assert_eq!((plan.technique, plan.reconstruction), (Technique::Gpt, ReconstructionKind::L1));
        assert_eq!((plan.samples, plan.alpha, plan.seed, plan.max_depth), (1_000_000, Some(1.5), 9, 2));
        assert_eq!((plan.shift_survival, plan.reuse_edge, plan.links), (0.5, 3, 4));
        assert_eq!(plan.extent, Extent { width: 7, height: 5 });
        assert!(says(&plan, "technique gpt: asked for"));
    }

    #[test]
    fn without_gradients_there_is_nothing_to_reconstruct() {
        let pt = Request { technique: Some(Technique::Pt), ..Request::default() };
        assert_eq!(resolve(&lit(), &pt).unwrap().reconstruction, ReconstructionKind::None);
        for kind in [ReconstructionKind::L1, ReconstructionKind::L2] {
            let error = resolve(&lit(), &Request { reconstruction: Some(kind), ..pt.clone() }).unwrap_err();
            let message = error.to_string();
            assert!(
                message.contains(kind.name()) && message.contains("needs gradients") && message.contains("try technique gpt"),
                "{message}"
            );
        }
        let none = Request { technique: Some(Technique::Gpt), reconstruction: Some(ReconstructionKind::None), ..Request::default() };
        assert_eq!(resolve(&lit(), &none).unwrap().reconstruction, ReconstructionKind::None);
    }

    #[test]
    fn links_have_a_reconstruction_of_their_own() {
        let ask =
            |technique, reconstruction| resolve(&lit(), &Request { technique: Some(technique), reconstruction, ..Request::default() });
        let plan = ask(Technique::Graph, None).unwrap();
        assert_eq!((plan.reconstruction, plan.links, plan.alpha), (ReconstructionKind::Graph, 4, None));
        assert_eq!(plan.layout().len(), PlaneKind::layout(false).len() + 4 + 2 * 2 * 4);
        let refused = |technique, reconstruction| ask(technique, Some(reconstruction)).unwrap_err().to_string();
        let l2 = refused(Technique::Graph, ReconstructionKind::L2);
        assert!(l2.contains("technique graph does not measure: try technique gpt, or reconstruction graph or none"), "{l2}");
        for technique in [Technique::Pt, Technique::Gpt, Technique::Reuse] {
            let graph = refused(technique, ReconstructionKind::Graph);
            assert!(graph.contains("needs differences along links") && graph.contains("try technique graph"), "{graph}");
        }
        assert!(ask(Technique::Graph, Some(ReconstructionKind::None)).is_ok());
    }

    #[test]
    fn where_no_gradient_can_help_none_is_measured() {
        let one = Request { extent: Some(Extent { width: 1, height: 1 }), ..Request::default() };
        assert_eq!(resolve(&lit(), &one).unwrap().technique, Technique::Pt);
        let flat = Request { max_depth: Some(1), ..Request::default() };
        assert_eq!(resolve(&lit(), &flat).unwrap().technique, Technique::Pt);
    }

    #[test]
    fn the_scene_is_told_in_the_reasons() {
        let glass = scene(
            r#"{ "geometry": "cube", "material": "glass" }, { "geometry": "rectangle", "material": "white" }"#,
            r#", "environment": { "radiance": 1 }"#,
        );
        let plan = resolve(&glass, &Request::default()).unwrap();
        assert!(says(&plan, "half-vector copy") && says(&plan, "caustics are possible (materials.glass on shapes[0])"));
        let dark = resolve(&scene("", ""), &Request::default()).unwrap();
        assert!(says(&dark, "nothing in the scene gives light"));
        let single = resolve(&lit(), &Request { samples: Some(1), ..Request::default() }).unwrap();
        assert!(says(&single, "half A only"));
    }

    #[test]
    fn a_technique_that_cannot_carry_an_effect_is_refused_with_one_that_can() {
        let glass = scene(r#"{ "geometry": "cube", "material": "glass" }"#, "");
        let effects = analyse(&glass);
        let mut reasons = Vec::new();
        let only_gpt = |technique, effect| technique == Technique::Gpt || effect != Effect::Refraction;
        let error = carried(Technique::Pt, &effects, only_gpt, &mut reasons).unwrap_err().to_string();
        for part in ["technique pt needs", "refraction", "materials.glass", "shapes[0]", "try technique gpt"] {
            assert!(error.contains(part), "{error}");
        }
        carried(Technique::Gpt, &effects, only_gpt, &mut reasons).unwrap();
        assert!(reasons.is_empty());
    }

    #[test]
    fn paths_are_reused_by_shifts_that_compose() {
        let reuse = Request { technique: Some(Technique::Reuse), ..Request::default() };
        let plan = resolve(&lit(), &reuse).unwrap();
        assert_eq!((plan.shift, plan.reconstruction, plan.grain()), (ShiftKind::Composable, ReconstructionKind::Auto, plan.reuse_edge));
        assert!(says(&plan, "reuse their paths"));
        let error = resolve(&lit(), &Request { shift: Some(ShiftKind::Hybrid), ..reuse.clone() }).unwrap_err().to_string();
        assert!(error.contains("shifts that compose") && error.contains("try shift composable"), "{error}");
        assert_eq!(resolve(&lit(), &Request::default()).unwrap().grain(), 1);
    }

    #[test]
    fn light_that_nothing_finds_is_named() {
        let point = r#", "lights": [{ "point": { "position": [0, 3, 0], "intensity": 9 } }]"#;
        let both = scene(r#"{ "geometry": "cube", "material": "glass" }, { "geometry": "rectangle", "material": "white" }"#, point);
        let plan = resolve(&both, &Request::default()).unwrap();
        assert!(says(&plan, "caustics of lights without extent are lost (materials.glass on shapes[0] under lights[0] (point))"));
        assert!(!says(&plan, "the image will be black"));
    }

    #[test]
    fn what_is_switched_off_is_told() {
        let plan = resolve(&lit(), &Request::default()).unwrap();
        assert!(says(&plan, "off: media and holes") && says(&plan, "off: textures"));
        let fog = r#", "media": { "fog": { "homogeneous": { "extinction": 1, "albedo": 1 } } }, "medium": "fog""#;
        let plan = resolve(&scene("", fog), &Request::default()).unwrap();
        assert!(!says(&plan, "off: media and holes") && says(&plan, "off: textures"));
    }

    #[test]
    fn numbers_outside_their_domains_are_refused() {
        let ask = |request: Request| resolve(&lit(), &request).unwrap_err().to_string();
        let base = Request::default;
        assert!(ask(Request { samples: Some(0), ..base() }).contains("samples per pixel: found 0, expected 1 to 1000000"));
        assert!(ask(Request { samples: Some(1_000_001), ..base() }).contains("1000001"));
        for alpha in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(ask(Request { alpha: Some(alpha), ..base() }).starts_with("α: found"), "{alpha}");
        }
        assert!(ask(Request { max_depth: Some(0), ..base() }).contains("longest path"));
        assert!(ask(Request { extent: Some(Extent { width: 0, height: 4 }), ..base() }).contains("film width: found 0"));
        assert!(ask(Request { extent: Some(Extent { width: 9, height: 70_000 }), ..base() }).contains("film height: found 70000"));
        assert!(ask(Request { extent: Some(Extent { width: 60_000, height: 60_000 }), ..base() }).contains("60000 × 60000"));
        assert!(ask(Request { rounds: Some(0), ..base() }).contains("rounds: found 0"));
        let many = Request { rounds: Some(9), samples: Some(64), ..base() };
        assert_eq!(ask(many), "rounds: found 9, expected 1 to 8 with 64 samples per pixel, 8 for each round");
    }

    #[test]
    fn rounds_are_told() {
        let plan = resolve(&lit(), &Request { rounds: Some(4), ..Request::default() }).unwrap();
        assert_eq!(plan.rounds, 4);
        assert!(says(&plan, "4 rounds: asked for; after the first one samples go where primal and differences are noisiest"));
        let plan = resolve(&lit(), &Request::default()).unwrap();
        assert_eq!(plan.rounds, 1);
        assert!(!says(&plan, "rounds"));
    }
}
