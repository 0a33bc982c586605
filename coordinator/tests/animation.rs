//! Batches of frames as a person meets them: numbered files, animated PNG, contact sheets and movies.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::path::Path;

use common::{assert_code, folder, gradfarm, last_json, moving_scene, run, stderr};

/// Frame delays [s] and pixels of an animated PNG.
fn frames_of(file: &Path) -> Vec<(f64, Vec<u8>)> {
    let bytes = std::fs::read(file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let count = reader.info().animation_control().unwrap().num_frames;
    let frame = |_| {
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        let control = reader.info().frame_control().unwrap();
        (f64::from(control.delay_num) / f64::from(control.delay_den), pixels)
    };
    (0..count).map(frame).collect()
}

fn pixels_of(file: &Path) -> Vec<u8> {
    let bytes = std::fs::read(file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
}

#[test]
fn a_batch_makes_numbered_files_an_animated_png_and_a_sheet() {
    let (folder, scene) = folder();
    std::fs::write(&scene, moving_scene()).unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = |name: &str| at(name).to_str().unwrap().to_owned();
    let (numbered, movie, sheet, told) = (text("frame.%04d.exr"), text("movie.png"), text("sheet.png"), text("told.%d.json"));
    let arguments = ["render", scene.to_str().unwrap(), "-o", &numbered, "-o", &movie, "--contact-sheet", &sheet, "--statistics", &told];
    let more = ["--frames", "2..6", "--fps", "12", "--size", "32x24", "--samples", "4", "--json"];
    let output = run(&[&arguments[..], &more].concat());
    assert_code(&output, 0);
    let report = last_json(&output);
    let numbers: Vec<_> = report["frames"].as_array().unwrap().iter().map(|frame| frame["number"].as_u64().unwrap()).collect();
    assert_eq!(numbers, [2, 3, 4, 5]);
    assert_eq!(report["frames"][1]["output"], text("frame.0003.exr"));
    assert!(report["frames"][0]["estimated_relmse"].as_f64().is_some_and(|error| error > 0.0), "{report}");
    assert!(report["seconds"]["render"].as_f64().is_some_and(|seconds| seconds > 0.0), "{report}");
    let frames = frames_of(&at("movie.png"));
    assert_eq!(frames.len(), 4);
    for (number, (delay, pixels)) in (2..).zip(&frames) {
        assert!((delay - 1.0 / 12.0).abs() < 1e-6, "{delay}");
        assert!(at(&format!("frame.{number:04}.exr")).exists() && at(&format!("told.{number}.json")).exists());
        assert!(&pixels_of(&at(&format!("frame.{number:04}.png"))) == pixels, "frame {number}");
    }
    assert!(frames.windows(2).all(|pair| pair[0].1 != pair[1].1), "the ball rolls");
    assert_eq!(pixels_of(&at("sheet.png")).len(), 3 * (4 + 2 * 36) * (4 + 2 * 28));

    // One of the frames by itself is what it was in the batch, where frames are reconstructed one by one.
    let alone = text("alone.exr");
    let words = ["render", scene.to_str().unwrap(), "--fps", "12", "--size", "32x24", "--samples", "4", "--no-temporal"];
    let output = run(&[&words[..], &["--frames", "3", "-o", &alone]].concat());
    assert_code(&output, 0);
    let output = run(&[&words[..], &["--frames", "3..=4", "-o", &numbered]].concat());
    assert_code(&output, 0);
    assert!(pixels_of(&at("alone.png")) == pixels_of(&at("frame.0003.png")), "frame 3 alone and among others");
}

#[test]
fn a_farm_s_frames_come_as_they_are_done_and_can_be_had_again() {
    let (folder, scene) = folder();
    std::fs::write(&scene, moving_scene()).unwrap();
    let server = common::Server::start(2);
    let at = |name: &str| folder.path().join(name);
    let text = |name: &str| at(name).to_str().unwrap().to_owned();
    let (numbered, movie) = (text("a.%02d.exr"), text("a.png"));
    let asked = ["--frames", "1..5", "--fps", "10", "--size", "32x24", "--samples", "4", "--shutter", "0.5", "--instants", "2"];
    let submitted = server.run(&[&["submit", scene.to_str().unwrap(), "-o", &numbered, "-o", &movie, "--json"][..], &asked].concat());
    assert_code(&submitted, 0);
    let job = last_json(&submitted);
    let timeline = &job["plan"]["timeline"];
    assert_eq!((&timeline["fps"], &timeline["shutter"], &timeline["instants"]), (&10.0.into(), &0.5.into(), &2.into()));
    let frames = frames_of(&at("a.png"));
    assert!(frames.len() == 4 && frames.iter().all(|(delay, _)| (delay - 0.1).abs() < 1e-6));
    assert!((1..5).all(|number| at(&format!("a.{number:02}.exr")).exists()));

    let id = job["id"].as_str().unwrap();
    let told = server.run(&["status", id]);
    assert_code(&told, 0);
    for said in ["frames   4 of 4 done", "frame    1: done", "frame    4: done"] {
        assert!(common::stdout(&told).contains(said), "{said}: {}", common::stdout(&told));
    }
    let list = server.run(&["status"]);
    assert!(common::stdout(&list).contains(" 4/4 "), "{}", common::stdout(&list));
    // A part of it again, and all of it while nothing is left to wait for.
    assert_code(&server.run(&["pull", id, "--frames", "2..=3", "-o", &text("part.png")]), 0);
    assert!(frames_of(&at("part.png")).iter().map(|frame| &frame.1).eq(frames[1..3].iter().map(|frame| &frame.1)));
    assert_code(&server.run(&["pull", id, "--follow", "-o", &text("all.png"), "--contact-sheet", &text("sheet.png")]), 0);
    assert!(std::fs::read(at("all.png")).unwrap() == std::fs::read(at("a.png")).unwrap(), "the same bits");
    for (words, said) in [(&["--frames", "3..9"][..], "which has 1..5"), (&[], "there are 4 frames")] {
        let output = server.run(&[&["pull", id, "-o", &text("b.exr")][..], words].concat());
        assert_code(&output, 2);
        assert!(stderr(&output).contains(said), "{}", stderr(&output));
    }
}

#[test]
fn several_frames_need_a_place_for_each() {
    let (folder, scene) = folder();
    std::fs::write(&scene, moving_scene()).unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let output = run(&["render", scene.to_str().unwrap(), "-o", &at("a.exr")]);
    assert_code(&output, 2);
    // Half a second of 24 frames a second.
    for said in ["there are 12 frames", "a.%04d.exr", "--frames"] {
        assert!(stderr(&output).contains(said), "{said}: {}", stderr(&output));
    }
    let output = run(&["render", scene.to_str().unwrap(), "-o", &at("a.png"), "--accuracy", &at("curve.svg")]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("curve.%04d.svg"), "{}", stderr(&output));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing was written");
}

#[test]
fn movies_without_ffmpeg_propose_what_needs_none() {
    let (folder, scene) = folder();
    for name in ["movie.mp4", "movie.webm"] {
        let path = folder.path().join(name);
        let mut command = gradfarm();
        command.env("PATH", folder.path()).args(["render", scene.to_str().unwrap(), "-o", path.to_str().unwrap()]);
        let output = command.output().unwrap();
        assert_code(&output, 2);
        for said in ["ffmpeg", "in no folder of PATH", "movie.png"] {
            assert!(stderr(&output).contains(said), "{said}: {}", stderr(&output));
        }
    }
}

#[test]
fn ffmpeg_makes_a_movie_where_it_is_installed() {
    let on_path = std::env::var_os("PATH").is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join("ffprobe").is_file()));
    if !common::optional("ffmpeg", on_path) {
        return;
    }
    let (folder, scene) = folder();
    std::fs::write(&scene, moving_scene()).unwrap();
    for name in ["movie.mp4", "movie.webm"] {
        let movie = folder.path().join(name);
        // An odd size gets a line more: players want even ones.
        let size = ["--frames", "0..5", "--fps", "10", "--size", "33x24", "--samples", "4"];
        let output = run(&[&["render", scene.to_str().unwrap(), "-o", movie.to_str().unwrap()][..], &size].concat());
        assert_code(&output, 0);
        let probe = ["-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames,r_frame_rate", "-of", "csv=p=0"];
        let told = std::process::Command::new("ffprobe").args(probe).arg(&movie).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&told.stdout).trim(), "34,24,10/1,5", "{name}");
    }
}
