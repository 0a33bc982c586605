//! The web page in a real browser, on a farm of two workers: what people see and do there. Needs Chromium; stays away with a word where there
//! is none, unless GRADFARM_REQUIRE names `chromium`. Accessibility is judged by axe-core where GRADFARM_AXE names its file.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;

use gradfarm_core::plan::Technique;
use gradfarm_tests::browser::{Browser, chromium};
use gradfarm_tests::farm::{Coordinator, Job};
use serde_json::Value;

const SCENE: &str = include_str!("../scenes/cornell-box.json");
const SHORT: Job = Job { scene: SCENE, width: 96, height: 96, samples: 96, tile: 32, rounds: 1, technique: Technique::Gpt };

/// Whether an optional thing is named as required.
fn required(name: &str) -> bool {
    std::env::var("GRADFARM_REQUIRE").is_ok_and(|names| names.split(',').any(|other| other == name))
}

/// The program, or a word why there is none.
fn browser() -> Option<&'static str> {
    let found = chromium();
    assert!(found.is_some() || !required("chromium"), "GRADFARM_REQUIRE names chromium, which is not here");
    if found.is_none() {
        println!("left out: there is no chromium");
    }
    found
}

/// Keeps a screenshot if somebody wants to look at it.
fn picture(browser: &mut Browser, name: &str) {
    if let Some(folder) = std::env::var_os("GRADFARM_SCREENSHOTS") {
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), browser.screenshot()).unwrap();
    }
}

/// Serious faults of the page as it is, where somebody can judge.
fn assert_accessible(browser: &mut Browser, what: &str) {
    let Some(path) = std::env::var_os("GRADFARM_AXE") else {
        assert!(!required("axe"), "GRADFARM_REQUIRE names axe, but GRADFARM_AXE names no file");
        return println!("accessibility of {what} not judged: GRADFARM_AXE names no file");
    };
    let script = std::fs::read_to_string(path).unwrap();
    browser.value(&format!("{script}\n;typeof axe.run"));
    let found = browser.value(
        "axe.run().then(({ violations }) => violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')
            .map(({ id, nodes }) => [id, nodes.map((node) => [node.html, node.failureSummary])]))",
    );
    assert_eq!(found, Value::Array(Vec::new()), "{what}");
}

/// Goes to another part of the page.
fn go(browser: &mut Browser, to: &str, title: &str) {
    browser.value(&format!("location.hash = {to:?}"));
    browser.wait_for(&format!("document.querySelector('h1')?.textContent === {title:?}"));
}

/// Sets an input as a hand would.
fn set(browser: &mut Browser, id: &str, value: &str) {
    browser.value(&format!(
        "(() => {{ const input = document.getElementById({id:?}); input.value = {value:?};
            for (const name of ['input', 'change']) input.dispatchEvent(new Event(name, {{ bubbles: true }})); }})()"
    ));
}

/// The button with this text.
fn button(text: &str) -> String {
    format!("[...document.querySelectorAll('button')].find((one) => one.textContent === {text:?})")
}

const STATE: &str = "document.querySelector('.state')?.textContent";

