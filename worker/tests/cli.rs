//! The worker's command line over the real program.

#![allow(clippy::unwrap_used)]

use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gradfarm-worker"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GRADFARM_")) {
        command.env_remove(name);
    }
    command.args(arguments).output().unwrap()
}

#[test]
fn help_tells_what_it_does_and_how_it_ends() {
    let output = run(&["--help"]);
    let text = String::from_utf8(output.stdout).unwrap();
    for said in ["--coordinator <URL>", "--threads <N>", "--cache <DIR>", "SIGTERM", "Exit codes", "Example"] {
        assert!(text.contains(said), "{said} is missing from\n{text}");
    }
}

#[test]
fn nonsense_is_named() {
    assert_eq!(run(&["--thread", "2"]).status.code(), Some(2));
    for (arguments, said) in [
        (&["--coordinator", "ftp://nowhere"][..], "expected an address such as http://"),
        (&["--threads", "0"], "threads is 0, expected 1 to"),
        (&["--log", "gradfarm=loudest"], "gradfarm=loudest"),
    ] {
        let output = run(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains(said), "{said} is missing from\n{text}");
    }
}
