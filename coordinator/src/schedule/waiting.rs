//! Why a job gets no worker at this moment, in a form for people. The first reason that applies is told: it is the one to remove first.
//!
//! That workers are set aside is never the reason: where all that may render a job are, none of them is.

use std::fmt;

use crate::job::Lack;

/// What is known of a job and of the farm around it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// Whether it is over.
    pub over: bool,
    /// Whether somebody paused it.
    pub paused: bool,
    /// Whether it has units that wait for a worker.
    pub open: bool,
    /// Leases that are held of it.
    pub leases: usize,
    /// What its frames wait for, if no unit is open.
    pub errand: Option<&'static str>,
    /// Workers that are connected.
    pub workers: usize,
    /// Of these, the ones that may render it.
    pub fitting: usize,
    /// What those that may not lack, each thing once.
    pub lacks: Vec<Lack>,
    /// A limit that is reached.
    pub limit: Option<Reached>,
    /// Jobs of higher priority with units that wait.
    pub higher: usize,
    /// Jobs of the same priority, of projects that have had less for their weight.
    pub poorer: usize,
    /// Its project.
    pub project: String,
}

/// A limit that is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reached {
    /// The job's own.
    Workers(u32),
    /// Its project's.
    Project(String, u32),
    /// A named one.
    Named(String, u32),
}

/// Why a job waits.
#[derive(Clone, Debug, PartialEq)]
pub enum Waiting {
    /// Somebody paused it.
    Paused,
    /// For something that is made of its results.
    Errand(&'static str),
    /// Nobody is connected.
    NoWorker,
    /// Nobody who is connected may render it.
    NoneFits(Vec<Lack>),
    /// A limit is reached.
    Limit(Reached),
    /// Jobs of higher priority come first.
    Behind(usize),
    /// Projects that have had less come first.
    OverItsShare(String, usize),
    /// All workers that may render it are at something.
    Busy,
}

impl Waiting {
    /// The reason, if it waits: `None` for a job that is over, or whose units are being rendered with none left over.
    pub fn why(facts: &Facts) -> Option<Self> {
        if facts.over {
            return None;
        }
        if facts.paused {
            return Some(Waiting::Paused);
        }
        if !facts.open {
            return if facts.leases > 0 { None } else { facts.errand.map(Waiting::Errand) };
        }
        if facts.workers == 0 {
            return Some(Waiting::NoWorker);
        }
        if facts.fitting == 0 {
            return Some(Waiting::NoneFits(facts.lacks.clone()));
        }
        if let Some(limit) = &facts.limit {
            return Some(Waiting::Limit(limit.clone()));
        }
        if facts.leases > 0 {
            // Somebody is at it; that not everybody is needs no reason.
            return None;
        }
        if facts.higher > 0 {
            return Some(Waiting::Behind(facts.higher));
        }
        if facts.poorer > 0 {
            return Some(Waiting::OverItsShare(facts.project.clone(), facts.poorer));
        }
        Some(Waiting::Busy)
    }

    /// One word for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Waiting::Paused => "paused",
            Waiting::Errand(_) => "making",
            Waiting::NoWorker => "no_worker",
            Waiting::NoneFits(_) => "none_fits",
            Waiting::Limit(_) => "limit",
            Waiting::Behind(_) => "priority",
            Waiting::OverItsShare(..) => "share",
            Waiting::Busy => "busy",
        }
    }
}

impl fmt::Display for Waiting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let jobs = |count: usize| if count == 1 { "1 job".to_owned() } else { format!("{count} jobs") };
        match self {
            Waiting::Paused => f.write_str("it is paused"),
            Waiting::Errand(what) => write!(f, "{what}"),
            Waiting::NoWorker => f.write_str("no worker is connected"),
            Waiting::NoneFits(lacks) => {
                let lacks: Vec<String> = lacks.iter().map(ToString::to_string).collect();
                write!(f, "no worker that is connected has {}", lacks.join(", nor "))
            }
            Waiting::Limit(Reached::Workers(most)) => write!(f, "{most} workers are at it, and it asked for no more"),
            Waiting::Limit(Reached::Project(project, most)) => write!(f, "project {project} has the {most} leases that it may have"),
            Waiting::Limit(Reached::Named(name, most)) => write!(f, "limit {name} is reached: {most} leases"),
            Waiting::Behind(count) => write!(f, "{} of higher priority first", jobs(*count)),
            Waiting::OverItsShare(project, count) => {
                let project = if project.is_empty() { "jobs without a project" } else { project };
                write!(f, "{project} had more than its share; {} of other projects first", jobs(*count))
            }
            Waiting::Busy => f.write_str("all workers that may render it are busy"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reason_to_remove_is_told() {
        // Everything at once; then one reason after the other is removed.
        let mut facts = Facts {
            over: true,
            paused: true,
            open: true,
            leases: 0,
            errand: Some("the guide of its next round is being made"),
            workers: 0,
            fitting: 0,
            lacks: vec![Lack::Tag("gpu".into()), Lack::Threads(8)],
            limit: Some(Reached::Named("licence".into(), 2)),
            higher: 1,
            poorer: 2,
            project: "film".into(),
        };
        let why = |facts: &Facts| Waiting::why(facts).map(|why| why.to_string());
        assert_eq!(why(&facts), None);
        facts.over = false;
        assert_eq!(why(&facts).unwrap(), "it is paused");
        facts.paused = false;
        assert_eq!(why(&facts).unwrap(), "no worker is connected");
        facts.workers = 3;
        assert_eq!(why(&facts).unwrap(), "no worker that is connected has tag gpu, nor 8 threads");
        facts.fitting = 1;
        assert_eq!(why(&facts).unwrap(), "limit licence is reached: 2 leases");
        facts.limit = None;
        assert_eq!(why(&facts).unwrap(), "1 job of higher priority first");
        facts.higher = 0;
        assert_eq!(why(&facts).unwrap(), "film had more than its share; 2 jobs of other projects first");
        facts.poorer = 0;
        assert_eq!(why(&facts).unwrap(), "all workers that may render it are busy");
        assert_eq!(why(&Facts { leases: 1, ..facts.clone() }), None);
        assert_eq!(why(&Facts { open: false, ..facts.clone() }).unwrap(), "the guide of its next round is being made");
    }
}
