//! What the hazards are held against: closed forms, an easier twin of the scene, and the laws that no scene may break.

use gradfarm_core::film::{Film, Image};
use gradfarm_core::lattice::Extent;
use gradfarm_core::plan::{ReconstructionKind, Request, ShiftKind, Technique};
use gradfarm_core::reconstruction::reconstruct;
use gradfarm_core::scene::{Scene, SceneDescription};
use gradfarm_tests::frame::render;
use gradfarm_tests::scenes::{compile, plan};
use gradfarm_tests::statistics::{Comparison, Estimate, student_tail};

/// Correct code fails each of about three hundred comparisons with this probability, so all together with about 10⁻³.
pub(crate) const LEVEL: f64 = 3e-6;

/// How much is rendered.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    pub(crate) extent: Extent,
    pub(crate) samples: u32,
    pub(crate) seeds: u64,
    pub(crate) depth: u32,
    /// The shift of techniques that shift, or their own.
    pub(crate) shift: Option<ShiftKind>,
}

pub(crate) const EFFORT: Effort = Effort { extent: Extent { width: 5, height: 4 }, samples: 64, seeds: 12, depth: 6, shift: None };

/// A scene from its parts; all but the camera may be empty.
pub(crate) fn scene(camera: &str, materials: &str, shapes: &str, rest: &str) -> String {
    format!(r#"{{ "version": 1, "camera": {camera}, "materials": {{ {materials} }}, "shapes": [{shapes}] {rest} }}"#)
}

/// A pinhole camera.
pub(crate) fn looks(origin: [f64; 3], target: [f64; 3], fov: f64) -> String {
    format!(
        r#"{{ "perspective": {{ "to_world": [{{ "look_at": {{ "origin": {origin:?}, "target": {target:?} }} }}], "fov": {fov}, "fov_axis": "smaller" }} }}"#
    )
}

pub(crate) fn parse(name: &str, text: &str) -> (SceneDescription, Scene) {
    compile(text, name).unwrap_or_else(|fault| panic!("{name}: {fault}"))
}

/// One film for each seed.
pub(crate) fn films(name: &str, text: &str, technique: Technique, effort: Effort, first: u64) -> Vec<Film> {
    let (description, scene) = parse(name, text);
    (first..first + effort.seeds)
        .map(|seed| {
            let request = Request {
                technique: Some(technique),
                samples: Some(effort.samples),
                extent: Some(effort.extent),
                max_depth: Some(effort.depth),
                reuse_edge: Some(3),
                shift: effort.shift.filter(|_| technique != Technique::Pt),
                seed,
                ..Request::default()
            };
            let film = render(&scene, &plan(&description, &request)).unwrap();
            sound(&format!("{name}, {}, seed {seed}", technique.name()), &film);
            film
        })
        .collect()
}

/// What must hold for every film: nothing was ever not finite, and least squares keep the sum of the primal to rounding.
pub(crate) fn sound(name: &str, film: &Film) {
    assert_eq!(film.statistics.not_finite(), 0, "{name}: values that are not finite");
    let all = film.combined();
    for (plane, image) in [("primal", &all.primal), ("variance", &all.primal_variance), ("direct", &all.direct)] {
        assert!(image.data().iter().all(|v| v.is_finite()), "{name}: {plane}");
    }
    let kind = match (&all.gradients, &all.graph) {
        (Some(_), _) => ReconstructionKind::L2,
        (_, Some(_)) => ReconstructionKind::Graph,
        _ => return,
    };
    let reconstructed = reconstruct(film, kind, 0.2).unwrap();
    let sum = |image: &Image| image.data().iter().map(|v| f64::from(*v)).sum::<f64>();
    let size = |image: &Image| image.data().iter().map(|v| f64::from(v.abs())).sum::<f64>();
    let (kept, expected) = (sum(&reconstructed.image), sum(&reconstructed.primal));
    // Where neighbours cancel, rounding is relative to what cancelled.
    let allowed = 1e-5 * (size(&reconstructed.primal) + size(&reconstructed.image));
    assert!((kept - expected).abs() <= allowed, "{name}: {} sums to {kept}, the primal to {expected}", kind.name());
}

/// What the camera sees, without reconstruction.
pub(crate) fn seen(film: &Film) -> Vec<f64> {
    let all = film.combined();
    all.primal.data().iter().zip(all.direct.data()).map(|(p, d)| f64::from(*p) + f64::from(*d)).collect()
}

fn estimates(runs: &[Vec<f64>]) -> Vec<Estimate> {
    (0..runs[0].len()).map(|k| Estimate::of(&runs.iter().map(|run| run[k]).collect::<Vec<_>>())).collect()
}

fn whole(runs: &[Vec<f64>]) -> Estimate {
    Estimate::of(&runs.iter().map(|run| run.iter().sum::<f64>() / run.len() as f64).collect::<Vec<_>>())
}

/// Holds every value, and their mean, against what is expected.
fn agree(name: &str, measured: &[Vec<f64>], expected: &[Estimate], mean: Estimate) {
    let all = whole(measured);
    let compared = Comparison::of(estimates(measured).into_iter().zip(expected.iter().copied()));
    eprintln!("{name}: mean {:.6e} of {:.6e}; worst |t| {:.2} of {}", all.mean, mean.mean, compared.worst, compared.pairs);
    assert!(compared.agrees(LEVEL), "{name}: value {} has a chance of {:e}", compared.place, compared.chance);
    let t = all.t(&mean);
    assert!(t.is_none_or(|(t, freedom)| student_tail(t, freedom) > LEVEL), "{name}: mean {} of {}, t {t:?}", all.mean, mean.mean);
}

/// Every pixel has this radiance, within this relative error besides noise, by every technique.
pub(crate) fn shows(name: &str, text: &str, expected: f64, error: f64, effort: Effort) {
    for technique in Technique::ALL {
        let measured: Vec<_> = films(name, text, technique, effort, 0).iter().map(seen).collect();
        let known = Estimate::known(expected, error * expected);
        let named = format!("{name}, {}", technique.name());
        agree(&named, &measured, &vec![known; measured[0].len()], known);
        // Chance explains much where noise is large: it must not be.
        let noise = whole(&measured).variance.sqrt();
        assert!(noise <= 0.1 * expected, "{named}: noise of {noise} hides everything");
    }
}

/// Both scenes look alike, the second one times a factor, by every technique.
pub(crate) fn same(name: &str, hard: &str, easy: &str, factor: f64, effort: Effort) {
    let twin: Vec<Vec<f64>> = films(name, easy, Technique::Pt, Effort { samples: 4 * effort.samples, ..effort }, 1000)
        .iter()
        .map(|film| seen(film).into_iter().map(|v| v * factor).collect())
        .collect();
    for technique in Technique::ALL {
        let measured: Vec<_> = films(name, hard, technique, effort, 0).iter().map(seen).collect();
        agree(&format!("{name}, {}", technique.name()), &measured, &estimates(&twin), whole(&twin));
        assert!(whole(&twin).mean > 0.0, "{name}: the twin is black");
    }
}

fn differences(extent: Extent, columns: impl Fn(u32, u32, usize) -> f32, rows: impl Fn(u32, u32, usize) -> f32) -> Vec<f64> {
    let mut found = Vec::new();
    for (c, y, x) in (0..3).flat_map(|c| (0..extent.height).flat_map(move |y| (0..extent.width).map(move |x| (c, y, x)))) {
        if x + 1 < extent.width {
            found.push(f64::from(columns(x, y, c)));
        }
        if y + 1 < extent.height {
            found.push(f64::from(rows(x, y, c)));
        }
    }
    found
}

/// The measured differences to the next column and row.
pub(crate) fn gradients(film: &Film) -> Option<Vec<f64>> {
    let gradients = film.combined().gradients?;
    Some(differences(film.extent, |x, y, c| gradients.dx.at(x, y, c), |x, y, c| gradients.dy.at(x, y, c)))
}

/// Gradients of every technique that measures them are differences of pixels.
pub(crate) fn gradients_hold(name: &str, text: &str, effort: Effort) {
    let plain = films(name, text, Technique::Pt, Effort { samples: 2 * effort.samples, ..effort }, 1000);
    let primals: Vec<_> = plain
        .iter()
        .map(|film| {
            let image = film.combined().primal;
            differences(
                film.extent,
                |x, y, c| image.at(x + 1, y, c) - image.at(x, y, c),
                |x, y, c| image.at(x, y + 1, c) - image.at(x, y, c),
            )
        })
        .collect();
    // A shift that was asked for goes with the techniques that take it.
    let takes =
        |technique| effort.shift.is_none_or(|shift| technique == Technique::Gpt || (technique == Technique::Reuse && shift.composes()));
    for technique in Technique::ALL.into_iter().filter(|technique| technique.takes(ReconstructionKind::L2) && takes(*technique)) {
        let measured: Option<Vec<_>> = films(name, text, technique, effort, 0).iter().map(gradients).collect();
        let measured = measured.unwrap();
        agree(&format!("gradients of {name}, {}", technique.name()), &measured, &estimates(&primals), whole(&primals));
    }
}
