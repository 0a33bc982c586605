//! Names for what importers bring into the description: those of the file where they serve, each once.

use std::collections::{BTreeMap, BTreeSet};

/// The names given so far to things of one sort.
#[derive(Debug, Default)]
pub(super) struct Naming {
    used: BTreeSet<String>,
    next: BTreeMap<String, u64>,
}

impl Naming {
    /// A name that was not given yet: `name` made fit for files and people, or `plain` if nothing is left of it, with a number behind it
    /// where it is taken.
    pub(super) fn fresh(&mut self, name: &str, plain: &str) -> String {
        let fit: String = name.chars().take(64).map(|c| if c.is_alphanumeric() || " ._-".contains(c) { c } else { '_' }).collect();
        let fit = fit.trim().trim_matches('.');
        let base = if fit.is_empty() { plain.to_string() } else { fit.to_string() };
        let next = self.next.entry(base.clone()).or_insert(1);
        loop {
            let name = if *next == 1 { base.clone() } else { format!("{base} {next}") };
            *next += 1;
            if self.used.insert(name.clone()) {
                return name;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_fit_and_never_twice_the_same() {
        let mut naming = Naming::default();
        let names = ["a", "a 2", "a", "a", "../b:c\n", "..", "", "Ä b"].map(|name| naming.fresh(name, "thing"));
        assert_eq!(names, ["a", "a 2", "a 3", "a 4", "_b_c_", "thing", "thing 2", "Ä b"]);
    }
}
