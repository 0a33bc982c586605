//! How much of a format comes over: tables that tests try out, row by row, and that `docs/formats.md` shows.

use std::fmt::Write;

use super::Imported;
use crate::scene::error::Error;

/// What becomes of an element of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    /// It comes over as it is.
    Honoured,
    /// Something like it comes over, and the report says so.
    Approximated,
    /// It is left out or left aside, and the report says so.
    LeftOut,
    /// An error names it.
    Refused,
}

impl Fate {
    const ALL: [Fate; 4] = [Fate::Honoured, Fate::Approximated, Fate::LeftOut, Fate::Refused];

    fn word(self) -> &'static str {
        match self {
            Fate::Honoured => "honoured",
            Fate::Approximated => "approximated",
            Fate::LeftOut => "left out",
            Fate::Refused => "refused",
        }
    }
}

/// One element of a format: its kind, its name, what becomes of it, and a remark.
pub(super) struct Row {
    pub(super) kind: &'static str,
    pub(super) name: &'static str,
    pub(super) fate: Fate,
    pub(super) remark: &'static str,
}

/// What is wrong with the table, held against what an importer made of a scene with the element. `usual` are the lines that the report has
/// without it.
pub(super) fn fault(row: &Row, imported: Result<Imported, Error>, usual: &[String]) -> Option<String> {
    let Row { kind, name, fate, .. } = row;
    let (agrees, found) = match imported {
        Err(fault) => (*fate == Fate::Refused, fault.to_string()),
        Ok(imported) => {
            let new: Vec<&String> = imported.report.iter().filter(|line| !usual.contains(line)).collect();
            let left = new.iter().any(|line| line.contains("left out") || line.contains("left aside"));
            let agrees = match fate {
                Fate::Honoured => new.is_empty(),
                Fate::Approximated => !new.is_empty(),
                Fate::LeftOut => left,
                Fate::Refused => false,
            };
            (agrees, format!("the report {new:?}"))
        }
    };
    (!agrees).then(|| format!("{kind} {name} is not {}: {found}", fate.word()))
}

/// Holds the section of `docs/formats.md` between the format's marks against the table.
pub(super) fn check_document(format: &str, rows: &[Row]) {
    let section = section(rows);
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/formats.md");
    let text = std::fs::read_to_string(path).unwrap();
    let (start, end) = (format!("<!-- {format}: this table is written by a test -->\n"), format!("<!-- end of {format} -->"));
    let found = text.split_once(&start).and_then(|(_, rest)| rest.split_once(&end)).map(|(section, _)| section);
    assert!(found == Some(&section), "between {start:?} and {end:?} in docs/formats.md there must stand:\n{section}");
}

fn section(rows: &[Row]) -> String {
    let count = |kind: Option<&str>, fate| rows.iter().filter(|row| kind.is_none_or(|kind| row.kind == kind) && row.fate == fate).count();
    let mut kinds: Vec<&str> = rows.iter().map(|row| row.kind).collect();
    kinds.dedup();
    let mut text = "| kind | honoured | approximated | left out | refused |\n|---|---|---|---|---|\n".to_string();
    for kind in &kinds {
        let [a, b, c, d] = Fate::ALL.map(|fate| count(Some(kind), fate));
        writeln!(text, "| {kind} | {a} | {b} | {c} | {d} |").unwrap();
    }
    let [a, b, c, d] = Fate::ALL.map(|fate| count(None, fate));
    writeln!(text, "| **all** | **{a}** | **{b}** | **{c}** | **{d}** |\n").unwrap();
    text.push_str("| kind | element | | remark |\n|---|---|---|---|\n");
    for Row { kind, name, fate, remark } in rows {
        writeln!(text, "| {kind} | `{name}` | {} | {remark} |", fate.word()).unwrap();
    }
    text
}
