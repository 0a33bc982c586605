//! Tests of stages: what moves is where a scene compiled anew has it, what rests is shared, numbers stay the same.

use std::sync::Arc;

use super::*;
use crate::math::{Ray, Vec3};
use crate::scene::{Assets, ErrorKind, NoAssets};

const SCENE: &str = r#"{
  "version": 1,
  "camera": {"perspective": {"to_world": [{"look_at": {"origin": [0, 1, 6], "target": [0, 1, 0]}}], "fov": 40}},
  "film": {"width": 8, "height": 6},
  "materials": {"wall": {"diffuse": {"reflectance": 0.5}}, "mirror": {"rough_diffuse": {"reflectance": 0.9, "roughness": 0.2}}},
  "groups": {"pair": [{"geometry": "cube", "material": "wall", "to_world": [{"scale": [0.2, 0.2, 0.2]}]},
      {"geometry": {"sphere": {"radius": 0.2, "center": [0.6, 0, 0]}}, "material": "mirror"}],
    "pumping": [{"geometry": {"sphere": {"radius": 0.3}}, "material": "wall"}]},
  "shapes": [
    {"geometry": "rectangle", "material": "wall", "to_world": [{"scale": [4, 4, 4]}, {"translate": [0, 0, -2]}]},
    {"geometry": "cube", "material": "wall", "to_world": [{"scale": [0.5, 0.3, 0.2]}, {"rotate": {"axis": [0, 1, 0], "degrees": 0}}]},
    {"geometry": {"sphere": {"radius": 0.4}}, "material": "mirror", "to_world": [{"translate": [-1, 0, 0]}]},
    {"geometry": "rectangle", "material": "wall", "emission": {"radiance": 5}, "to_world": [{"translate": [0, 2, -1]}]},
    {"geometry": {"instance": {"of": "pair"}}, "to_world": [{"translate": [1.5, 1, 0]}]},
    {"geometry": {"instance": {"of": "pumping"}}, "to_world": [{"translate": [-1.5, 1.8, 0]}]},
    {"geometry": {"mesh": {"positions": [[1, 0, 0], [2, 0, 0], [1, 1, 0]], "indices": [[0, 1, 2]],
      "morph": {"weights": [0], "targets": [{"positions": [[0, 0, 0], [0, 0, 0], [0, 0, 1]]}]}}}, "material": "wall"},
    {"geometry": "disk", "material": "wall", "emission": {"radiance": 1}, "to_world": [{"translate": [0, 3, 0]}]}
  ],
  "lights": [{"point": {"position": [0, 3, 2], "intensity": 4}}],
  "animation": {"tracks": [
    {"target": "shapes[1].to_world[1].rotate.degrees", "times": [0, 2], "values": [0, 90]},
    {"target": "shapes[2].to_world[0].translate", "times": [0, 2], "values": [[-1, 0, 0], [-1, 1, 0]]},
    {"target": "shapes[3].to_world[0].translate[0]", "times": [0, 2], "values": [0, 1]},
    {"target": "shapes[4].to_world[0].translate[2]", "times": [0, 2], "values": [0, -1]},
    {"target": "groups.pumping[0].geometry.sphere.radius", "times": [0, 2], "values": [0.3, 0.6]},
    {"target": "shapes[6].geometry.mesh.morph.weights", "times": [0, 2], "values": [[0], [1]]},
    {"target": "materials.wall.diffuse.reflectance", "times": [1, 2], "values": [0.5, 0.25]},
    {"target": "shapes[7].emission.radiance", "times": [0, 1, 2], "values": [0, 0, 2]}
  ]}
}"#;

fn description() -> SceneDescription {
    SceneDescription::from_json(SCENE, "s.json").unwrap()
}

fn stage() -> Stage {
    Stage::new(description(), Arc::new(NoAssets)).unwrap()
}

/// Rays from around the scene into it.
fn rays() -> Vec<Ray> {
    let mut rays = Vec::new();
    for x in 0..24 {
        for y in 0..24 {
            let target = Vec3::new(x as f32 / 23.0 * 5.0 - 2.5, y as f32 / 23.0 * 4.0 - 0.7, 0.0);
            for origin in [Vec3::new(0.3, 1.2, 6.0), Vec3::new(5.0, 4.0, 5.0)] {
                rays.push(Ray { origin, direction: (target - origin).normalize(), reach: f32::INFINITY });
            }
        }
    }
    rays
}

#[test]
fn an_instant_is_what_its_description_compiles_to() {
    let stage = stage();
    for seconds in [0.0, 0.7, 1.3, 2.0, 0.7] {
        let scene = stage.scene(seconds).unwrap();
        let anew = Scene::compile(&description().at(seconds).unwrap(), &NoAssets).unwrap();
        assert_eq!(scene.shapes, anew.shapes);
        assert_eq!(scene.lights.len(), anew.lights.len());
        assert_eq!(format!("{:?}", scene.sensor), format!("{:?}", anew.sensor));
        let (mut met, mut apart) = (0, 0);
        for ray in rays() {
            match (scene.trace(&ray), anew.trace(&ray)) {
                (Some(a), Some(b)) if a.shape == b.shape => {
                    met += 1;
                    assert!((a.position - b.position).length() < 1e-4, "{} is not {} at {seconds} s", a.position, b.position);
                    assert!((a.normal - b.normal).length() < 1e-3 && (a.shading_normal - b.shading_normal).length() < 1e-3);
                    assert_eq!(scene.light_point(&a).map(|point| point.light), anew.light_point(&b).map(|point| point.light));
                }
                (None, None) => {}
                // Rounding at an edge.
                _ => apart += 1,
            }
        }
        assert!(met > 900 && apart <= 2, "{met} met, {apart} apart");
        let any: Vec<bool> = rays().iter().map(|ray| scene.world.occluded(ray)).collect();
        let other: Vec<bool> = rays().iter().map(|ray| anew.world.occluded(ray)).collect();
        assert!(any.iter().zip(&other).filter(|(a, b)| a != b).count() <= 2);
    }
}

