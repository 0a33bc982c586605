//! The only place that writes to standard output and standard error.

use std::fmt::Display;
use std::io::Write;
use std::path::PathBuf;

use serde::Serialize;

use super::error::Error;

/// Writes one line to standard output and flushes it, so that a reader behind a pipe sees it at once.
///
/// # Errors
/// [`Error::Write`] if nobody reads.
pub(super) fn line(text: impl Display) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}").and_then(|()| out.flush()).map_err(|source| Error::Write { path: PathBuf::from("standard output"), source })
}

/// Writes something as one line of JSON to standard output.
///
/// # Errors
/// [`Error::Write`] if nobody reads.
pub(super) fn json(value: &impl Serialize) -> Result<(), Error> {
    line(serde_json::to_string(value).map_err(|fault| Error::Failed(format!("cannot be told as JSON: {fault}")))?)
}

/// Tells a person something on standard error. If even that fails there is nobody to tell.
pub(super) fn note(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Warns a person on standard error.
pub(super) fn warn(text: impl Display) {
    note(format_args!("warning: {text}"));
}
