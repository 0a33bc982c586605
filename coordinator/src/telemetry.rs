//! Log output: one subscriber for the whole process, to standard error.

use std::io::IsTerminal;

use tracing_subscriber::EnvFilter;

/// How log lines look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// Starts logging. `filter` is a level or a list such as `info,gradfarm=debug`; the variable `GRADFARM_LOG` overrides it.
/// A second call changes nothing.
///
/// # Errors
/// If the filter cannot be read; the text says which part.
pub fn start(filter: &str, format: Format) -> Result<(), String> {
    start_as_told(&std::env::var("GRADFARM_LOG").unwrap_or_else(|_| filter.to_owned()), format)
}

/// The same, whatever the variable says.
///
/// # Errors
/// If the filter cannot be read.
pub fn start_as_told(filter: &str, format: Format) -> Result<(), String> {
    let filter = EnvFilter::try_new(filter).map_err(|error| format!("log filter {filter:?}: {error}"))?;
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_target(false);
    let builder = builder.with_ansi(std::io::stderr().is_terminal());
    // Only the first subscriber of a process counts; tests and embedded workers may call this again.
    let _already_set = match format {
        Format::Text => builder.try_init(),
        Format::Json => builder.json().try_init(),
    };
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_filter_is_named() {
        let error = start("gradfarm=loudest", Format::Text).unwrap_err();
        assert!(error.contains("gradfarm=loudest"), "{error}");
    }
}
