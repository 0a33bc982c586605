//! What `submit` asks of the farm: whose job it is, who may render it, how much of the farm it takes.

use clap::Args;

use crate::api::submission::JobOptions;
use crate::job::needs;

/// Whose job it is and who may render it.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Farm")]
pub(super) struct PlacingOptions {
    /// Project that it belongs to; projects share the farm by their weights
    #[arg(long, value_name = "NAME", value_parser = needs::name)]
    project: Option<String>,
    /// Only workers of this pool; of one of them if given more than once
    #[arg(long = "pool", value_name = "NAME", value_delimiter = ',')]
    pools: Vec<String>,
    /// What a worker must have, such as gpu, memory=8G or threads=16; all of it if given more than once
    #[arg(long = "require", value_name = "WHAT", value_delimiter = ',')]
    requires: Vec<String>,
    /// A named limit of the farm that it counts against
    #[arg(long = "limit", value_name = "NAME", value_delimiter = ',')]
    limits: Vec<String>,
    /// Most workers at once
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_workers: Option<u32>,
    /// Share of its units that are rendered by two workers and compared, 0 to 1 [default: that of the farm]
    #[arg(long, value_name = "SHARE", value_parser = crate::config::share)]
    verify: Option<f64>,
    /// Wait for `gradfarm resume` before anything is rendered
    #[arg(long)]
    paused: bool,
}

impl PlacingOptions {
    /// Adds what is asked for to a submission.
    pub(super) fn ask(&self, options: JobOptions) -> JobOptions {
        let listed = |names: &[String]| (!names.is_empty()).then(|| names.join(","));
        JobOptions {
            project: self.project.clone(),
            pool: listed(&self.pools),
            require: listed(&self.requires),
            limit: listed(&self.limits),
            max_workers: self.max_workers,
            verify: self.verify,
            paused: self.paused.then_some(true),
            ..options
        }
    }
}
