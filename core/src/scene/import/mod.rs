//! Importers: scenes that were written for other renderers, turned into the native description and a report of what changed.

pub(super) mod mitsuba;
mod xml;
