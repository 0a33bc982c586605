//! What the operator decides about the farm as a whole: weights and quotas of projects, named limits, the share of units that is verified.

use std::collections::BTreeMap;

/// The rules of a farm. The default lets everybody have everything, evenly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules {
    /// Weights of projects in sharing the farm; 1 where none is given.
    pub weights: BTreeMap<String, f64>,
    /// Most leases of a project at once, where there is such a quota.
    pub project_leases: BTreeMap<String, u32>,
    /// Most leases at once of all jobs that name a limit.
    pub limits: BTreeMap<String, u32>,
    /// Share of the units that are rendered by two workers and compared, 0 to 1, for jobs that do not ask for another one.
    pub verify: f64,
}

/// A project's rule as it is written: `NAME=WEIGHT`, `NAME=WEIGHT/LEASES`.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectRule {
    /// The project.
    pub name: String,
    /// Its weight, above 0.
    pub weight: f64,
    /// Its quota.
    pub leases: Option<u32>,
}

impl std::str::FromStr for ProjectRule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let expected = "expected NAME=WEIGHT or NAME=WEIGHT/LEASES, such as film=2 or tests=0.5/10";
        let (name, rule) = text.split_once('=').ok_or(expected)?;
        let (weight, leases) = rule.split_once('/').map_or((rule, None), |(weight, leases)| (weight, Some(leases)));
        let weight: f64 = weight.parse().map_err(|_| expected)?;
        if !(weight.is_finite() && weight > 0.0) {
            return Err(format!("a weight of {weight}, expected a number above 0"));
        }
        let leases = leases.map(|leases| leases.parse().map_err(|_| expected)).transpose()?;
        Ok(Self { name: crate::job::needs::name(name)?, weight, leases })
    }
}

/// A named limit as it is written: `NAME=LEASES`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LimitRule {
    /// The limit.
    pub name: String,
    /// Most leases at once.
    pub leases: u32,
}

impl std::str::FromStr for LimitRule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let expected = "expected NAME=LEASES, such as licence=20";
        let (name, leases) = text.split_once('=').ok_or(expected)?;
        Ok(Self { name: crate::job::needs::name(name)?, leases: leases.parse().map_err(|_| expected)? })
    }
}

impl Rules {
    /// The rules that these lines make.
    pub fn of(projects: &[ProjectRule], limits: &[LimitRule], verify: f64) -> Self {
        Self {
            weights: projects.iter().map(|rule| (rule.name.clone(), rule.weight)).collect(),
            project_leases: projects.iter().filter_map(|rule| Some((rule.name.clone(), rule.leases?))).collect(),
            limits: limits.iter().map(|rule| (rule.name.clone(), rule.leases)).collect(),
            verify,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_read_and_nonsense_is_refused() {
        let projects = ["film=2", "tests=0.5/10"].map(|text| text.parse::<ProjectRule>().unwrap());
        let rules = Rules::of(&projects, &["licence=20".parse().unwrap()], 0.01);
        assert_eq!((rules.weights["film"], rules.project_leases.get("film"), rules.project_leases["tests"]), (2.0, None, 10));
        assert_eq!(rules.limits["licence"], 20);
        for bad in ["film", "film=", "film=0", "film=-1", "film=inf", "film=1/x", "a b=1", "=1"] {
            assert!(bad.parse::<ProjectRule>().is_err(), "{bad}");
        }
        assert!("licence=many".parse::<LimitRule>().is_err());
    }
}
