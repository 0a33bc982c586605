//! The order of the house: who may use whom, how long a file may be, and what no file may hold.
//!
//! A rule that nobody checks is a wish. The tables here say what `ARCHITECTURE.md` says.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Crates, and which of the workspace's crates each may depend on.
const CRATES: &[(&str, &[&str])] = &[
    ("core", &[]),
    ("proto", &["gradfarm-core"]),
    ("worker", &["gradfarm-core", "gradfarm-proto"]),
    ("coordinator", &["gradfarm-core", "gradfarm-proto", "gradfarm-worker"]),
    ("tests", &["gradfarm", "gradfarm-core", "gradfarm-proto", "gradfarm-worker"]),
];

/// Modules of the core, storey by storey from the ground. A module may use every storey below its own.
const STOREYS: &[&[&str]] = &[
    &["accuracy", "lattice", "math", "sampling", "spectrum"],
    &["geometry", "texture", "light", "material", "medium", "sensor"],
    &["scene", "effects"],
    &["path"],
    &["film", "integrator", "shift", "reconstruction", "metrics"],
    &["gradient", "plan", "render", "output"],
];

/// The only arrows within a storey.
const BESIDE: &[(&str, &str)] = &[
    ("sampling", "math"),
    ("spectrum", "math"),
    ("light", "geometry"),
    ("light", "texture"),
    ("material", "texture"),
    ("effects", "scene"),
    ("reconstruction", "film"),
    ("reconstruction", "metrics"),
    ("metrics", "film"),
    ("render", "gradient"),
    ("render", "plan"),
];

/// What a module may not use although it lies below: methods see the contract of paths, never each other's ground.
const APART: &[(&str, &[&str])] = &[
    ("gradient", &["integrator", "shift", "film", "reconstruction", "metrics"]),
    ("film", &["geometry", "texture", "light", "material", "medium", "sensor", "scene", "effects", "path"]),
    ("reconstruction", &["geometry", "texture", "light", "material", "medium", "sensor", "scene", "effects", "path"]),
    ("metrics", &["geometry", "texture", "light", "material", "medium", "sensor", "scene", "effects", "path"]),
    ("output", &["geometry", "texture", "light", "material", "medium", "sensor", "scene", "effects", "path", "integrator", "shift"]),
];

/// Most lines of a file.
const LONGEST: usize = 500;

/// What no file may hold, tests included; written in halves so that this file does not hold it.
const UNFINISHED: &[&str] = &[concat!("todo", "!("), concat!("unimplemented", "!("), concat!("#[igno", "re"), concat!("dbg", "!(")];

/// Functions of floats whose last bit depends on the system's mathematical library: `libm` has them all.
const TRANSCENDENTAL: &[&str] = &[
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sin_cos",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "exp",
    "exp2",
    "exp_m1",
    "ln",
    "ln_1p",
    "log",
    "log2",
    "log10",
    "powf",
    "cbrt",
    "hypot",
    "mul_add",
    "div_euclid",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// Every Rust file below a folder, by its path relative to the workspace.
fn sources(folder: &str) -> BTreeMap<String, String> {
    let root = root();
    let mut found = BTreeMap::new();
    let mut open = vec![root.join(folder)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
                found.insert(name, std::fs::read_to_string(&path).unwrap());
            }
        }
    }
    found
}

fn all_sources() -> BTreeMap<String, String> {
    let all: BTreeMap<_, _> = CRATES.iter().flat_map(|(folder, _)| sources(folder)).collect();
    assert!(all.len() > 100, "only {} files found: is this the workspace?", all.len());
    all
}

/// Whether a file holds tests only.
fn is_test(name: &str) -> bool {
    name.contains("/tests/") || name.ends_with("/tests.rs") || name.starts_with("tests/") || name.starts_with("core/src/testing/")
}

/// The lines of code of a file, numbered, without comments and without test modules: `mod name;` and what stands at the file's end.
fn code(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        if line.trim() == "#[cfg(test)]" {
            match lines.next() {
                Some((_, test)) if test.trim_end().ends_with(';') => continue,
                _ => break,
            }
        }
        found.push((number + 1, line.split("//").next().unwrap_or("")));
    }
    found
}