#[test]
fn a_scene_is_submitted_watched_paused_and_called_off() {
    let Some(program) = browser() else { return };
    let coordinator = Coordinator::start();
    let _workers = [coordinator.worker(1), coordinator.worker(1)];
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("box.json");
    std::fs::write(&scene, SCENE).unwrap();
    let mut browser = Browser::start(program, 1280, 1000);
    // Without a token nothing is told; with one in the address the page is let in and forgets it there.
    browser.open(&coordinator.address());
    browser.wait_for("document.getElementById('ask')?.open");
    assert_accessible(&mut browser, "asking for a token");
    let complaints = browser.complaints();
    assert!(complaints.iter().all(|one| one.contains("401")), "{complaints:?}");
    browser.value(&format!("document.getElementById('token').value = {:?}", coordinator.token()));
    browser.value("document.getElementById('token').focus()");
    browser.press("Enter");
    browser.wait_for("document.querySelector('h1')?.textContent === 'Jobs' && document.body.innerText.includes('No jobs yet')");
    assert_accessible(&mut browser, "an empty list");

    go(&mut browser, "#/submit", "Submit");
    browser.choose("#files", &[&scene]);
    browser.wait_for("document.getElementById('scene').value === 'box.json'");
    for (option, value) in [("samples", "200000"), ("size", "128x128"), ("tile", "32"), ("technique", "gpt"), ("seed", "3")] {
        set(&mut browser, &format!("option-{option}"), value);
    }
    assert_accessible(&mut browser, "submitting");
    picture(&mut browser, "submit");
    // By keyboard.
    browser.value(&format!("{}.focus()", button("Submit")));
    browser.press("Enter");
    browser.wait_for("location.hash.startsWith('#/jobs/') && document.querySelector('h1')?.textContent === 'box'");

    // The picture is there, and gets better.
    browser.wait_for("Number(document.querySelector('canvas').dataset.mean) > 0");
    let mean = browser.value("document.querySelector('canvas').dataset.mean");
    browser.wait_for(&format!("document.querySelector('canvas').dataset.mean !== {mean}"));
    browser.value(&format!("{}.click()", button("Tiles")));
    browser.wait_for("document.querySelectorAll('.legend li').length >= 1");
    set(&mut browser, "exposure", "1.5");
    set(&mut browser, "right", "gradient");
    browser.wait_for("!document.getElementById('wipe').disabled");
    set(&mut browser, "wipe", "60");
    browser.value("document.querySelector('.stage canvas').focus()");
    browser.press("ArrowRight");
    browser.wait_for(r"/^\(65, 64\).*primal: .*gradient: /s.test(document.querySelector('.readout').textContent)");
    picture(&mut browser, "job-running");
    assert_accessible(&mut browser, "a job that runs");

    browser.value(&format!("{}.click()", button("Pause")));
    browser.wait_for(&format!("{STATE} === 'paused'"));
    browser.value(&format!("{}.click()", button("Resume")));
    browser.wait_for(&format!("{STATE} === 'running'"));
    // What was set is there when the page is opened anew.
    set(&mut browser, "priority", "7");
    browser.wait_for("document.querySelector('[role=alert]').textContent === ''");
    let address = browser.value("location.hash");
    go(&mut browser, "#/jobs", "Jobs");
    browser.value(&format!("location.hash = {address}"));
    browser.wait_for("document.getElementById('priority')?.value === '7'");
    browser.value(&format!("{}.id = 'cancel'", button("Cancel")));
    browser.click_and_accept("#cancel");
    browser.wait_for(&format!("{STATE} === 'cancelled' && document.querySelectorAll('[aria-label=Actions] button').length === 0"));

    go(&mut browser, "#/workers", "Workers");
    browser.wait_for("document.querySelectorAll('tbody tr').length === 2");
    browser.value(&format!("{}.click()", button("Drain")));
    browser.wait_for("document.querySelectorAll('.state.paused').length === 1");
    assert_accessible(&mut browser, "the workers");
    picture(&mut browser, "workers");
    browser.value(&format!("{}.click()", button("Resume")));
    browser.wait_for("document.querySelectorAll('.state.paused').length === 0");
    assert_eq!(browser.complaints(), Vec::<String>::new());

    // What is wrong with a scene is told where it was submitted.
    std::fs::write(&scene, SCENE.replacen("\"camera\"", "\"kamera\"", 1)).unwrap();
    go(&mut browser, "#/submit", "Submit");
    browser.choose("#files", &[&scene]);
    browser.wait_for("!document.querySelector('form.panel button.main').disabled");
    browser.value(&format!("{}.click()", button("Submit")));
    browser.wait_for("document.querySelector('form.panel [role=alert]').textContent.includes('kamera')");
    let complaints = browser.complaints();
    assert!(complaints.len() == 1 && complaints[0].contains("422"), "{complaints:?}");
}

#[test]
fn a_finished_job_shows_its_views_its_curve_and_its_plan() {
    let Some(program) = browser() else { return };
    let coordinator = Coordinator::start();
    let _workers = [coordinator.worker(1), coordinator.worker(1)];
    let job = coordinator.submit_with(&SHORT, &["--curve"]);
    let mut browser = Browser::start(program, 1280, 1000);
    browser.open(&format!("{}/#token={}", coordinator.address(), coordinator.token()));
    browser.wait_for("location.hash === '#/jobs'");
    browser.value(&format!("location.hash = '#/jobs/{job}'"));
    browser.wait_for(&format!("{STATE} === 'done'"));
    browser.wait_for("document.querySelector('.stage canvas').dataset.view === 'reconstructed'");
    browser.wait_for("document.querySelectorAll('.chart .point').length >= 2");
    for view in ["primal", "gradient", "dx", "dy", "error", "reconstructed"] {
        set(&mut browser, "left", view);
        browser.wait_for(&format!("document.querySelector('.stage canvas').dataset.view === {view:?}"));
    }
    for text in ["Plan, and why", "reconnected surface", "95 %", "Save EXR"] {
        browser.wait_for(&format!("document.body.innerText.includes({text:?})"));
    }
    set(&mut browser, "right", "primal");
    browser.wait_for("!document.getElementById('wipe').disabled");
    for scheme in ["light", "dark"] {
        browser.scheme(scheme);
        assert_accessible(&mut browser, &format!("a finished job, {scheme}"));
        picture(&mut browser, &format!("job-done-{scheme}"));
    }

    go(&mut browser, "#/api", "API");
    browser.wait_for("document.querySelectorAll('details.panel').length > 20");
    assert_accessible(&mut browser, "the explorer");

    // The list finds it by its name, and Tab reaches it.
    go(&mut browser, "#/jobs", "Jobs");
    browser.wait_for("document.querySelectorAll('tbody tr a').length === 1");
    set(&mut browser, "search", "nothing like this");
    browser.wait_for("document.body.innerText.includes('No job is like this')");
    set(&mut browser, "search", "scene");
    browser.wait_for("document.querySelectorAll('tbody tr a').length === 1");
    browser.value("document.getElementById('state').focus()");
    browser.press("Tab");
    browser.press("Tab");
    browser.wait_for("document.activeElement.matches('tbody a')");
    browser.press("Enter");
    browser.wait_for(&format!("location.hash === '#/jobs/{job}'"));
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
