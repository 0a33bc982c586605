//! Fair shares between projects: who has had least of the farm, for its weight, goes first.
//!
//! Each project has a virtual time: the processor seconds that it was given, divided by its weight. A grant is charged at once with what a unit
//! of its job usually takes, and corrected when the unit is done, so that one project cannot take all workers before its first result comes
//! in. A project that had nothing to do for a while begins where those that are at work are: what it did not use is not saved up.

use std::collections::{BTreeMap, BTreeSet};

/// What a unit of a job is charged with before any of it is done [s].
const UNKNOWN: f64 = 1.0;

/// What projects were given.
#[derive(Clone, Debug, Default)]
pub struct Shares {
    weights: BTreeMap<String, f64>,
    /// Virtual times [s], of projects that were ever at work.
    times: BTreeMap<String, f64>,
    active: BTreeSet<String>,
}

impl Shares {
    /// Nothing was given to anybody. Projects without a weight above 0 have 1.
    pub fn new(weights: BTreeMap<String, f64>) -> Self {
        let weights = weights.into_iter().filter(|(_, weight)| weight.is_finite() && *weight > 0.0).collect();
        Self { weights, ..Self::default() }
    }

    /// A project's weight.
    pub fn weight(&self, project: &str) -> f64 {
        self.weights.get(project).copied().unwrap_or(1.0)
    }

    /// A project's virtual time [s]; the least goes first.
    pub fn time(&self, project: &str) -> f64 {
        self.times.get(project).copied().unwrap_or(0.0)
    }

    /// Says which projects have something to do from now on. Those that had nothing catch up with the least of the others.
    pub fn activate(&mut self, now: BTreeSet<String>) {
        let stayed = now.iter().filter(|project| self.active.contains(*project)).map(|project| self.time(project));
        // Where nobody stayed, the last who were at work say where things stand.
        let floor = stayed.min_by(f64::total_cmp).or_else(|| self.active.iter().map(|p| self.time(p)).max_by(f64::total_cmp));
        for project in now.iter().filter(|project| !self.active.contains(*project)) {
            let time = self.time(project).max(floor.unwrap_or(0.0));
            self.times.insert(project.clone(), time);
        }
        self.active = now;
    }

    /// Charges a project with a grant of a job whose units usually take so long [s] (0: nobody knows yet); what it was charged with [s].
    pub fn grant(&mut self, project: &str, usual: f64) -> f64 {
        let seconds = if usual > 0.0 && usual.is_finite() { usual } else { UNKNOWN };
        self.charge(project, seconds);
        seconds
    }

    /// Charges a project with processor seconds; below zero gives back.
    pub fn charge(&mut self, project: &str, seconds: f64) {
        if seconds.is_finite() {
            let weight = self.weight(project);
            *self.times.entry(project.to_owned()).or_insert(0.0) += seconds / weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Projects that always have something to do, on so many workers: each takes a unit when it is free, from whoever has had least.
    /// Returns the processor seconds that each got, and the longest row of grants that passed one over.
    fn run(weights: &[f64], costs: &[f64], workers: usize, grants: usize) -> (Vec<f64>, usize) {
        let names: Vec<String> = (0..weights.len()).map(|k| format!("p{k}")).collect();
        let mut shares = Shares::new(names.iter().cloned().zip(weights.iter().copied()).collect());
        shares.activate(names.iter().cloned().collect());
        let (mut got, mut passed, mut longest) = (vec![0.0; names.len()], vec![0; names.len()], 0);
        let mut busy: Vec<(f64, Option<(usize, f64)>)> = vec![(0.0, None); workers];
        let mut done = vec![(0.0, 0u32); names.len()];
        for step in 0..grants {
            let (slot, _) = busy.iter().enumerate().min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0)).unwrap();
            let (now, finished) = busy[slot];
            if let Some((project, charged)) = finished {
                // Units of a project differ by half of what they usually take.
                let cost = costs[project] * if step % 2 == 0 { 0.5 } else { 1.5 };
                shares.charge(&names[project], cost - charged);
                got[project] += cost;
                done[project] = (done[project].0 + cost, done[project].1 + 1);
            }
            let next = (0..names.len()).min_by(|a, b| shares.time(&names[*a]).total_cmp(&shares.time(&names[*b]))).unwrap();
            let usual = if done[next].1 == 0 { 0.0 } else { done[next].0 / f64::from(done[next].1) };
            let charged = shares.grant(&names[next], usual);
            passed.iter_mut().enumerate().for_each(|(k, row)| *row = if k == next { 0 } else { *row + 1 });
            longest = longest.max(passed.iter().copied().max().unwrap());
            busy[slot] = (now + costs[next], Some((next, charged)));
        }
        (got, longest)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn in_the_long_run_everybody_has_the_share_of_its_weight(
            projects in prop::collection::vec((0.5..4.0f64, 0.1..3.0f64), 2..5),
            workers in 1usize..20,
        ) {
            let (weights, costs): (Vec<f64>, Vec<f64>) = projects.into_iter().unzip();
            let (got, longest) = run(&weights, &costs, workers, 20_000);
            let (sum, all): (f64, f64) = (got.iter().sum(), weights.iter().sum());
            for (got, weight) in got.iter().zip(&weights) {
                let (found, due) = (got / sum, weight / all);
                prop_assert!((found - due).abs() < 0.05, "{found} instead of {due}: {weights:?}, {costs:?}");
            }
            // The one with the least weight against units as small as can be, and the start, where nobody knows what units take.
            prop_assert!(longest < 2000, "nobody starves: {longest} grants in a row passed one over");
        }

        #[test]
        fn who_was_away_neither_saved_up_nor_lost_anything(before in 1.0..1e6f64, rest in 0.0..1e3f64) {
            let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<BTreeSet<String>>();
            let mut shares = Shares::new(BTreeMap::new());
            shares.activate(names(&["busy"]));
            shares.charge("busy", before);
            shares.activate(names(&["busy", "new"]));
            prop_assert_eq!(shares.time("new"), before);
            shares.charge("new", rest);
            shares.activate(names(&["busy"]));
            shares.activate(names(&["busy", "new"]));
            prop_assert_eq!(shares.time("new"), before + rest, "coming and going gives no advantage");
            shares.activate(names(&[]));
            shares.activate(names(&["late"]));
            prop_assert!(shares.time("late") >= 0.0 && shares.weight("late") == 1.0);
        }
    }

    #[test]
    fn nonsense_weighs_nothing_and_charges_nothing() {
        let mut shares = Shares::new([("a".to_owned(), f64::NAN), ("b".to_owned(), -1.0), ("c".to_owned(), 4.0)].into());
        assert_eq!((shares.weight("a"), shares.weight("b"), shares.weight("c")), (1.0, 1.0, 4.0));
        shares.charge("c", f64::INFINITY);
        shares.charge("c", 8.0);
        assert_eq!((shares.time("c"), shares.grant("a", 0.0), shares.grant("a", 0.25)), (2.0, 1.0, 0.25));
    }
}
