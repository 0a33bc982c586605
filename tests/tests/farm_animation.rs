//! A batch of frames that are reconstructed together gives the bits of the core alone: for any workers and tiles, and if the coordinator is
//! killed between and within windows. What its memory holds does not grow with the batch.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use std::sync::{Arc, OnceLock};

use gradfarm_core::film::Image;
use gradfarm_core::lattice::Extent;
use gradfarm_core::output::exr;
use gradfarm_core::plan::{self, Request, Technique, Timeline};
use gradfarm_core::reconstruction::window::{MomentFilm, Windows, blend, finish, solve};
use gradfarm_core::scene::{NoAssets, SceneDescription, Stage};
use gradfarm_tests::animation::copies;
use gradfarm_tests::farm::{Coordinator, Job, PATIENCE, wait_for};

const JOB: Job = Job {
    scene: include_str!("../scenes/turning-box.json"),
    width: 48,
    height: 36,
    samples: 16,
    tile: 64,
    rounds: 1,
    technique: Technique::Gpt,
};
/// The scene comes to rest with frame 9.
const FRAMES: u32 = 12;
const MOMENTS: u64 = 10;
const TIME: &[&str] = &["--frames", "0..12", "--fps", "12", "--window", "4", "--stride", "2"];

/// The images of the moments from the core alone.
fn reference() -> &'static [Image] {
    static REFERENCE: OnceLock<Vec<Image>> = OnceLock::new();
    REFERENCE.get_or_init(|| {
        let description = SceneDescription::from_json(JOB.scene, "scene").unwrap();
        let request = Request {
            technique: Some(JOB.technique),
            samples: Some(JOB.samples),
            extent: Some(Extent { width: JOB.width, height: JOB.height }),
            seed: 11,
            rounds: Some(1),
            frames: FRAMES,
            timeline: Some(Timeline { fps: 12.0, ..Timeline::default() }),
            window: Some(4),
            stride: Some(2),
            ..Request::default()
        };
        let plan = plan::resolve(&description, &request).unwrap();
        let moments = plan.moments(&description, 0..FRAMES).unwrap();
        assert_eq!(moments.len() as u64, MOMENTS);
        let stage = Stage::new(description, Arc::new(NoAssets)).unwrap();
        let film = |moment| {
            let [even, odd] = copies(&plan.exposure(&stage, moment).unwrap().view(), &plan, moment).unwrap();
            MomentFilm::new(&[&even, &odd]).unwrap()
        };
        let films: Vec<MomentFilm> = moments.iter().map(|moment| film(*moment)).collect();
        let windows = Windows::new(films.len() as u32, 4, 2);
        let mut shares = vec![Vec::new(); films.len()];
        let mut report = None;
        for window in 0..windows.len() {
            let row: Vec<&MomentFilm> = windows.moments(window).map(|moment| &films[moment as usize]).collect();
            let solution = solve(&row, plan.reconstruction, plan.alpha).unwrap();
            report = Some(solution.report);
            for (mut share, moment) in solution.moments.into_iter().zip(windows.moments(window)) {
                share.scale(windows.weight(window, moment));
                shares[moment as usize].push(share);
            }
        }
        let image = |(shares, film): (Vec<_>, &MomentFilm)| {
            finish(blend(shares).unwrap().unwrap(), film, plan.reconstruction, report.unwrap()).unwrap().image
        };
        shares.into_iter().zip(&films).map(image).collect()
    })
}

/// Waits for the job, and compares every frame with the core's.
#[track_caller]
fn assert_same_bits(coordinator: &Coordinator, job: &str) {
    let first = coordinator.frame(job, 0);
    for frame in 0..FRAMES {
        let file = if frame == 0 { first.clone() } else { coordinator.frame(job, frame) };
        let (found, expected) = (exr::read_layer(&file, "").unwrap(), &reference()[(frame as usize).min(MOMENTS as usize - 1)]);
        assert_eq!(found.extent(), expected.extent());
        let differing = found.data().iter().zip(expected.data()).filter(|(f, e)| f.to_bits() != e.to_bits()).count();
        assert_eq!(differing, 0, "values of frame {frame} that differ, of {}", expected.data().len());
    }
}

#[test]
fn workers_and_tiles_leave_no_trace_in_any_frame() {
    let coordinator = Coordinator::start();
    let mut workers = Vec::new();
    for (count, tile) in [(1, 64), (3, 13)] {
        while workers.len() < count {
            workers.push(coordinator.worker(1));
        }
        let job = coordinator.submit_with(&Job { tile, ..JOB }, TIME);
        assert_same_bits(&coordinator, &job);
        let told = coordinator.job(&job);
        assert_eq!((told["frames_done"].as_u64(), told["frames_total"].as_u64()), (Some(12), Some(12)));
        let units = told["progress"]["units"]["total"].as_u64().unwrap();
        assert_eq!(units % MOMENTS, 0, "the frames at rest are rendered once: {units} units");
        assert!(told["plan"]["reasons"].to_string().contains("12 frames show 10 moments"), "{}", told["plan"]["reasons"]);
        assert_eq!((&told["frames"][10]["moment"]["first"], &told["frames"][10]["moment"]["end"]), (&9.into(), &12.into()));
        assert!(told["windows"].as_array().unwrap().iter().all(|window| window["state"] == "solved"), "{}", told["windows"]);
    }
}

