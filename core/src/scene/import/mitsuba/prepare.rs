//! From a file to one plain tree: includes put in their places, `$name`s replaced, names of old generations made new, ids gathered.

use std::collections::BTreeMap;

use super::super::xml::{self, Element};
use super::names::modern;
use crate::scene::assets::{Assets, check_name};
use crate::scene::error::{Error, ErrorKind};

/// Includes inside includes.
const INCLUDE_DEPTH: usize = 16;
/// Files included in all.
const INCLUDES: usize = 256;
/// Bytes that all `$name`s together may stand for: names that stand for names could otherwise grow without end.
const SUBSTITUTED: usize = 1 << 24;

/// A scene as one tree.
pub(super) struct Document {
    /// The root, with nothing but what describes the scene.
    pub(super) root: Element,
    /// Whether it is of the generation 0.x.
    pub(super) old: bool,
    /// Other names of ids, from `<alias id as>`: (other name, id).
    pub(super) aliases: BTreeMap<String, String>,
    /// Folders that files are searched in, from `<path value>`.
    pub(super) folders: Vec<String>,
    /// What was left aside.
    pub(super) report: Vec<String>,
}

/// Reads the text of a scene and what it includes; `file` is the name that errors carry.
///
/// # Errors
/// Malformed XML, another root, an unknown version, unknown `$name`s, includes that cannot be read or go on without end.
pub(super) fn prepare(text: &str, file: &str, assets: &dyn Assets) -> Result<Document, Error> {
    let mut root = xml::parse(text, file)?;
    let old = version(&root)?;
    let mut preparer =
        Preparer { assets, old, defaults: BTreeMap::new(), aliases: BTreeMap::new(), folders: Vec::new(), left: Left::default() };
    preparer.expand(&mut root, 0)?;
    let Preparer { aliases, folders, left, .. } = preparer;
    Ok(Document { root, old, aliases, folders, report: left.report })
}

/// Whether a scene is of the generation 0.x.
fn version(root: &Element) -> Result<bool, Error> {
    if root.tag != "scene" {
        return Err(root.fault(ErrorKind::Malformed, format!("the root <{}>", root.tag), "<scene version=\"3.0.0\">"));
    }
    let version = root.attribute("version").unwrap_or_default();
    let mut parts = version.split('.');
    match (parts.next(), parts.next()) {
        (Some("2" | "3"), _) => Ok(false),
        (Some("0"), Some("4" | "5" | "6")) => Ok(true),
        _ => Err(root.fault(ErrorKind::Unsupported, format!("version {version:?}"), "3.0.0, or one of 0.4 to 0.6 and 2")),
    }
}

/// What may still be done before limits are met, and what was left aside.
#[derive(Default)]
struct Left {
    included: usize,
    substituted: usize,
    report: Vec<String>,
}

struct Preparer<'a> {
    assets: &'a dyn Assets,
    old: bool,
    defaults: BTreeMap<String, String>,
    aliases: BTreeMap<String, String>,
    folders: Vec<String>,
    left: Left,
}

