//! `gradfarm schema`: the JSON Schema of scenes, for editors and checkers.

use gradfarm_core::scene::description;

use super::error::Error;
use super::terminal;

/// Arguments of `gradfarm schema`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  gradfarm schema > scene.schema.json

Editors that know JSON Schema then complete and check scenes as they are written.")]
pub(super) struct Schema {}

impl Schema {
    /// Prints the schema.
    pub(super) fn run(&self) -> Result<(), Error> {
        terminal::line(format_args!("{:#}", description::json_schema()))
    }
}