#[test]
fn a_coordinator_killed_within_a_window_goes_on_where_it_stopped() {
    let mut coordinator = Coordinator::start();
    let _workers = [coordinator.worker(1), coordinator.worker(1)];
    // 3 × 3 tiles, 2 passes: 18 units to a moment, 72 to the first window, 36 more to each of the next.
    let job = coordinator.submit_with(&Job { tile: 16, ..JOB }, TIME);
    let mut killed = 0;
    for least in [30, 73, 110, 150] {
        let done = coordinator.wait_for_units(&job, least);
        killed += u64::from(done < 18 * MOMENTS);
        coordinator.crash_and_restart();
        let after = coordinator.units_done(&job);
        assert!(after >= done, "{done} units were acknowledged, {after} are left");
    }
    assert!(killed >= 2, "it was killed too late: {killed} times on the way");
    assert_same_bits(&coordinator, &job);
    coordinator.crash_and_restart();
    assert_same_bits(&coordinator, &job);
}

#[test]
fn a_paused_job_waits_and_goes_on() {
    let coordinator = Coordinator::start();
    let _worker = coordinator.worker(1);
    let job = coordinator.submit_with(&Job { tile: 16, ..JOB }, TIME);
    coordinator.wait_for_units(&job, 3);
    let told = coordinator.ask(&["pause", &job]).unwrap();
    assert!(told.contains("is paused"), "{told}");
    // What is being rendered ends within the time that one unit takes; then nothing moves.
    let at_rest = wait_for("rest", PATIENCE, || {
        let before = coordinator.units_done(&job);
        std::thread::sleep(std::time::Duration::from_millis(500));
        Some(before).filter(|before| coordinator.units_done(&job) == *before)
    });
    assert!(at_rest < 18 * MOMENTS && coordinator.job(&job)["paused"] == true, "{at_rest} units");
    assert!(coordinator.ask(&["status"]).unwrap().contains("paused"));
    coordinator.ask(&["resume", &job]).unwrap();
    assert_same_bits(&coordinator, &job);
    let over = coordinator.ask(&["pause", &job]).unwrap_err();
    assert!(over.contains("is done already"), "{over}");
}

/// A ball rolls over a floor under a lamp, for 200 frames.
const LONG: Job = Job {
    scene: r#"{
      "version": 1,
      "camera": { "perspective": { "to_world": [{ "look_at": { "origin": [0, 1, 5], "target": [0, 0.8, 0] } }], "fov": 40 } },
      "integrator": { "max_depth": 2 },
      "materials": { "white": { "diffuse": { "reflectance": 0.7 } }, "black": { "diffuse": { "reflectance": 0 } } },
      "shapes": [
        { "geometry": "rectangle", "material": "white", "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": -90 } }, { "scale": [4, 4, 4] }] },
        { "geometry": "rectangle", "material": "black", "emission": { "radiance": 8 },
          "to_world": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }] },
        { "geometry": { "sphere": { "radius": 0.6 } }, "material": "white", "to_world": [{ "translate": [0, 0.6, 0] }] }
      ],
      "animation": { "tracks": [
        { "target": "shapes[2].to_world[0].translate", "times": [0, 10], "values": [[-1.5, 0.6, 0], [1.5, 0.6, 0.5]] }] }
    }"#,
    width: 64,
    height: 64,
    samples: 4,
    tile: 64,
    rounds: 1,
    technique: Technique::Gpt,
};

/// Most memory that a coordinator may ever have held after 200 frames of 64 × 64 pixels, and how much of it may have come after frame 50 [MiB].
const MEMORY: [u64; 2] = [256, 32];

#[test]
fn two_hundred_frames_take_the_memory_of_a_window() {
    let coordinator = Coordinator::start();
    let _worker = coordinator.worker(2);
    let job = coordinator.submit_with(&LONG, &["--frames", "0..200", "--fps", "20"]);
    let frames_done = |least: u64| {
        wait_for("frames", PATIENCE, || coordinator.job(&job)["frames_done"].as_u64().filter(|done| *done >= least));
        coordinator.peak_memory()
    };
    let [early, late] = [frames_done(50), frames_done(200)];
    eprintln!("peak memory of the coordinator: {early} MiB after 50 frames, {late} MiB after 200");
    assert!(late <= MEMORY[0] && late - early <= MEMORY[1], "{early} MiB after 50 frames, {late} MiB after 200");
    assert_eq!(coordinator.job(&job)["windows"].as_array().unwrap().len(), 39);
    for frame in [0, 100, 199] {
        let image = exr::read_layer(&coordinator.frame(&job, frame), "").unwrap();
        assert!(image.data().iter().all(|value| value.is_finite()) && image.data().iter().any(|value| *value > 0.1));
    }
}