#[test]
fn the_order_of_instants_does_not_matter() {
    let (forth, back) = (stage(), stage());
    let times = [0.0, 0.5, 1.7];
    let there: Vec<_> = times.iter().map(|t| forth.scene(*t).unwrap()).collect();
    let here: Vec<_> = times.iter().rev().map(|t| back.scene(*t).unwrap()).collect();
    for (a, b) in there.iter().zip(here.iter().rev()) {
        for ray in rays() {
            assert_eq!(a.world.closest(&ray), b.world.closest(&ray));
        }
    }
}

#[test]
fn a_scene_at_rest_is_the_same_to_the_bit() {
    let still = description().at(0.4).unwrap();
    let staged = Stage::new(still.clone(), Arc::new(NoAssets)).unwrap().scene(9.0).unwrap();
    let plain = Scene::compile(&still, &NoAssets).unwrap();
    for ray in rays() {
        assert_eq!(staged.world.closest(&ray), plain.world.closest(&ray));
        assert_eq!(staged.trace(&ray).map(|s| (s.position, s.error)), plain.trace(&ray).map(|s| (s.position, s.error)));
    }
}

#[test]
fn material_points_are_carried() {
    let stage = stage();
    let (here, there) = (stage.scene(0.2).unwrap(), stage.scene(1.9).unwrap());
    let mut moved = std::collections::BTreeMap::new();
    for ray in rays() {
        let Some(surface) = here.trace(&ray) else { continue };
        let then = here.world.carry(&surface, &there.world).unwrap();
        let back = (here.world.carry(&surface, &here.world).unwrap() - surface.position).length();
        assert!(back < 1e-4, "{back}");
        // A ray of the other instant towards that place meets the same shape there, from just outside.
        let hit = there.trace(&Ray { origin: then + Vec3::Z * 0.01, direction: -Vec3::Z, reach: 0.02 });
        let seen = hit.filter(|hit| hit.shape == surface.shape && (hit.position - then).length() < 0.01).is_some();
        let far: &mut f32 = moved.entry((surface.shape.0, seen)).or_default();
        *far = far.max((then - surface.position).length());
    }
    let most = |shape: u32| moved.get(&(shape, true)).copied().unwrap_or(0.0);
    // Shapes 0 and 1 are the pair, 2 the pumping sphere; then those of the scene without the instances.
    for (shape, expected) in [(0, 0.85), (1, 0.85), (3, 0.0), (5, 0.85), (6, 0.85)] {
        assert!((most(shape) - expected).abs() < 1e-3, "shape {shape} moved by {}", most(shape));
    }
    assert!(most(2) > 0.2 && most(4) > 0.1 && moved.keys().any(|(shape, _)| *shape == 7), "{moved:?}");
}

#[test]
fn what_rests_is_one_scene() {
    let stage = stage();
    let exposure = stage.exposure(&[2.0, 2.5, 3.0], Some(1.9)).unwrap();
    assert_eq!(exposure.instants.len(), 1, "everything holds after the last key");
    assert!(Arc::ptr_eq(&exposure.instants[0], &stage.scene(7.0).unwrap()));
    assert!(!Arc::ptr_eq(&exposure.instants[0], exposure.before.as_ref().unwrap()));
    let moving = stage.exposure(&[0.0, 0.1, 0.2], None).unwrap();
    assert_eq!((moving.instants.len(), moving.before.is_none()), (3, true));
}

/// Counts how often files are opened.
struct Counting(std::sync::atomic::AtomicUsize);

impl Assets for Counting {
    fn open(&self, _: &str) -> Result<Vec<u8>, Error> {
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        Ok(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec())
    }
}

#[test]
fn files_are_read_once() {
    let text = SCENE.replace("\"geometry\": \"cube\"", "\"geometry\": {\"obj\": {\"file\": \"a.obj\"}}");
    let assets = Arc::new(Counting(Default::default()));
    let stage = Stage::new(SceneDescription::from_json(&text, "s").unwrap(), assets.clone()).unwrap();
    for k in 0..5 {
        stage.scene(f64::from(k) * 0.3).unwrap();
    }
    assert_eq!(assets.0.load(std::sync::atomic::Ordering::Relaxed), 1, "two shapes, five instants");
}

#[test]
fn a_missing_file_is_reported_and_may_come_later() {
    let text = SCENE.replace("\"geometry\": \"cube\"", "\"geometry\": {\"obj\": {\"file\": \"a.obj\"}}");
    let stage = Stage::new(SceneDescription::from_json(&text, "s").unwrap(), Arc::new(NoAssets)).unwrap();
    assert_eq!(stage.scene(0.0).unwrap_err().kind, ErrorKind::Unreadable);
    assert_eq!(stage.scene(0.0).unwrap_err().kind, ErrorKind::Unreadable);
}
