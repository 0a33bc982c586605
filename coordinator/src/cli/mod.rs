//! The command line: one file a subcommand. Commands check everything they can before they start to work.

mod accuracy;
mod audit;
mod batch;
mod cancel;
mod client;
mod compare;
mod completions;
mod contest;
mod doctor;
mod error;
mod files;
mod follow;
mod import;
mod join;
mod local;
mod local_farm;
mod measured;
mod method;
mod migrate;
mod options;
mod outputs;
mod pause;
mod peer;
mod placing;
mod plan;
mod progress;
mod pull;
mod reconstruct;
mod render;
mod report;
mod retry;
mod scene;
mod schema;
mod serve;
mod span;
mod status;
mod study;
mod submit;
mod terminal;
mod time;
mod token;
mod view;
mod watch;

use std::process::ExitCode;

use crate::embedded::settings::{self, SettingsError};
use clap::{CommandFactory, Parser, Subcommand};

use error::{EXIT_CODES, Error};

/// A render farm in the gradient domain.
#[derive(Debug, Parser)]
#[command(name = "gradfarm", version, about, max_term_width = 100, after_help = EXIT_CODES)]
#[command(long_about = "\
A render farm in the gradient domain: besides the image itself, workers estimate the differences between neighbouring pixels, \
which are less noisy, and the coordinator reconstructs the image from both.

`gradfarm render` does everything in one process. `gradfarm serve` starts a coordinator that any number of `gradfarm-worker` \
processes serve; submit, status, watch, cancel and pull speak to it.")]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene here and now
    Render(render::Render),
    /// Start a coordinator
    Serve(serve::Serve),
    /// Copy all jobs and blobs to another database and storage
    Migrate(migrate::Migrate),
    /// Hand a scene to a coordinator
    Submit(submit::Submit),
    /// List jobs, or show one
    Status(status::Status),
    /// Follow a job until it ends
    Watch(watch::Watch),
    /// Call a job off
    Cancel(cancel::Cancel),
    /// Let a job wait
    Pause(pause::Pause),
    /// Let a paused job go on
    Resume(pause::Pause),
    /// Try again what failed in a job
    Retry(retry::Retry),
    /// Change how urgent a job is
    Priority(retry::Priority),
    /// Fetch a finished image
    Pull(pull::Pull),
    /// Tell what accuracy cost in a frame, and what more of it would cost
    Accuracy(accuracy::AccuracyCommand),
    /// Issue, list and revoke tokens
    Token(token::TokenCommand),
    /// Issue, list and revoke the tokens with which workers on other machines join
    JoinToken(join::JoinToken),
    /// List the workers that have joined, or throw one out
    Worker(join::WorkerCommand),
    /// Tell who changed what
    Audit(audit::AuditCommand),
    /// Measure how far one image is from another
    Compare(compare::Compare),
    /// Make an image of a primal and its gradients, such as another renderer's
    Reconstruct(reconstruct::Reconstruct),
    /// Tell what would be done with a scene, and why
    Plan(plan::Plan),
    /// Compare techniques at equal time
    Study(study::Study),
    /// Turn a scene of another renderer into gradfarm JSON
    Import(import::Import),
    /// Print the JSON Schema of scenes
    Schema(schema::Schema),
    /// Show an image in the terminal
    View(view::View),
    /// Find what is wrong with a set-up, and say how to mend it
    Doctor(doctor::Doctor),
    /// Print what a shell needs to complete commands
    Completions(completions::Completions),
    /// Write manual pages
    Man(completions::Man),
}

/// Parses the arguments of this process, runs the command, and tells how it ended.
pub fn main() -> ExitCode {
    crate::crypto::provide();
    let cli = match settings::parse::<Cli>(&Cli::command(), Some(serve::SERVE), std::env::args_os().collect()) {
        Ok(cli) => cli,
        Err(SettingsError::Arguments(error)) => error.exit(),
        Err(error) => {
            terminal::note(format_args!("error: {error}"));
            return Error::Usage(String::new()).exit_code();
        }
    };
    match run(cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if !error.is_closed_pipe() {
                terminal::note(format_args!("error: {error}"));
            }
            error.exit_code()
        }
    }
}

/// How a subcommand is defined.
fn definition_of(name: &str) -> clap::Command {
    Cli::command().find_subcommand(name).cloned().unwrap_or_default()
}

fn run(cli: Cli) -> Result<(), Error> {
    match cli.command {
        Command::Render(command) => command.run(),
        Command::Serve(command) => command.run(),
        Command::Migrate(command) => wait_for(command.run()),
        Command::Submit(command) => wait_for(command.run()),
        Command::Status(command) => wait_for(command.run()),
        Command::Watch(command) => wait_for(command.run()),
        Command::Cancel(command) => wait_for(command.run()),
        Command::Pause(command) => wait_for(command.run(true)),
        Command::Resume(command) => wait_for(command.run(false)),
        Command::Retry(command) => wait_for(command.run()),
        Command::Priority(command) => wait_for(command.run()),
        Command::Pull(command) => wait_for(command.run()),
        Command::Accuracy(command) => wait_for(command.run()),
        Command::Token(command) => wait_for(command.run()),
        Command::JoinToken(command) => wait_for(command.run()),
        Command::Worker(command) => wait_for(command.run()),
        Command::Audit(command) => wait_for(command.run()),
        Command::Compare(command) => command.run(),
        Command::Reconstruct(command) => command.run(),
        Command::Plan(command) => command.run(),
        Command::Study(command) => command.run(),
        Command::Import(command) => command.run(),
        Command::Schema(command) => command.run(),
        Command::View(command) => command.run(),
        Command::Doctor(command) => wait_for(command.run()),
        Command::Completions(command) => command.run(),
        Command::Man(command) => command.run(),
    }
}

/// Runs a client's future; Ctrl-C ends it.
fn wait_for(command: impl Future<Output = Result<(), Error>>) -> Result<(), Error> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(no_runtime)?;
    runtime.block_on(async {
        tokio::select! {
            ended = command => ended,
            _ = tokio::signal::ctrl_c() => Err(Error::Interrupted),
        }
    })
}

/// The threads of the asynchronous side. Rendering has its own.
fn runtime() -> Result<tokio::runtime::Runtime, Error> {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().map_err(no_runtime)
}

fn no_runtime(fault: std::io::Error) -> Error {
    Error::Failed(format!("cannot start threads: {fault}"))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_definition_of_the_command_line_is_sound() {
        super::Cli::command().debug_assert();
    }
}
