//! What can be wrong with a scene, said so that a person can mend it: file, place, what was found, what was expected.

use std::fmt;

/// The sort of fault, for programs that react to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// A file is missing or cannot be read.
    Unreadable,
    /// A file name that is not a relative path inside the scene's folder.
    OutsideFolder,
    /// Text or bytes that do not follow the format: syntax, types, missing and unknown fields.
    Malformed,
    /// A well-formed value outside its domain.
    Invalid,
    /// A name that nothing in the scene bears.
    UnknownName,
    /// More than the limits of `scene::limits` allow.
    TooLarge,
    /// Valid in its own format, but not something that this renderer can honour.
    Unsupported,
}

/// Where a fault lies.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// File name as the caller gave it.
    pub file: String,
    /// JSON path (`shapes[3].geometry.sphere.radius`) or element (`<bsdf type="plastic">`); empty for the file as a whole.
    pub path: String,
    /// Line, from 1, where known.
    pub line: Option<usize>,
    /// Column, from 1, where known.
    pub column: Option<usize>,
}

/// A fault in a scene: where it is, what was found there, and what was expected instead.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The sort of fault.
    pub kind: ErrorKind,
    /// Where it lies.
    pub place: Box<Place>,
    /// What stands there.
    pub found: String,
    /// What should stand there.
    pub expected: String,
}

impl Error {
    /// A fault at `path` in `file`.
    pub fn new(kind: ErrorKind, file: &str, path: &str, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = Place { file: file.to_string(), path: path.to_string(), line: None, column: None };
        Error { kind, place: Box::new(place), found: found.into(), expected: expected.into() }
    }

    /// The same fault with its line and column, both from 1.
    pub fn at(mut self, line: usize, column: usize) -> Error {
        self.place.line = Some(line);
        self.place.column = Some(column);
        self
    }
}

impl std::error::Error for Error {}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.place.file)?;
        if let Some(line) = self.place.line {
            write!(f, ":{line}")?;
            if let Some(column) = self.place.column {
                write!(f, ":{column}")?;
            }
        }
        if !self.place.path.is_empty() {
            write!(f, ": at {}", self.place.path)?;
        }
        write!(f, ": found {}", self.found)?;
        if !self.expected.is_empty() {
            write!(f, ", expected {}", self.expected)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_file_place_found_and_expected() {
        let error = Error::new(ErrorKind::Invalid, "a.json", "film.width", "0", "1 to 65536");
        assert_eq!(error.to_string(), "a.json: at film.width: found 0, expected 1 to 65536");
        assert_eq!(error.at(3, 7).to_string(), "a.json:3:7: at film.width: found 0, expected 1 to 65536");
    }
}
