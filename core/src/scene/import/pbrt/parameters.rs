//! Typed parameters: `"float radius" 2`, `"rgb L" [1 2 3]`, `"texture reflectance" "wood"`.

use std::cell::Cell;

use super::token::{Kind, Spot, Tokens};
use crate::scene::error::{Error, ErrorKind};

/// What a parameter says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    Flags(Vec<bool>),
}

/// One parameter.
#[derive(Clone, Debug)]
pub(super) struct Parameter {
    /// Its type: `float`, `rgb`, `texture`, …
    pub(super) kind: String,
    pub(super) name: String,
    pub(super) values: Values,
    pub(super) spot: Spot,
    used: Cell<bool>,
}

/// The parameters of one directive.
#[derive(Clone, Debug, Default)]
pub(super) struct Parameters {
    pub(super) list: Vec<Parameter>,
    /// The directive as people write it: `Shape "sphere"`.
    pub(super) title: String,
    /// Where it stands.
    pub(super) spot: Spot,
    /// The file it stands in.
    pub(super) file: String,
}

impl Parameters {
    /// Reads the parameters that follow.
    ///
    /// # Errors
    /// Anything that is no `"type name" value` pair.
    pub(super) fn read(tokens: &mut Tokens<'_>, title: String, spot: Spot) -> Result<Parameters, Error> {
        let mut parameters = Parameters { list: Vec::new(), title, spot, file: tokens.file.to_string() };
        while matches!(tokens.peek()?, Some(token) if matches!(token.kind, Kind::Text(_))) {
            let Some(token) = tokens.next()? else { break };
            let Kind::Text(declaration) = &token.kind else { break };
            let mut words = declaration.split_ascii_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                return Err(tokens.fault(token.spot, token.kind.shown(), "\"type name\" of a parameter"));
            };
            let values = values(tokens, token.spot, &token.kind)?;
            let (kind, name) = (kind.to_string(), name.to_string());
            parameters.list.push(Parameter { kind, name, values, spot: token.spot, used: Cell::new(false) });
        }
        Ok(parameters)
    }

    /// The parameter of this name, if it is there; it counts as read.
    pub(super) fn get(&self, name: &str) -> Option<&Parameter> {
        let found = self.list.iter().find(|parameter| parameter.name == name);
        if let Some(found) = found {
            found.used.set(true);
        }
        found
    }

    /// Lets parameters count as read that have no bearing on the picture.
    pub(super) fn pass_over(&self, names: &[&str]) {
        for parameter in self.list.iter().filter(|parameter| names.contains(&parameter.name.as_str())) {
            parameter.used.set(true);
        }
    }

    /// Those that nothing has read.
    pub(super) fn unread(&self) -> impl Iterator<Item = &Parameter> {
        self.list.iter().filter(|parameter| !parameter.used.get())
    }

    /// A fault at a parameter.
    pub(super) fn fault(&self, parameter: &Parameter, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let path = format!("{} {:?}", self.title, parameter.name);
        Error::new(ErrorKind::Malformed, &self.file, &path, found, expected).at(parameter.spot.line, parameter.spot.column)
    }

    /// A fault of the whole directive.
    pub(super) fn fault_here(&self, kind: ErrorKind, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::new(kind, &self.file, &self.title, found, expected).at(self.spot.line, self.spot.column)
    }

    /// All numbers of a parameter.
    pub(super) fn numbers(&self, name: &str) -> Result<Option<&[f64]>, Error> {
        let Some(parameter) = self.get(name) else { return Ok(None) };
        match &parameter.values {
            Values::Numbers(numbers) => Ok(Some(numbers)),
            _ => Err(self.fault(parameter, "words", "numbers")),
        }
    }

    /// One number.
    pub(super) fn number(&self, name: &str) -> Result<Option<f64>, Error> {
        match self.numbers(name)? {
            None => Ok(None),
            Some([number]) => Ok(Some(*number)),
            Some(numbers) => {
                let found = format!("{} numbers", numbers.len());
                Err(self.get(name).map_or_else(|| self.fault_here(ErrorKind::Malformed, &found, "one"), |p| self.fault(p, &found, "one")))
            }
        }
    }

    /// One number, or what it is when the file says nothing.
    pub(super) fn number_or(&self, name: &str, default: f64) -> Result<f64, Error> {
        Ok(self.number(name)?.unwrap_or(default))
    }

    /// Groups of `N` numbers, such as points.
    pub(super) fn vectors<const N: usize>(&self, name: &str) -> Result<Option<Vec<[f64; N]>>, Error> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        let (groups, rest) = numbers.as_chunks::<N>();
        match (rest, self.get(name)) {
            ([_, ..], Some(parameter)) => Err(self.fault(parameter, format!("{} numbers", numbers.len()), format!("groups of {N}"))),
            _ => Ok(Some(groups.to_vec())),
        }
    }

    /// One group of `N` numbers, or what it is when the file says nothing.
    pub(super) fn vector_or<const N: usize>(&self, name: &str, default: [f64; N]) -> Result<[f64; N], Error> {
        Ok(self.vectors::<N>(name)?.and_then(|vectors| vectors.first().copied()).unwrap_or(default))
    }

    /// Whole numbers that are not negative, such as indices.
    pub(super) fn indices(&self, name: &str) -> Result<Option<Vec<u32>>, Error> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        let whole = |number: &f64| {
            let fits = *number >= 0.0 && *number <= f64::from(u32::MAX) && number.fract() == 0.0;
            fits.then_some(*number as u32).ok_or(*number)
        };
        let found: Result<Vec<u32>, f64> = numbers.iter().map(whole).collect();
        match (found, self.get(name)) {
            (Ok(found), _) => Ok(Some(found)),
            (Err(number), Some(parameter)) => Err(self.fault(parameter, number.to_string(), "whole numbers ≥ 0")),
            (Err(number), None) => Err(self.fault_here(ErrorKind::Malformed, number.to_string(), "whole numbers ≥ 0")),
        }
    }

    /// One whole number that is not negative.
    pub(super) fn index(&self, name: &str) -> Result<Option<u32>, Error> {
        Ok(self.indices(name)?.and_then(|indices| indices.first().copied()))
    }

    /// All strings of a parameter.
    pub(super) fn texts(&self, name: &str) -> Result<Option<&[String]>, Error> {
        let Some(parameter) = self.get(name) else { return Ok(None) };
        match &parameter.values {
            Values::Texts(texts) => Ok(Some(texts)),
            _ => Err(self.fault(parameter, "numbers", "words in quotes")),
        }
    }

    /// One string.
    pub(super) fn text(&self, name: &str) -> Result<Option<&str>, Error> {
        Ok(self.texts(name)?.and_then(|texts| texts.first()).map(String::as_str))
    }

    /// True or false.
    pub(super) fn flag(&self, name: &str) -> Result<Option<bool>, Error> {
        let Some(parameter) = self.get(name) else { return Ok(None) };
        match &parameter.values {
            Values::Flags(flags) => Ok(flags.first().copied()),
            Values::Texts(texts) => match texts.first().map(String::as_str) {
                Some("true") => Ok(Some(true)),
                Some("false") => Ok(Some(false)),
                _ => Err(self.fault(parameter, "something else", "true or false")),
            },
            Values::Numbers(_) => Err(self.fault(parameter, "numbers", "true or false")),
        }
    }
}

