//! What somebody may do, in four steps for people, and one beside them for workers.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A role. Each of a person's roles may do all that the ones before it may; a worker's may do nothing of that.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Looks at jobs, images and workers.
    Viewer,
    /// Submits jobs, uploads what they need, and calls them off.
    Submitter,
    /// Pauses, resumes and orders jobs, and looks after workers.
    Operator,
    /// Issues and revokes tokens and certificates, and reads the audit log.
    Admin,
    /// Takes leases and delivers results, over the workers' port alone.
    Worker,
}

/// A word that is no role.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no role, expected viewer, submitter, operator, admin or worker")]
pub struct ParseRoleError(String);

impl Role {
    /// All of them.
    pub const ALL: [Role; 5] = [Role::Viewer, Role::Submitter, Role::Operator, Role::Admin, Role::Worker];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Role::Viewer => "viewer",
            Role::Submitter => "submitter",
            Role::Operator => "operator",
            Role::Admin => "admin",
            Role::Worker => "worker",
        }
    }

    /// How much a person may do; nothing for workers.
    fn rank(self) -> Option<u8> {
        match self {
            Role::Viewer => Some(1),
            Role::Submitter => Some(2),
            Role::Operator => Some(3),
            Role::Admin => Some(4),
            Role::Worker => None,
        }
    }

    /// Whether somebody with this role may do what needs `needed`.
    pub fn covers(self, needed: Role) -> bool {
        self == needed || self.rank().zip(needed.rank()).is_some_and(|(mine, least)| mine >= least)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Role {
    type Err = ParseRoleError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Role::ALL.into_iter().find(|role| role.name() == text);
        found.ok_or_else(|| ParseRoleError(text.chars().take(80).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_of_people_are_steps_and_workers_stand_beside_them() {
        let people = [Role::Viewer, Role::Submitter, Role::Operator, Role::Admin];
        for (mine, role) in people.into_iter().enumerate() {
            for (least, needed) in people.into_iter().enumerate() {
                assert_eq!(role.covers(needed), mine >= least, "{role} for {needed}");
            }
            assert!(!role.covers(Role::Worker) && !Role::Worker.covers(role), "{role}");
        }
        assert!(Role::Worker.covers(Role::Worker));
    }

    #[test]
    fn words_and_back() {
        for role in Role::ALL {
            assert_eq!(role.name().parse(), Ok(role));
        }
        assert!("root".parse::<Role>().unwrap_err().to_string().contains("operator"));
    }
}
