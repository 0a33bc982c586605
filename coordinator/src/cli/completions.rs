//! `gradfarm completions` and `gradfarm man`: what shells and manuals want to know of the command line.

use std::path::{Path, PathBuf};

use clap::CommandFactory;
use clap_complete::Shell;

use super::error::Error;
use super::{Cli, terminal};

/// Arguments of `gradfarm completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gradfarm completions bash > ~/.local/share/bash-completion/completions/gradfarm
  gradfarm completions zsh > ~/.zfunc/_gradfarm
  gradfarm completions fish > ~/.config/fish/completions/gradfarm.fish")]
pub(super) struct Completions {
    /// For which shell
    shell: Shell,
}

/// Arguments of `gradfarm man`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gradfarm man ~/.local/share/man/man1
  man gradfarm-render")]
pub(super) struct Man {
    /// Folder for the pages, one for each command; made if it is not there
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl Completions {
    /// Prints the script.
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "gradfarm", &mut script);
        terminal::line(String::from_utf8_lossy(&script).trim_end())
    }
}

impl Man {
    /// Writes the pages.
    pub(super) fn run(&self) -> Result<(), Error> {
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |source| Error::Write { path, source }
        };
        std::fs::create_dir_all(&self.folder).map_err(failed(&self.folder))?;
        clap_mangen::generate_to(Cli::command(), &self.folder).map_err(failed(&self.folder))?;
        terminal::line(format_args!("{}", self.folder.join("gradfarm.1").display()))
    }
}
