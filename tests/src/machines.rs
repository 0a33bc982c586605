//! Machines of one network, each a network namespace of its own: with addresses, and with cables that can be pulled. Needs root and `ip`.

// Whatever goes wrong here fails the test that asked for it.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

use std::ffi::OsStr;
use std::process::{Command, Stdio};

/// Machines on one switch.
#[derive(Debug)]
pub struct Network {
    /// What the names of its namespaces begin with.
    name: String,
    machines: usize,
}

impl Network {
    /// So many machines, with the addresses 10.77.0.1, 10.77.0.2 … The switch is in the first one.
    /// None where this cannot be done; where the environment's `GRADFARM_REQUIRE` names `netns`, that is a failure.
    pub fn of(machines: usize) -> Option<Self> {
        let required = std::env::var("GRADFARM_REQUIRE").is_ok_and(|names| names.split(',').any(|name| name == "netns"));
        let network = Self { name: format!("gradfarm-{}", std::process::id()), machines };
        if !ip(["netns", "add", &network.namespace(0)]) {
            assert!(!required, "GRADFARM_REQUIRE names netns, but no namespace can be made");
            eprintln!("no network namespaces can be made here: skipped");
            // Nothing was made that would have to go.
            std::mem::forget(network);
            return None;
        }
        let switch = network.namespace(0);
        sure(["-n", &switch, "link", "set", "lo", "up"]);
        sure(["-n", &switch, "link", "add", "switch", "type", "bridge"]);
        sure(["-n", &switch, "addr", "add", "10.77.0.1/24", "dev", "switch"]);
        sure(["-n", &switch, "link", "set", "switch", "up"]);
        for machine in 1..machines {
            let (own, port) = (network.namespace(machine), format!("port{machine}"));
            sure(["netns", "add", &own]);
            sure(["-n", &switch, "link", "add", &port, "type", "veth", "peer", "name", "cable", "netns", &own]);
            sure(["-n", &switch, "link", "set", &port, "master", "switch", "up"]);
            sure(["-n", &own, "addr", "add", &format!("{}/24", network.address(machine)), "dev", "cable"]);
            sure(["-n", &own, "link", "set", "lo", "up"]);
            sure(["-n", &own, "link", "set", "cable", "up"]);
        }
        Some(network)
    }

    fn namespace(&self, machine: usize) -> String {
        format!("{}-{machine}", self.name)
    }

    /// A machine's address.
    pub fn address(&self, machine: usize) -> String {
        format!("10.77.0.{}", machine + 1)
    }

    /// The same command on a machine.
    pub fn on(&self, machine: usize, command: &Command) -> Command {
        let mut there = Command::new("ip");
        there.args(["netns", "exec", &self.namespace(machine)]).arg(command.get_program()).args(command.get_args());
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => there.env(name, value),
                None => there.env_remove(name),
            };
        }
        there
    }

    /// Pulls a machine's cable, or puts it in again.
    pub fn plug(&self, machine: usize, plugged: bool) {
        sure(["-n", &self.namespace(machine), "link", "set", "cable", if plugged { "up" } else { "down" }]);
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        for machine in (0..self.machines).rev() {
            // Whatever still runs there was ended by its own owner before.
            let _gone = ip(["netns", "del", &self.namespace(machine)]);
        }
    }
}

fn ip<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> bool {
    let status = Command::new("ip").args(arguments).stdin(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

#[track_caller]
fn sure<const N: usize>(arguments: [&str; N]) {
    assert!(ip(arguments), "ip {}", arguments.join(" "));
}
