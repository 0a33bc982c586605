//! `gradfarm reconstruct` on files as other renderers write them, and on this program's own.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::io::Cursor;
use std::path::Path;

use common::{assert_code, folder, last_json, run, stderr, stdout};
use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::exr;

const EXTENT: Extent = Extent { width: 20, height: 13 };

/// A picture with an edge, and its differences to the next column and row.
fn picture() -> [Image; 3] {
    let value = |x: u32, y: u32, c: usize| if x > 8 { 2.0 + c as f32 } else { 0.1 * y as f32 };
    let of = |f: &dyn Fn(u32, u32, usize) -> f32| {
        let mut image = Image::new(EXTENT, 3);
        for c in 0..3 {
            for (y, x) in (0..EXTENT.height).flat_map(|y| (0..EXTENT.width).map(move |x| (y, x))) {
                image.set(x, y, c, f(x, y, c));
            }
        }
        image
    };
    [
        of(&value),
        of(&|x, y, c| if x + 1 < EXTENT.width { value(x + 1, y, c) - value(x, y, c) } else { 0.0 }),
        of(&|x, y, c| if y + 1 < EXTENT.height { value(x, y + 1, c) - value(x, y, c) } else { 0.0 }),
    ]
}

fn write(path: &Path, image: &Image, named: Vec<(&'static str, &Image)>) {
    let mut bytes = Cursor::new(Vec::new());
    exr::write(&mut bytes, &exr::Layers { image, named }, &exr::Metadata::default()).unwrap();
    std::fs::write(path, bytes.into_inner()).unwrap();
}

fn read(path: &Path) -> Image {
    exr::read_rgb(&std::fs::read(path).unwrap()).unwrap()
}

fn worst(a: &Image, b: &Image) -> f32 {
    a.data().iter().zip(b.data()).fold(0.0, |w, (a, b)| w.max((a - b).abs()))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_set_of_files_is_found_by_prefix_by_one_of_them_and_by_options() {
    let (folder, _) = folder();
    let at = |name: &str| folder.path().join(name);
    let [image, mut dx, dy] = picture();
    write(&at("wall-primal.exr"), &image, vec![]);
    write(&at("wall-dy.exr"), &dy, vec![]);
    // What other programs leave in the last column is no difference of anything.
    (0..EXTENT.height).for_each(|y| dx.set(EXTENT.width - 1, y, 1, 50.0));
    write(&at("wall-dx.exr"), &dx, vec![]);
    let (primal, x, y, out) = (at("wall-primal.exr"), at("wall-dx.exr"), at("wall-dy.exr"), at("out.exr"));
    let prefix = at("wall");
    let ways = [vec![text(&prefix)], vec![text(&x)], vec!["--primal", text(&primal), "--dx", text(&x), "--dy", text(&y)]];
    for way in ways {
        let output = run(&[&["reconstruct", "-o", text(&out), "--json"], &way[..]].concat());
        assert_code(&output, 0);
        assert!(stderr(&output).contains("dx is not zero in its last column"), "{}", stderr(&output));
        let told = last_json(&output);
        assert_eq!(
            (told["reconstruction"].as_str(), told["width"].as_u64(), told["clamped"].as_bool()),
            (Some("l2"), Some(20), Some(false))
        );
        assert!((told["alpha"].as_f64().unwrap() - 0.2).abs() < 1e-6 && told["seconds"].as_f64().unwrap() >= 0.0);
        assert!(worst(&read(&out), &image) < 1e-4);
        assert!(at("out.png").exists());
        std::fs::remove_file(&out).unwrap();
    }
    let output = run(&["reconstruct", text(&prefix), "-o", text(&out), "--reconstruction", "l1", "--alpha", "0.4"]);
    assert_code(&output, 0);
    for said in ["l1", "0.4 (asked for)", "time"] {
        assert!(stdout(&output).contains(said), "{said}: {}", stdout(&output));
    }
    assert!(worst(&read(&out), &image) < 1e-3);
}

#[test]
fn direct_light_of_a_file_of_its_own_is_added_and_negative_values_go_if_asked() {
    let (folder, _) = folder();
    let at = |name: &str| folder.path().join(name);
    let [image, dx, dy] = picture();
    let minus = Image::from_planes(EXTENT, 3, vec![-1.0; 3 * EXTENT.pixels()]).unwrap();
    for (name, image) in [("a-throughput.exr", &image), ("a-dx.exr", &dx), ("a-dy.exr", &dy), ("a-direct.exr", &minus)] {
        write(&at(name), image, vec![]);
    }
    let out = at("out.exr");
    assert_code(&run(&["reconstruct", text(&at("a")), "-o", text(&out)]), 0);
    let expected: Vec<f32> = image.data().iter().map(|v| v - 1.0).collect();
    let expected = Image::from_planes(EXTENT, 3, expected).unwrap();
    assert!(worst(&read(&out), &expected) < 1e-4);
    let output = run(&["reconstruct", text(&at("a-dy.exr")), "-o", text(&out), "--clamp"]);
    assert_code(&output, 0);
    assert!(stdout(&output).contains("biases"));
    let clamped: Vec<f32> = expected.data().iter().map(|v| v.max(0.0)).collect();
    assert!(worst(&read(&out), &Image::from_planes(EXTENT, 3, clamped).unwrap()) < 1e-4);
}

#[test]
fn a_rendered_file_can_be_reconstructed_again() {
    let (folder, scene) = folder();
    let at = |name: &str| folder.path().join(name);
    let (rendered, out) = (at("a.exr"), at("out.exr"));
    let words = ["--technique", "gpt", "--reconstruction", "l2", "--alpha", "0.3", "--samples", "8"];
    assert_code(&run(&[&["render", text(&scene), "-o", text(&rendered)], &words[..]].concat()), 0);
    let output = run(&["reconstruct", text(&rendered), "-o", text(&out), "--alpha", "0.3"]);
    assert_code(&output, 0);
    // Halves of equal numbers of samples: the mean of their images is the image of their mean.
    let image = read(&rendered);
    let largest = image.data().iter().fold(0.0f32, |a, b| a.max(b.abs()));
    assert!(worst(&read(&out), &image) < 1e-5 * largest.max(1.0), "{}", worst(&read(&out), &image));
    // The file tells of noise, so the weight follows from that, and weights too.
    let output = run(&["reconstruct", text(&rendered), "-o", text(&out), "--reconstruction", "weighted-l2", "--json"]);
    assert_code(&output, 0);
    let told = last_json(&output);
    assert_eq!(told["alpha_because"].as_str(), Some("by the noise of primal and gradients"));
    assert!(told["iterations"].as_u64().unwrap() > 0 && told["residual"].as_f64().unwrap() <= 1e-5);
}

#[test]
fn what_is_missing_or_does_not_fit_is_named() {
    let (folder, _) = folder();
    let at = |name: &str| folder.path().join(name);
    let [image, dx, dy] = picture();
    write(&at("one.exr"), &image, vec![("primal", &image), ("dx", &dx)]);
    write(&at("all.exr"), &image, vec![("primal", &image), ("dx", &dx), ("dy", &dy)]);
    let small = Image::new(Extent { width: 4, height: 3 }, 3);
    write(&at("small.exr"), &small, vec![]);
    write(&at("p.exr"), &image, vec![]);
    write(&at("x.exr"), &dx, vec![]);
    std::fs::write(at("broken.exr"), "no image at all").unwrap();
    let out = at("out.exr");
    let three = |p: &str, x: &str, y: &str| {
        vec![
            "--primal".into(),
            at(p).display().to_string(),
            "--dx".into(),
            at(x).display().to_string(),
            "--dy".into(),
            at(y).display().to_string(),
        ]
    };
    let name = |name: &str| vec![at(name).display().to_string()];
    for (way, said) in [
        (name("nothing"), vec!["nothing is no file", "nothing-primal.exr", "nothing-dx.exr", "nothing-dy.exr"]),
        (name("one.exr"), vec!["one.exr, layer dy", "dy.R"]),
        (three("p.exr", "x.exr", "small.exr"), vec!["small.exr, layer dy: found 4×3, expected 20×13"]),
        (three("p.exr", "absent.exr", "x.exr"), vec!["absent.exr"]),
        (three("broken.exr", "x.exr", "x.exr"), vec!["broken.exr, layer primal"]),
        ([name("all.exr"), vec!["--reconstruction".into(), "weighted-l2".into()]].concat(), vec!["weighted-l2", "needs", "variances"]),
        ([name("all.exr"), vec!["--variance".into(), at("p.exr").display().to_string()]].concat(), vec!["p.exr, layer variance"]),
        ([name("all.exr"), vec!["--alpha".into(), "0".into()]].concat(), vec!["above 0"]),
        ([name("all.exr"), vec!["--reconstruction".into(), "magic".into()]].concat(), vec!["expected one of none, l2, weighted-l2"]),
    ] {
        let mut words = vec!["reconstruct".to_owned(), "-o".into(), out.display().to_string()];
        words.extend(way);
        let output = run(&words.iter().map(String::as_str).collect::<Vec<_>>());
        assert_code(&output, 2);
        for said in said {
            assert!(stderr(&output).contains(said), "{words:?}: {said}: {}", stderr(&output));
        }
        assert!(!out.exists());
    }
    assert_code(&run(&["reconstruct", text(&at("all.exr")), "-o", text(&out)]), 0);
    assert!(worst(&read(&out), &image) < 1e-4);
}

#[test]
fn what_needs_two_halves_is_refused_and_nothing_takes_its_place() {
    let (folder, _) = folder();
    let at = |name: &str| folder.path().join(name);
    for (name, image) in ["wall-primal.exr", "wall-dx.exr", "wall-dy.exr"].into_iter().zip(picture()) {
        write(&at(name), &image, vec![]);
    }
    for kind in ["nfor", "regularised", "auto"] {
        let output = run(&["reconstruct", text(&at("wall")), "-o", text(&at("out.exr")), "--reconstruction", kind]);
        assert_code(&output, 2);
        assert!(stderr(&output).contains("expected one of none, l2, weighted-l2"), "{}", stderr(&output));
        assert!(!at("out.exr").exists());
    }
}
