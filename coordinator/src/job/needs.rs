//! What a job asks of the farm besides its plan: whose it is, who may render it, and how many at once.

use std::collections::BTreeSet;

use gradfarm_proto::limits;
use serde::{Deserialize, Serialize};

/// What a job asks of the farm. The default asks nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Needs {
    /// The project that it belongs to; empty: none in particular, which is a project like any other.
    pub project: String,
    /// Only workers of one of these pools; empty: of any.
    pub pools: BTreeSet<String>,
    /// Only workers with all these tags.
    pub tags: BTreeSet<String>,
    /// Least memory of a worker [bytes].
    pub memory: u64,
    /// Least rendering threads of a worker.
    pub threads: u32,
    /// Named limits that its leases count against.
    pub limits: BTreeSet<String>,
    /// Most workers at once.
    pub most_workers: Option<u32>,
    /// Share of its units that are rendered by two workers and compared, 0 to 1.
    pub verify: f64,
}

/// What a worker has to offer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Capabilities {
    /// Its pool; empty: none.
    pub pool: String,
    /// Its tags.
    pub tags: BTreeSet<String>,
    /// Memory [bytes]; 0: it did not say.
    pub memory: u64,
    /// Rendering threads.
    pub threads: u32,
}

/// What a worker lacks for a job.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Lack {
    /// It is of no pool that the job allows.
    #[error("pool {}", .0.join(" or "))]
    Pool(Vec<String>),
    /// It lacks a tag.
    #[error("tag {0}")]
    Tag(String),
    /// It has less memory, or did not say how much.
    #[error("{} of memory", crate::job::needs::memory(*.0))]
    Memory(u64),
    /// It has fewer threads.
    #[error("{0} threads")]
    Threads(u32),
}

impl Needs {
    /// Whether any worker would do.
    pub fn any_worker(&self) -> bool {
        self.pools.is_empty() && self.tags.is_empty() && self.memory == 0 && self.threads == 0
    }

    /// The first thing that a worker lacks, if it lacks any.
    pub fn lacks(&self, worker: &Capabilities) -> Option<Lack> {
        if !self.pools.is_empty() && !self.pools.contains(&worker.pool) {
            return Some(Lack::Pool(self.pools.iter().cloned().collect()));
        }
        if let Some(tag) = self.tags.iter().find(|tag| !worker.tags.contains(*tag)) {
            return Some(Lack::Tag(tag.clone()));
        }
        if worker.memory < self.memory {
            return Some(Lack::Memory(self.memory));
        }
        (worker.threads < self.threads).then_some(Lack::Threads(self.threads))
    }
}

impl std::str::FromStr for Needs {
    type Err = String;

    /// Reads what a worker must have: tags and amounts with commas between them, such as `gpu,memory=8G,threads=16`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut needs = Self::default();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            match part.split_once('=') {
                Some(("memory", size)) => needs.memory = bytes(size)?,
                Some(("threads", count)) => {
                    needs.threads = count.parse().map_err(|_| format!("{count:?}, expected a number of threads"))?
                }
                Some((other, _)) => return Err(format!("{other:?}, expected memory=SIZE, threads=N or a tag")),
                None => drop(needs.tags.insert(name(part)?)),
            }
        }
        Ok(needs)
    }
}

/// Names with commas between them.
///
/// # Errors
/// The first one that is none, or that there are too many.
pub(crate) fn names(text: &str) -> Result<BTreeSet<String>, String> {
    let names: BTreeSet<String> = text.split(',').map(str::trim).filter(|part| !part.is_empty()).map(name).collect::<Result<_, _>>()?;
    if names.len() > limits::TAGS { Err(format!("{} names, expected at most {}", names.len(), limits::TAGS)) } else { Ok(names) }
}

/// A name of a project, a pool, a tag or a limit.
///
/// # Errors
/// What is expected of one.
pub(crate) fn name(text: &str) -> Result<String, String> {
    let good = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if text.is_empty() || text.len() > limits::TAG || !text.chars().all(good) {
        return Err(format!("{text:?}, expected 1 to {} letters, digits, dots, dashes and underscores", limits::TAG));
    }
    Ok(text.to_owned())
}

/// An amount of memory as people write it: `8G`, `512M`, `4GiB` or bytes.
fn bytes(text: &str) -> Result<u64, String> {
    let wrong = || format!("{text:?}, expected a size such as 512M or 8G");
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = text[digits.len()..].to_ascii_uppercase();
    let power = ["", "K", "M", "G", "T"].iter().position(|known| *known == unit.trim_end_matches("IB").trim_end_matches('B'));
    let amount: u64 = digits.parse().map_err(|_| wrong())?;
    amount.checked_mul(1 << (10 * power.ok_or_else(wrong)?)).ok_or_else(wrong)
}

/// An amount of memory in words.
pub(crate) fn memory(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    let fits = |(size, _): &&(u64, &str)| bytes >= *size && bytes.is_multiple_of(*size);
    UNITS.iter().find(fits).map_or_else(|| format!("{bytes} bytes"), |(size, unit)| format!("{} {unit}", bytes / size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requirements_are_read_as_people_write_them() {
        let needs: Needs = "gpu, memory=8G,threads=16,avx-512".parse().unwrap();
        assert_eq!((needs.memory, needs.threads, needs.tags.len()), (8 << 30, 16, 2));
        assert_eq!("".parse::<Needs>().unwrap(), Needs::default());
        assert_eq!(["1", "3K", "4GiB", "2TB"].map(|text| bytes(text).unwrap()), [1, 3 << 10, 4 << 30, 2 << 40]);
        for bad in ["memory=much", "memory=8X", "memory=99999999999T", "threads=-1", "disk=1", "a b", "ü"] {
            assert!(bad.parse::<Needs>().is_err(), "{bad}");
        }
        assert_eq!(memory(3 << 29), "1536 MiB");
        assert!(names(&"a,".repeat(65)).is_ok() && names("a,,b").unwrap().len() == 2);
    }

    #[test]
    fn what_is_lacking_is_named() {
        let worker = Capabilities { pool: "night".into(), tags: ["gpu".into()].into(), memory: 8 << 30, threads: 16 };
        let needs = Needs::default();
        assert!(needs.any_worker() && needs.lacks(&worker).is_none() && needs.lacks(&Capabilities::default()).is_none());
        let lacks = |needs: Needs| needs.lacks(&worker).map(|lack| lack.to_string());
        assert_eq!(lacks(Needs { pools: ["day".into(), "night".into()].into(), tags: ["gpu".into()].into(), ..Needs::default() }), None);
        assert_eq!(lacks(Needs { pools: ["a".into(), "b".into()].into(), ..Needs::default() }).unwrap(), "pool a or b");
        assert_eq!(lacks(Needs { tags: ["avx".into(), "gpu".into()].into(), ..Needs::default() }).unwrap(), "tag avx");
        assert_eq!(lacks(Needs { memory: 12 << 30, ..Needs::default() }).unwrap(), "12 GiB of memory");
        assert_eq!(lacks(Needs { threads: 17, ..Needs::default() }).unwrap(), "17 threads");
    }
}
