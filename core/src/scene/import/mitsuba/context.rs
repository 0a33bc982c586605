//! What reading any Mitsuba element needs: the file's name, its `<default>`s, the report, and the check that nothing was overlooked.

use std::collections::BTreeMap;

use super::super::xml::Element;
use crate::scene::error::{Error, ErrorKind};

/// State of one import.
#[derive(Default)]
pub(super) struct Context<'a> {
    /// The name that errors carry.
    pub(super) file: &'a str,
    /// What was changed or left aside, for people.
    pub(super) report: Vec<String>,
    defaults: BTreeMap<String, String>,
}

impl<'a> Context<'a> {
    pub(super) fn new(file: &'a str) -> Context<'a> {
        Context { file, ..Context::default() }
    }

    /// Refuses scenes of other generations, whose parameters have other names.
    pub(super) fn check_version(&self, root: &Element) -> Result<(), Error> {
        let version = root.attribute("version").unwrap_or_default();
        if version.split('.').next() == Some("3") || version.starts_with("2.") {
            return Ok(());
        }
        Err(self.fault(root, ErrorKind::Unsupported, format!("version {version:?}"), "3.0.0"))
    }

    /// A fault at an element of this file.
    pub(super) fn fault(&self, element: &Element, kind: ErrorKind, found: impl Into<String>, expected: impl Into<String>) -> Error {
        element.fault(kind, self.file, found, expected)
    }

    /// An element that has no counterpart here.
    pub(super) fn unsupported(&self, element: &Element, expected: &str) -> Error {
        self.fault(element, ErrorKind::Unsupported, "something that this renderer cannot honour", expected)
    }

    /// Adds a line to the report.
    pub(super) fn note(&mut self, element: &Element, what: impl AsRef<str>) {
        self.report.push(format!("line {}, {}: {}", element.line, element.shown(), what.as_ref()));
    }

    /// Notes a `<default name value>`.
    pub(super) fn define(&mut self, element: &Element) -> Result<(), Error> {
        let (name, value) = (self.required(element, "name")?, self.required(element, "value")?);
        // The first definition wins, as one from the command line would in Mitsuba.
        self.defaults.entry(name).or_insert(value);
        Ok(())
    }

    /// An attribute with `$name` replaced by what `<default>` says.
    pub(super) fn attribute(&self, element: &Element, name: &str) -> Result<Option<String>, Error> {
        let Some(raw) = element.attribute(name) else { return Ok(None) };
        let mut value = String::new();
        let mut rest = raw;
        while let Some(start) = rest.find('$') {
            value.push_str(&rest[..start]);
            rest = &rest[start + 1..];
            let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
            let (variable, after) = rest.split_at(end);
            let known = || self.defaults.keys().map(|name| format!("${name}")).collect::<Vec<_>>().join(", ");
            value.push_str(self.defaults.get(variable).ok_or_else(|| {
                let expected = format!("a <default> above this line; known are {}", known());
                self.fault(element, ErrorKind::UnknownName, format!("${variable}"), expected)
            })?);
            rest = after;
        }
        value.push_str(rest);
        Ok(Some(value.trim().to_string()))
    }

    /// An attribute that must be there.
    pub(super) fn required(&self, element: &Element, name: &str) -> Result<String, Error> {
        self.attribute(element, name)?
            .ok_or_else(|| self.fault(element, ErrorKind::Malformed, format!("no attribute `{name}`"), format!("{name}=\"…\"")))
    }

    /// The plugin that an element asks for.
    pub(super) fn kind(&self, element: &Element) -> Result<String, Error> {
        self.required(element, "type")
    }

    /// The id of an element, if it has one.
    pub(super) fn id(&self, element: &Element) -> Result<Option<String>, Error> {
        self.attribute(element, "id")
    }

    /// The child called `name`, marked as used. Mitsuba's own scenes of older date write `toWorld` for `to_world`: those are not read.
    pub(super) fn parameter<'e>(&self, element: &'e Element, name: &str) -> Result<Option<&'e Element>, Error> {
        let mut found = None;
        for child in element.children.iter().filter(|child| child.attribute("name") == Some(name)) {
            if found.is_some() {
                return Err(self.fault(child, ErrorKind::Malformed, "the parameter twice", "once"));
            }
            child.used.set(true);
            found = Some(child);
        }
        Ok(found)
    }

    /// The children with this tag, marked as used.
    pub(super) fn tagged<'e>(&self, element: &'e Element, tag: &str) -> Vec<&'e Element> {
        let children: Vec<&Element> = element.children.iter().filter(|child| child.tag == tag).collect();
        children.iter().for_each(|child| child.used.set(true));
        children
    }

    /// Refuses children that nothing has read; `expected` lists those that would have been.
    pub(super) fn finish(&self, element: &Element, expected: &str) -> Result<(), Error> {
        match element.children.iter().find(|child| !child.used.get()) {
            Some(child) => Err(self.unsupported(child, &format!("in {}: {expected}", element.shown()))),
            None => Ok(()),
        }
    }
}