/// What follows the name: one value, or several in brackets, all of one sort.
fn values(tokens: &mut Tokens<'_>, spot: Spot, declaration: &Kind<'_>) -> Result<Values, Error> {
    let missing = |tokens: &Tokens<'_>| tokens.fault(spot, format!("no value after {}", declaration.shown()), "a value, or some in [ ]");
    let mut values = None;
    let bracketed = match tokens.peek()?.map(|token| &token.kind) {
        Some(Kind::Open) => {
            tokens.next()?;
            true
        }
        _ => false,
    };
    loop {
        let Some(token) = tokens.next()? else { return Err(missing(tokens)) };
        match (&token.kind, &mut values) {
            (Kind::Close, _) if bracketed => return Ok(values.unwrap_or(Values::Numbers(Vec::new()))),
            (Kind::Open | Kind::Close, _) => return Err(missing(tokens)),
            (Kind::Text(text), None) => values = Some(Values::Texts(vec![text.to_string()])),
            (Kind::Text(text), Some(Values::Texts(texts))) => texts.push(text.to_string()),
            (Kind::Word(word @ ("true" | "false")), None) => values = Some(Values::Flags(vec![*word == "true"])),
            (Kind::Word(word @ ("true" | "false")), Some(Values::Flags(flags))) => flags.push(*word == "true"),
            (Kind::Word(word), None | Some(Values::Numbers(_))) => {
                let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
                let number = number.ok_or_else(|| tokens.fault(token.spot, token.kind.shown(), "a finite number"))?;
                match &mut values {
                    Some(Values::Numbers(numbers)) => numbers.push(number),
                    _ => values = Some(Values::Numbers(vec![number])),
                }
            }
            _ => return Err(tokens.fault(token.spot, token.kind.shown(), "values of one sort")),
        }
        if !bracketed && let Some(values) = values {
            return Ok(values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Parameters, Error> {
        Parameters::read(&mut Tokens::new(text, "t.pbrt"), "Shape \"sphere\"".to_string(), Spot { line: 1, column: 1 })
    }

    #[test]
    fn parameters_are_read_by_type_and_what_is_left_is_told() {
        let read = read("\"float radius\" 2 \"point3 P\" [0 1 2 3 4 5] \"string filename\" [\"a.ply\"] \"bool on\" true \"integer n\" [7]")
            .unwrap();
        assert_eq!(read.number("radius").unwrap(), Some(2.0));
        assert_eq!(read.vectors::<3>("P").unwrap().unwrap(), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
        assert_eq!((read.text("filename").unwrap(), read.flag("on").unwrap()), (Some("a.ply"), Some(true)));
        assert_eq!(read.unread().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["n"]);
        assert_eq!(read.index("n").unwrap(), Some(7));
    }

    #[test]
    fn faults_are_named_with_their_place() {
        for (text, part) in [
            ("\"float\" 2", "t.pbrt:1:1: found \"float\""),
            ("\"float r\"", "no value after \"float r\""),
            ("\"float r\" [1 2", "no value after"),
            ("\"float r\" ]", "no value after"),
            ("\"float r\" [1 \"a\"]", "t.pbrt:1:14: found \"a\", expected values of one sort"),
            ("\"float r\" 1e999", "1e999, expected a finite number"),
            ("\"float r\" nan", "nan"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text} gave {message}");
        }
        let numbers = read("\"point3 P\" [1 2 3 4] \"integer i\" [-1]").unwrap();
        assert!(numbers.vectors::<3>("P").unwrap_err().to_string().contains("4 numbers, expected groups of 3"));
        assert!(numbers.indices("i").unwrap_err().to_string().contains("-1"));
        assert!(numbers.number("P").is_err() && numbers.text("P").is_err() && numbers.flag("P").is_err());
    }
}
