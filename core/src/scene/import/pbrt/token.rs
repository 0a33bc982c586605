//! The words of a pbrt file: directives, quoted strings, numbers, brackets; `#` starts a comment.

use std::borrow::Cow;

use crate::scene::error::{Error, ErrorKind};

/// A place in a file: line and column from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Spot {
    pub(super) line: usize,
    pub(super) column: usize,
}

/// One word.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token<'a> {
    pub(super) kind: Kind<'a>,
    pub(super) spot: Spot,
}

/// The sorts of words.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind<'a> {
    /// Without quotes: a directive, a number, `true` or `false`.
    Word(&'a str),
    /// In quotes.
    Text(Cow<'a, str>),
    /// `[`
    Open,
    /// `]`
    Close,
}

impl Kind<'_> {
    /// The word as an error message shows it.
    pub(super) fn shown(&self) -> String {
        let cut = |text: &str| text.chars().take(64).collect::<String>();
        match self {
            Kind::Word(word) => cut(word),
            Kind::Text(text) => format!("{:?}", cut(text)),
            Kind::Open => "[".to_string(),
            Kind::Close => "]".to_string(),
        }
    }
}

/// Cuts a text into words, one after the other.
pub(super) struct Tokens<'a> {
    text: &'a str,
    at: usize,
    line: usize,
    line_start: usize,
    /// The name that errors carry.
    pub(super) file: &'a str,
    ahead: Option<Token<'a>>,
}

impl<'a> Tokens<'a> {
    /// From the start of a text.
    pub(super) fn new(text: &'a str, file: &'a str) -> Tokens<'a> {
        Tokens { text, at: 0, line: 1, line_start: 0, file, ahead: None }
    }

    /// The next word; `None` at the end.
    ///
    /// # Errors
    /// A string without an end.
    pub(super) fn next(&mut self) -> Result<Option<Token<'a>>, Error> {
        match self.ahead.take() {
            Some(token) => Ok(Some(token)),
            None => self.cut(),
        }
    }

    /// The next word without taking it.
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub(super) fn peek(&mut self) -> Result<Option<&Token<'a>>, Error> {
        if self.ahead.is_none() {
            self.ahead = self.cut()?;
        }
        Ok(self.ahead.as_ref())
    }

    /// A fault at a place of this text.
    pub(super) fn fault(&self, spot: Spot, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::new(ErrorKind::Malformed, self.file, "", found, expected).at(spot.line, spot.column)
    }

    /// Where the text ends, as far as it was read.
    pub(super) fn spot(&self) -> Spot {
        Spot { line: self.line, column: self.at - self.line_start + 1 }
    }

    fn cut(&mut self) -> Result<Option<Token<'a>>, Error> {
        let bytes = self.text.as_bytes();
        loop {
            match bytes.get(self.at) {
                None => return Ok(None),
                Some(b'\n') => {
                    self.at += 1;
                    self.line += 1;
                    self.line_start = self.at;
                }
                Some(b'#') => self.at += bytes[self.at..].iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len() - self.at),
                Some(byte) if byte.is_ascii_whitespace() => self.at += 1,
                Some(_) => break,
            }
        }
        let spot = self.spot();
        let kind = match bytes[self.at] {
            b'[' => {
                self.at += 1;
                Kind::Open
            }
            b']' => {
                self.at += 1;
                Kind::Close
            }
            b'"' => Kind::Text(self.quoted(spot)?),
            _ => {
                let ends = |byte: &u8| byte.is_ascii_whitespace() || b"\"[]#".contains(byte);
                let length = bytes[self.at..].iter().position(ends).unwrap_or(bytes.len() - self.at);
                let word = &self.text[self.at..self.at + length];
                self.at += length;
                Kind::Word(word)
            }
        };
        Ok(Some(Token { kind, spot }))
    }

    fn quoted(&mut self, spot: Spot) -> Result<Cow<'a, str>, Error> {
        let start = self.at + 1;
        let rest = &self.text[start..];
        let Some(length) = rest.find(['"', '\\', '\n']).filter(|at| rest.as_bytes()[*at] != b'\n') else {
            return Err(self.fault(spot, "a string that does not end on its line", "\""));
        };
        if rest.as_bytes()[length] == b'"' {
            self.at = start + length + 1;
            return Ok(Cow::Borrowed(&rest[..length]));
        }
        let mut text = String::new();
        let mut letters = rest.char_indices();
        while let Some((at, letter)) = letters.next() {
            match letter {
                '"' => {
                    self.at = start + at + 1;
                    return Ok(Cow::Owned(text));
                }
                '\n' => break,
                '\\' => match letters.next() {
                    Some((_, 'n')) => text.push('\n'),
                    Some((_, 't')) => text.push('\t'),
                    Some((_, '\n')) | None => break,
                    Some((_, other)) => text.push(other),
                },
                letter => text.push(letter),
            }
        }
        Err(self.fault(spot, "a string that does not end on its line", "\""))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_places() {
        let mut tokens = Tokens::new("Scale 1 2# three\n [\"a \\\"b\\\"\" -3e4]true\"x\"", "t.pbrt");
        let mut found = Vec::new();
        while let Some(token) = tokens.next().unwrap() {
            found.push((token.kind.shown(), token.spot.line, token.spot.column));
        }
        let expected = [
            ("Scale", 1, 1),
            ("1", 1, 7),
            ("2", 1, 9),
            ("[", 2, 2),
            ("\"a \\\"b\\\"\"", 2, 3),
            ("-3e4", 2, 13),
            ("]", 2, 17),
            ("true", 2, 18),
            ("\"x\"", 2, 22),
        ];
        assert_eq!(found, expected.map(|(word, line, column)| (word.to_string(), line, column)));
    }

    #[test]
    fn a_string_without_an_end_is_named() {
        for text in ["Shape \"sph", "Shape \"sph\nere\"", "Shape \"sph\\", "Shape \"a\\\"b\n"] {
            let mut tokens = Tokens::new(text, "t.pbrt");
            tokens.next().unwrap();
            let message = tokens.next().unwrap_err().to_string();
            assert!(message.starts_with("t.pbrt:1:7: found a string"), "{message}");
        }
    }
}
