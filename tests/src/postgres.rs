//! A private PostgreSQL server for tests: in a temporary folder, on a free port, gone with the process that asked for it.

// Whatever goes wrong here fails the test that asked for it.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// The user and owner of every database.
const USER: &str = "gradfarm";

/// Runs a server until its standard input ends, which the end of the test process brings about, however it ends.
const KEEPER: &str = r#"
set -e
export LC_ALL=C
folder="$1"; port="$2"; programs="$3"; user="$4"
"$programs/initdb" -D "$folder/data" -A trust -U "$user" -E UTF8 --no-sync >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
start() {
    "$programs/postgres" -D "$folder/data" -p "$port" -k "$folder" -c listen_addresses=127.0.0.1 -c fsync=off \
        -c max_connections=200 -c unix_socket_permissions=0777 >>"$folder/log" 2>&1 </dev/null &
    server=$!
    while ! "$programs/pg_isready" -q -h 127.0.0.1 -p "$port"; do
        kill -0 $server 2>/dev/null || { cat "$folder/log"; exit 1; }
        sleep 0.05
    done
    echo started
}
start
while read -r order; do
    case "$order" in
        stop) kill -QUIT $server; wait $server || true; echo stopped ;;
        start) start ;;
    esac
done
kill -QUIT $server 2>/dev/null || true
wait $server || true
rm -rf "$folder"
"#;

/// A running server.
#[derive(Debug)]
pub struct Server {
    keeper: Child,
    /// None once it is told to end.
    orders: Option<ChildStdin>,
    answers: BufReader<std::process::ChildStdout>,
    port: u16,
    programs: PathBuf,
}

/// The server that the tests of this process share, if PostgreSQL is installed. Where the environment's `GRADFARM_REQUIRE` names
/// `postgres`, its absence is a failure.
pub fn shared() -> Option<&'static Server> {
    static SHARED: OnceLock<Option<Server>> = OnceLock::new();
    SHARED.get_or_init(Server::start).as_ref()
}

impl Server {
    /// A server of its own, for tests that stop it; `None` if PostgreSQL is not installed.
    pub fn start() -> Option<Self> {
        let Some(programs) = installed() else {
            let required = std::env::var("GRADFARM_REQUIRE").unwrap_or_default();
            assert!(!required.split(',').any(|name| name.trim() == "postgres"), "PostgreSQL is required and not installed");
            eprintln!("no PostgreSQL is installed: not tested with it");
            return None;
        };
        let folder = std::env::temp_dir().join(format!("gradfarm-postgres-{}-{}", std::process::id(), next()));
        std::fs::create_dir(&folder).unwrap();
        let port = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port();
        let root = String::from_utf8(Command::new("id").arg("-u").output().unwrap().stdout).unwrap().trim() == "0";
        // PostgreSQL refuses to run as root.
        let mut command = if root {
            assert!(Command::new("chown").args(["postgres"]).arg(&folder).status().unwrap().success());
            let mut command = Command::new("runuser");
            command.args(["-u", "postgres", "--", "sh"]);
            command
        } else {
            Command::new("sh")
        };
        let script = command.args(["-c", KEEPER, "keeper"]).args([&folder]).arg(port.to_string()).arg(&programs).arg(USER);
        let mut keeper = script.current_dir("/").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (orders, answers) = (keeper.stdin.take(), BufReader::new(keeper.stdout.take().unwrap()));
        let mut server = Self { keeper, orders, answers, port, programs };
        server.expect("started");
        Some(server)
    }

    /// A new, empty database: its URI.
    pub fn database(&self) -> String {
        let name = format!("test_{}", next());
        let status = Command::new(self.programs.join("psql"))
            .args(["-q", "-h", "127.0.0.1", "-p", &self.port.to_string(), "-U", USER, "-d", "postgres", "-c"])
            .arg(format!("CREATE DATABASE {name}"))
            .status();
        assert!(status.unwrap().success(), "database {name}");
        format!("postgres://{USER}@127.0.0.1:{}/{name}", self.port)
    }

    /// Takes the server down at once, as a crash would.
    pub fn stop(&mut self) {
        self.order("stop");
        self.expect("stopped");
    }

    /// Starts it again after [`stop`](Self::stop).
    pub fn restart(&mut self) {
        self.order("start");
        self.expect("started");
    }

    fn order(&mut self, order: &str) {
        writeln!(self.orders.as_mut().unwrap(), "{order}").unwrap();
    }

    fn expect(&mut self, answer: &str) {
        let mut said = String::new();
        loop {
            let mut line = String::new();
            let read = self.answers.read_line(&mut line).unwrap();
            if line.trim() == answer {
                return;
            }
            said += &line;
            assert!(read > 0, "PostgreSQL did not get {answer}: {said}");
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.orders = None;
        let _ended = self.keeper.wait();
    }
}

fn next() -> u32 {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    COUNT.fetch_add(1, Ordering::Relaxed)
}

/// The folder of the newest server that is installed.
fn installed() -> Option<PathBuf> {
    let mut found: Vec<(u32, PathBuf)> = std::fs::read_dir("/usr/lib/postgresql")
        .ok()?
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            Some((path.file_name()?.to_str()?.parse().ok()?, path.join("bin")))
        })
        .filter(|(_, programs): &(u32, PathBuf)| Path::new(programs).join("initdb").exists())
        .collect();
    found.sort();
    found.pop().map(|(_, programs)| programs)
}