impl Preparer<'_> {
    /// Prepares what stands in an element. The nesting is bounded by the reader's limit.
    fn expand(&mut self, element: &mut Element, depth: usize) -> Result<(), Error> {
        let mut kept = Vec::with_capacity(element.children.len());
        for mut child in std::mem::take(&mut element.children) {
            self.substitute(&mut child)?;
            if self.old {
                self.modernise(&mut child);
            }
            match child.tag.as_str() {
                "default" => self.define(&child)?,
                "include" => kept.extend(self.include(&child, depth)?),
                "path" => {
                    let folder = required(&child, "value")?;
                    self.folders.push(folder.trim_start_matches("./").trim_end_matches('/').to_string());
                }
                "alias" => {
                    self.aliases.insert(required(&child, "as")?.to_string(), required(&child, "id")?.to_string());
                }
                // Says which dialog of Mitsuba's own program opens.
                "mode" if self.old => {}
                _ => {
                    self.expand(&mut child, depth)?;
                    kept.push(child);
                }
            }
        }
        element.children = kept;
        Ok(())
    }

    fn define(&mut self, element: &Element) -> Result<(), Error> {
        let (name, value) = (required(element, "name")?, required(element, "value")?);
        // The first definition wins, as one from the command line would in Mitsuba.
        self.defaults.entry(name.to_string()).or_insert_with(|| value.to_string());
        Ok(())
    }

    /// The elements of another file's root.
    fn include(&mut self, element: &Element, depth: usize) -> Result<Vec<Element>, Error> {
        let name = required(element, "filename")?.trim_start_matches("./").to_string();
        check_name(&name).map_err(|expected| element.fault(ErrorKind::OutsideFolder, format!("{name:?}"), expected))?;
        self.left.included += 1;
        if depth >= INCLUDE_DEPTH || self.left.included > INCLUDES {
            let expected = format!("at most {INCLUDES} includes, nested at most {INCLUDE_DEPTH} deep");
            return Err(element.fault(ErrorKind::TooLarge, "one include too many", expected));
        }
        let bytes = self.assets.open(&name).map_err(|fault| element.fault(fault.kind, fault.to_string(), "a file beside the scene"))?;
        let text =
            String::from_utf8(bytes).map_err(|_| element.fault(ErrorKind::Malformed, "bytes that are not UTF-8", "text in UTF-8"))?;
        let mut root = xml::parse(&text, &name)?;
        let of_its_own = version(&root)?;
        let outer = std::mem::replace(&mut self.old, of_its_own);
        self.expand(&mut root, depth + 1)?;
        self.old = outer;
        Ok(root.children)
    }

    /// Replaces `$name` in every attribute by what `<default>` says.
    fn substitute(&mut self, element: &mut Element) -> Result<(), Error> {
        for at in 0..element.attributes.len() {
            let raw = &element.attributes[at].1;
            if !raw.contains('$') {
                continue;
            }
            let value = replaced(raw, &self.defaults, SUBSTITUTED - self.left.substituted).map_err(|fault| match fault {
                Unreplaced::Unknown(variable) => {
                    let known: Vec<String> = self.defaults.keys().map(|name| format!("${name}")).collect();
                    let expected = format!("a <default> above this line; known are {}", known.join(", "));
                    element.fault(ErrorKind::UnknownName, format!("${variable}"), expected)
                }
                Unreplaced::TooLong => {
                    element.fault(ErrorKind::TooLarge, "names that stand for too much", format!("at most {SUBSTITUTED} bytes in all"))
                }
            })?;
            self.left.substituted += value.len();
            element.attributes[at].1 = value;
        }
        Ok(())
    }

    /// Gives an element of the generation 0.x its name of today.
    fn modernise(&self, element: &mut Element) {
        element.tag = modern(&element.tag);
        // What emitters were called before 0.5.
        if ["luminaire", "camera"].contains(&element.tag.as_str()) {
            element.tag = if element.tag == "camera" { "sensor" } else { "emitter" }.to_string();
        }
        for (key, value) in &mut element.attributes {
            if key == "name" {
                *value = modern(value);
            }
        }
    }
}

/// Why a text with `$name`s has no value.
enum Unreplaced {
    Unknown(String),
    TooLong,
}

fn replaced(raw: &str, defaults: &BTreeMap<String, String>, most: usize) -> Result<String, Unreplaced> {
    let mut value = String::new();
    let mut rest = raw;
    while let Some(start) = rest.find('$') {
        value.push_str(&rest[..start]);
        rest = &rest[start + 1..];
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (variable, after) = rest.split_at(end);
        value.push_str(defaults.get(variable).ok_or_else(|| Unreplaced::Unknown(variable.to_string()))?);
        if value.len() > most {
            return Err(Unreplaced::TooLong);
        }
        rest = after;
    }
    value.push_str(rest);
    if value.len() > most { Err(Unreplaced::TooLong) } else { Ok(value) }
}

fn required<'e>(element: &'e Element, name: &str) -> Result<&'e str, Error> {
    let value = element.attribute(name);
    value.ok_or_else(|| element.fault(ErrorKind::Malformed, format!("no attribute `{name}`"), format!("{name}=\"…\"")))
}
