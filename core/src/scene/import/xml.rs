//! XML as a small tree that remembers where each element stands and whether anyone has read it.

use std::cell::Cell;
use std::sync::Arc;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::scene::error::{Error, ErrorKind};

/// Deepest nesting of elements.
const DEPTH: usize = 64;

/// An element with its attributes and children; text between elements is not kept.
#[derive(Debug)]
pub(super) struct Element {
    /// Tag name.
    pub(super) tag: String,
    /// Attributes in the order of the file.
    pub(super) attributes: Vec<(String, String)>,
    /// Elements inside it.
    pub(super) children: Vec<Element>,
    /// Name of the file that it stands in, as errors carry it.
    pub(super) file: Arc<str>,
    /// Line of its start, from 1.
    pub(super) line: usize,
    /// Column of its start, from 1.
    pub(super) column: usize,
    /// Whether something made use of it.
    pub(super) used: Cell<bool>,
}

impl Element {
    /// The value of an attribute.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// The element as people write it: the tag with its `type`, `name` or `id`.
    pub(super) fn shown(&self) -> String {
        let mut shown = format!("<{}", self.tag);
        for key in ["type", "name", "id"] {
            if let Some(value) = self.attribute(key) {
                shown.push_str(&format!(" {key}=\"{value}\""));
            }
        }
        shown.push('>');
        shown
    }

    /// A fault at this element.
    pub(super) fn fault(&self, kind: ErrorKind, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::new(kind, &self.file, &self.shown(), found, expected).at(self.line, self.column)
    }
}

/// Reads a whole document; `file` is the name that errors carry.
///
/// # Errors
/// XML that is not well-formed, text where only elements may stand, nesting deeper than 64 elements, more or less than one root.
pub(super) fn parse(text: &str, file: &str) -> Result<Element, Error> {
    let mut reader = Reader::from_str(text);
    let name: Arc<str> = file.into();
    let mut places = Places { text, offset: 0, line: 1, line_start: 0 };
    let mut open: Vec<Element> = Vec::new();
    let mut root = None;
    loop {
        let (line, column) = places.of(reader.buffer_position() as usize);
        let malformed = |found: String| Error::new(ErrorKind::Malformed, file, "", found, "well-formed XML").at(line, column);
        let event = reader.read_event().map_err(|fault| {
            let (line, column) = places.of(reader.error_position() as usize);
            Error::new(ErrorKind::Malformed, file, "", fault.to_string(), "well-formed XML").at(line, column)
        })?;
        let closed = match event {
            Event::Start(start) => {
                if open.len() >= DEPTH {
                    return Err(Error::new(ErrorKind::TooLarge, file, "", "elements nested too deep", format!("at most {DEPTH} levels")));
                }
                open.push(element(&start, line, column, &name)?);
                None
            }
            Event::Empty(start) => Some(element(&start, line, column, &name)?),
            Event::End(_) => open.pop(),
            Event::Text(found) if !found.iter().all(u8::is_ascii_whitespace) => {
                return Err(malformed(format!("the text {:?}", String::from_utf8_lossy(&found).trim())));
            }
            Event::CData(_) | Event::GeneralRef(_) => return Err(malformed("text between elements".to_string())),
            Event::Text(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => None,
            Event::Eof => break,
        };
        let Some(element) = closed else { continue };
        match open.last_mut() {
            Some(parent) => parent.children.push(element),
            None if root.is_none() => root = Some(element),
            None => return Err(element.fault(ErrorKind::Malformed, "a second root element", "one")),
        }
    }
    if let Some(unclosed) = open.last() {
        return Err(unclosed.fault(ErrorKind::Malformed, "no end of it", format!("</{}>", unclosed.tag)));
    }
    root.ok_or_else(|| Error::new(ErrorKind::Malformed, file, "", "no element at all", "a scene"))
}

fn element(start: &BytesStart<'_>, line: usize, column: usize, file: &Arc<str>) -> Result<Element, Error> {
    let tag = String::from_utf8_lossy(start.name().as_ref()).into_owned();
    let malformed = |found: String| {
        Error::new(ErrorKind::Malformed, file, &format!("<{tag}>"), found, "attributes written name=\"value\"").at(line, column)
    };
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|fault| malformed(fault.to_string()))?;
        let value = attribute.normalized_value(quick_xml::XmlVersion::Explicit1_0).map_err(|fault| malformed(fault.to_string()))?;
        attributes.push((String::from_utf8_lossy(attribute.key.as_ref()).into_owned(), value.into_owned()));
    }
    Ok(Element { tag: tag.clone(), attributes, children: Vec::new(), file: file.clone(), line, column, used: Cell::new(false) })
}

/// Turns byte offsets, which only grow, into lines and columns.
struct Places<'a> {
    text: &'a str,
    offset: usize,
    line: usize,
    line_start: usize,
}

impl Places<'_> {
    fn of(&mut self, offset: usize) -> (usize, usize) {
        let offset = offset.clamp(self.offset, self.text.len());
        for (index, byte) in self.text.as_bytes()[self.offset..offset].iter().enumerate() {
            if *byte == b'\n' {
                self.line += 1;
                self.line_start = self.offset + index + 1;
            }
        }
        self.offset = offset;
        (self.line, offset - self.line_start + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_know_their_place() {
        let root = parse("<?xml version=\"1.0\"?>\n<!-- a -->\n<scene>\n  <a x=\"1 &lt; 2\"/>\n\t<b><c/></b></scene>\n", "t.xml").unwrap();
        assert_eq!((root.tag.as_str(), root.line, root.column), ("scene", 3, 1));
        let [a, b] = &root.children[..] else { panic!("{root:?}") };
        assert_eq!((a.attribute("x"), a.line, a.column), (Some("1 < 2"), 4, 3));
        assert_eq!((b.line, b.children[0].column), (5, 5));
    }

    #[test]
    fn faults_name_their_line() {
        let message = |text: &str| parse(text, "t.xml").unwrap_err().to_string();
        assert!(message("<a>\n<b></c></a>").starts_with("t.xml:2:"), "{}", message("<a>\n<b></c></a>"));
        assert!(message("<a>\n<b>").contains("at <b>: found no end of it, expected </b>"));
        assert!(message("").contains("no element at all"));
        assert!(message("<a/><b/>").contains("second root"));
        assert!(message("<a>\n\n words</a>").contains("the text \"words\""));
        assert!(message("<a x=1/>").starts_with("t.xml:1:1: at <a>"));
        assert!(message("<a x=\"&lol;\"/>").contains("lol"), "no entities of one's own");
        let deep = "<a>".repeat(100_000);
        assert!(message(&deep).contains("nested too deep"));
    }
}
