//! Laws of every shift through the public contract, on the scenes that people render: instances, meshes, shading normals.
//!
//! The core tests the same laws, and Jacobians besides, on scenes built in code. Here the question is whether real geometry
//! breaks them: a shift that cannot be undone would leave the weights of both directions short of 1.
//!
//! `just laws` counts over a hundred times as many paths.

#![allow(clippy::unwrap_used)]

use gradfarm_core::lattice::Extent;
use gradfarm_core::scene::{Scene, load};
use gradfarm_core::shift::ShiftKind;
use gradfarm_tests::laws::{Effort, both, count};
use gradfarm_tests::scenes::still_lifes;

const EXTENT: Extent = Extent { width: 40, height: 30 };
/// Base paths a pixel, for each threshold: about ten thousand a scene.
const SAMPLES: u32 = 4;

fn check(name: &str, scene: &Scene) {
    let effort = |threshold| Effort { extent: EXTENT, samples: SAMPLES, threshold, seed: 23 };
    let tallies = both(count(scene, &effort(0.001)), count(scene, &effort(0.3)));
    for (kind, sum) in ShiftKind::ALL.into_iter().zip(tallies) {
        let what = format!("{name}, {}", kind.name());
        eprintln!("{what}: {sum:?}");
        assert!(sum.there * 5 > sum.shifts, "{what}: only {} of {} shifts succeed", sum.there, sum.shifts);
        // Rounding may lose a few, at silhouettes that base and offset see just on either side and on long glossy chains; a broken
        // rule loses them by the hundred.
        assert!(sum.broken() <= 1e-4, "{what}: {sum:?}");
    }
}

#[test]
fn every_shift_can_be_undone_in_small_rooms() {
    for life in still_lifes().unwrap() {
        check(life.name, &life.scene);
    }
}

#[test]
fn every_shift_can_be_undone_in_the_scenes_that_people_render() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    files.sort();
    assert!(!files.is_empty());
    for path in files {
        let loaded = load(&path).unwrap();
        let scene = Scene::compile(&loaded.description, &loaded.assets).unwrap();
        check(&path.file_stem().unwrap().to_string_lossy(), &scene);
    }
}
