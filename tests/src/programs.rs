//! The two programs, built, for tests that run them as a person would.

use std::path::PathBuf;
use std::process::Command;

/// The programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// `gradfarm`: coordinator and command line.
    Gradfarm,
    /// `gradfarm-worker`.
    Worker,
}

impl Program {
    /// Its name, which is also that of its package.
    pub fn name(self) -> &'static str {
        match self {
            Program::Gradfarm => "gradfarm",
            Program::Worker => "gradfarm-worker",
        }
    }

    /// Where it lies. `cargo test --workspace` has built it, since its package has tests that run it; if only this package's
    /// tests were asked for, it is built now unless it is there.
    ///
    /// # Errors
    /// If it is not there and cannot be built.
    pub fn path(self) -> Result<PathBuf, String> {
        // Tests run from …/target/PROFILE/deps.
        let tests = std::env::current_exe().map_err(|fault| format!("where am I? {fault}"))?;
        let folder = tests.parent().and_then(|deps| deps.parent()).ok_or("the test lies in no target folder")?;
        let path = folder.join(format!("{}{}", self.name(), std::env::consts::EXE_SUFFIX));
        if !path.is_file() {
            let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
            let mut build = Command::new(cargo);
            build.args(["build", "--package", self.name(), "--bin", self.name()]);
            if folder.file_name().is_some_and(|name| name == "release") {
                build.arg("--release");
            }
            let status = build.status().map_err(|fault| format!("cargo: {fault}"))?;
            if !status.success() || !path.is_file() {
                return Err(format!("{} could not be built: {status}", path.display()));
            }
        }
        Ok(path)
    }
}