fn report(faults: &[String]) {
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// Names that follow `crate::` in a line, those of a group included.
fn used(line: &str) -> Vec<String> {
    let word = |s: &str| s.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut names = Vec::new();
    for rest in line.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            Some(group) => names.extend(group.split(',').map(|item| word(item.trim()))),
            None => names.push(word(rest)),
        }
    }
    names
}

#[test]
fn modules_of_the_core_use_only_what_lies_below_them() {
    let storey = |module: &str| STOREYS.iter().position(|storey| storey.contains(&module));
    let mut faults = Vec::new();
    for (name, text) in sources("core/src") {
        let module = name.trim_start_matches("core/src/").split(['/', '.']).next().unwrap().to_string();
        if module == "lib" || is_test(&name) {
            continue;
        }
        let Some(own) = storey(&module) else {
            faults.push(format!("{name}: the module `{module}` stands on no storey"));
            continue;
        };
        for (number, line) in code(&text) {
            for other in used(line) {
                let Some(level) = storey(&other) else { continue };
                let allowed = other == module || level < own || BESIDE.contains(&(module.as_str(), other.as_str()));
                let apart = APART.iter().any(|(who, what)| *who == module && what.contains(&other.as_str()));
                if !allowed || apart {
                    faults.push(format!("{name}:{number}: `{module}` may not use `{other}`"));
                }
            }
        }
    }
    report(&faults);
}

#[test]
fn crates_depend_only_on_those_below_them() {
    let mut faults = Vec::new();
    for (folder, allowed) in CRATES {
        let manifest = std::fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let dependencies = manifest.lines().filter(|line| !line.trim_start().starts_with("name"));
        for line in dependencies {
            let key = line.split(['.', '=', ' ']).next().unwrap_or("");
            if key.starts_with("gradfarm") && !allowed.contains(&key) {
                faults.push(format!("{folder}/Cargo.toml: `{key}`"));
            }
        }
    }
    // The coordinator starts workers in its own process in one file; everywhere else it knows them by the wire alone.
    for (name, text) in sources("coordinator/src") {
        if name != "coordinator/src/embedded.rs" && code(&text).iter().any(|(_, line)| line.contains("gradfarm_worker")) {
            faults.push(format!("{name}: uses the worker crate"));
        }
    }
    report(&faults);
}

#[test]
fn files_are_short_and_say_what_they_are_for() {
    let mut faults = Vec::new();
    for (name, text) in all_sources() {
        let lines = text.lines().count();
        if lines > LONGEST {
            faults.push(format!("{name}: {lines} lines, at most {LONGEST}"));
        }
        if !text.starts_with("//! ") {
            faults.push(format!("{name}: the first line does not say what the file is for"));
        }
    }
    report(&faults);
}

#[test]
fn nothing_is_left_unfinished() {
    let mut faults = Vec::new();
    for (name, text) in all_sources() {
        for (number, line) in text.lines().enumerate() {
            faults.extend(UNFINISHED.iter().filter(|word| line.contains(**word)).map(|word| format!("{name}:{}: {word}", number + 1)));
        }
    }
    report(&faults);
}

#[test]
fn the_core_computes_the_same_bits_everywhere() {
    let mut faults = Vec::new();
    for (name, text) in sources("core/src").into_iter().filter(|(name, _)| !is_test(name)) {
        for (number, line) in code(&text) {
            for function in TRANSCENDENTAL {
                if line.contains(&format!(".{function}("))
                    || line.contains(&format!("f32::{function}"))
                    || line.contains(&format!("f64::{function}"))
                {
                    faults.push(format!("{name}:{number}: `{function}` from the standard library"));
                }
            }
            if line.contains("HashMap") || line.contains("HashSet") {
                faults.push(format!("{name}:{number}: a map whose order changes from run to run"));
            }
        }
    }
    report(&faults);
}

#[test]
fn the_checks_can_fail() {
    assert_eq!(used("use crate::{film::Film, plan};"), ["film", "plan"]);
    assert_eq!(used("    let x = crate::scene::limits::SIDE; crate::math::PI"), ["scene", "math"]);
    let text = "//! Room.\n#[cfg(test)]\nmod tests;\ny.sin() // z.cos()\n#[cfg(test)]\nmod tests {\nw.tan()";
    assert_eq!(code(text), [(1, ""), (4, "y.sin() ")]);
    assert!(is_test("core/src/shift/tests/chain.rs") && is_test("core/src/shift/tests.rs") && !is_test("core/src/shift/hybrid.rs"));
}
