//! What is resolved from scenes and requests, and what is refused.

use super::*;
use crate::accuracy::Stop;
use crate::film::PlaneKind;
use crate::plan::{Temporal, Timeline};

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

/// The same, and it turns darker.
fn moving() -> SceneDescription {
    let track = r#"{ "target": "shapes[0].emission.radiance", "times": [0, 1], "values": [1, 0.5] }"#;
    let emission = r#"{ "geometry": "cube", "material": "white", "emission": { "radiance": 1 } }"#;
    scene(emission, &format!(r#", "animation": {{ "tracks": [{track}] }}"#))
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
        frames: 3,
        timeline: Some(Timeline { fps: 25.0, ..Timeline::default() }),
        temporal: Some(true),
        window: Some(2),
        stride: Some(1),
        motion: Some(false),
    };
    let plan = resolve(&moving(), &request).unwrap();
    assert_eq!((plan.technique, plan.reconstruction), (Technique::Gpt, ReconstructionKind::L1));
    assert_eq!((plan.samples, plan.alpha, plan.seed, plan.max_depth), (1_000_000, Some(1.5), 9, 2));
    assert_eq!((plan.shift_survival, plan.reuse_edge, plan.links), (0.5, 3, 4));
    assert_eq!(plan.temporal, Some(Temporal { window: 2, stride: 1, motion: false }));
    assert!(plan.timeline.is_some_and(|timeline| timeline.fps == 25.0));
    assert_eq!(plan.extent, Extent { width: 7, height: 5 });
    assert!(says(&plan, "technique gpt: asked for"));
    // A scene that rests has no time, whatever is asked.
    let still = resolve(&lit(), &Request { temporal: None, ..request }).unwrap();
    assert_eq!((still.timeline, still.temporal), (None, None));
}

#[test]
fn without_gradients_there_is_nothing_to_reconstruct() {
    let pt = Request { technique: Some(Technique::Pt), ..Request::default() };
    assert_eq!(resolve(&lit(), &pt).unwrap().reconstruction, ReconstructionKind::None);
    for kind in [ReconstructionKind::L1, ReconstructionKind::L2] {
        let error = resolve(&lit(), &Request { reconstruction: Some(kind), ..pt.clone() }).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(kind.name()) && message.contains("needs gradients") && message.contains("try technique gpt"), "{message}");
    }
    let none = Request { technique: Some(Technique::Gpt), reconstruction: Some(ReconstructionKind::None), ..Request::default() };
    assert_eq!(resolve(&lit(), &none).unwrap().reconstruction, ReconstructionKind::None);
}

#[test]
fn links_have_a_reconstruction_of_their_own() {
    let ask = |technique, reconstruction| resolve(&lit(), &Request { technique: Some(technique), reconstruction, ..Request::default() });
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
