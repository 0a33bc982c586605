//! Settings from a file: TOML with one key for each option of a command, of the same name. The command line goes before the environment,
//! that before the file, and the file before the defaults.
//!
//! There is no second list of settings: keys, kinds and texts are those of the command's own definition. What the file says, and neither
//! command line nor environment do, is put behind the arguments, so that all is checked in one place.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue};
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, FromArgMatches};
use toml::{Spanned, Value};

/// Largest file [bytes].
const LARGEST: u64 = 1 << 20;
/// Options that are about the file itself.
const OWN: [&str; 2] = ["config", "print-config"];

/// Why settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("settings {}: {source}", file.display())]
    Read {
        /// Which file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line cannot be used.
    #[error("settings {}, line {line}: {problem}", file.display())]
    Line {
        /// Which file.
        file: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// What is wrong there.
        problem: String,
    },
    /// The command line or the environment cannot be used.
    #[error(transparent)]
    Arguments(#[from] clap::Error),
}

/// Parses arguments, with the settings of the file that `--config` names if there is one. `under` is the subcommand that takes the file, or
/// `None` for the command itself.
///
/// # Errors
/// What is wrong, and where.
pub fn parse<T: FromArgMatches>(command: &Command, under: Option<&str>, mut arguments: Vec<OsString>) -> Result<T, SettingsError> {
    let mut built = command.clone();
    // Before that, options do not know what they are called.
    built.build();
    let command = &built;
    let file = match known(command, under, &arguments) {
        Some((matches, file)) => {
            let taker = under.and_then(|name| command.find_subcommand(name)).unwrap_or(command);
            let settings = File::read(&file)?;
            arguments.extend(settings.arguments(taker, &matches)?);
            Some((settings, taker))
        }
        None => None,
    };
    let parsed = command.clone().try_get_matches_from(arguments).and_then(|matches| T::from_arg_matches(&matches));
    parsed.map_err(|error| match file.and_then(|(settings, taker)| settings.blame(taker, &error)) {
        Some(error) => error,
        None => error.into(),
    })
}

/// What is known without the file, and its name, if there is one.
fn known(command: &Command, under: Option<&str>, arguments: &[OsString]) -> Option<(ArgMatches, PathBuf)> {
    // What is wrong is found when all is known. An error here is somebody who asks for help.
    let mut matches = command.clone().ignore_errors(true).try_get_matches_from(arguments).ok()?;
    if let Some(name) = under {
        matches = matches.remove_subcommand().filter(|(found, _)| found == name)?.1;
    }
    let file = matches.try_get_one::<PathBuf>("config").ok()??.clone();
    Some((matches, file))
}

/// A file that was read.
struct File {
    path: PathBuf,
    /// By key: its line, and the value.
    settings: BTreeMap<String, (usize, Value)>,
}

impl File {
    fn read(path: &Path) -> Result<Self, SettingsError> {
        let fault = |source| SettingsError::Read { file: path.to_owned(), source };
        if std::fs::metadata(path).map_err(fault)?.len() > LARGEST {
            return Err(fault(std::io::Error::other(format!("larger than {LARGEST} bytes"))));
        }
        let text = std::fs::read_to_string(path).map_err(fault)?;
        let line = |at: usize| 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|byte| **byte == b'\n').count();
        let read: Result<BTreeMap<Spanned<String>, Value>, _> = toml::from_str(&text);
        let read = read.map_err(|error| SettingsError::Line {
            file: path.to_owned(),
            line: error.span().map_or(1, |span| line(span.start)),
            problem: error.message().to_owned(),
        })?;
        let settings = read.into_iter().map(|(key, value)| (line(key.span().start), key.into_inner(), value));
        Ok(Self { path: path.to_owned(), settings: settings.map(|(line, key, value)| (key, (line, value))).collect() })
    }

    fn wrong(&self, line: usize, problem: String) -> SettingsError {
        SettingsError::Line { file: self.path.clone(), line, problem }
    }

    /// What the file says and others do not, as arguments.
    fn arguments(&self, command: &Command, others: &ArgMatches) -> Result<Vec<OsString>, SettingsError> {
        let mut arguments = Vec::new();
        for (key, (line, value)) in &self.settings {
            let argument = options(command).find(|argument| argument.get_long() == Some(key));
            let argument = argument.ok_or_else(|| self.wrong(*line, unknown(command, key)))?;
            let values = texts(argument, value)
                .map_err(|expected| self.wrong(*line, format!("{key:?} is {}, expected {expected}", value.type_str())))?;
            let said = others.value_source(argument.get_id().as_str());
            if !matches!(said, Some(ValueSource::CommandLine | ValueSource::EnvVariable)) {
                let argument = |value: Option<String>| value.map_or_else(|| format!("--{key}"), |value| format!("--{key}={value}"));
                arguments.extend(values.into_iter().map(|value| argument(value).into()));
            }
        }
        Ok(arguments)
    }

    /// The same error with its line, if it is about something in this file.
    fn blame(&self, command: &Command, error: &clap::Error) -> Option<SettingsError> {
        let Some(ContextValue::String(told)) = error.get(ContextKind::InvalidArg) else { return None };
        let argument = options(command).find(|argument| argument.to_string() == *told)?;
        let (line, _) = self.settings.get(argument.get_long()?)?;
        let rendered = error.render().to_string();
        let problem = rendered.lines().next().unwrap_or_default().trim_start_matches("error: ");
        Some(self.wrong(*line, problem.to_owned()))
    }
}

/// The options that have a key.
fn options(command: &Command) -> impl Iterator<Item = &Arg> {
    let is_flag_of_clap = |argument: &Arg| matches!(argument.get_action(), ArgAction::Help | ArgAction::Version);
    let has_key = |argument: &Arg| argument.get_long().is_some_and(|long| !OWN.contains(&long) && !["help", "version"].contains(&long));
    command.get_arguments().filter(move |argument| has_key(argument) && !is_flag_of_clap(argument))
}

/// The values of a setting: `None` for a flag that is set. The error says what is expected.
fn texts(argument: &Arg, value: &Value) -> Result<Vec<Option<String>>, &'static str> {
    let is_flag = !argument.get_action().takes_values();
    let is_list = matches!(argument.get_action(), ArgAction::Append) || argument.get_value_delimiter().is_some();
    let one = |value: &Value| match value {
        Value::String(text) => Ok(Some(text.clone())),
        Value::Integer(number) => Ok(Some(number.to_string())),
        Value::Float(number) => Ok(Some(number.to_string())),
        _ => Err("a text or a number"),
    };
    match value {
        Value::Boolean(set) if is_flag => Ok(if *set { vec![None] } else { Vec::new() }),
        _ if is_flag => Err("true or false"),
        Value::Array(values) if is_list => values.iter().map(one).collect(),
        other if is_list => Ok(vec![one(other).map_err(|_| "a text or a list of texts")?]),
        other => Ok(vec![one(other)?]),
    }
}

/// What to say of a key that does not exist.
fn unknown(command: &Command, key: &str) -> String {
    let mut near: Vec<(usize, &str)> = options(command)
        .filter_map(Arg::get_long)
        .map(|name| (strsim::levenshtein(key, name), name))
        .filter(|(far, _)| *far <= 3)
        .collect();
    near.sort_unstable();
    let names: Vec<String> = near.iter().take(3).map(|(_, name)| format!("{name:?}")).collect();
    match names.is_empty() {
        true => format!("there is no setting {key:?}; --print-config lists all of them"),
        false => format!("there is no setting {key:?}; did you mean {}?", names.join(" or ")),
    }
}

/// An example of the file: every key with its text, the defaults as they are, the others commented out.
pub fn example(command: &Command) -> String {
    let mut example =
        format!("# Settings of `{}`. The command line goes before the environment, that before this file.\n", command.get_name());
    let mut heading = None;
    let mut sorted: Vec<&Arg> = options(command).collect();
    sorted.sort_by_key(|argument| argument.get_help_heading().is_some());
    for argument in sorted {
        if argument.get_help_heading() != heading {
            heading = argument.get_help_heading();
            let _written = writeln!(example, "\n## {}", heading.unwrap_or_default());
        }
        let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
        example.push('\n');
        for line in help.lines() {
            let _written = writeln!(example, "# {line}");
        }
        if let Some(variable) = argument.get_env() {
            let _written = writeln!(example, "# Environment: {}", variable.to_string_lossy());
        }
        let defaults: Vec<String> = argument.get_default_values().iter().map(|value| value.to_string_lossy().into_owned()).collect();
        let name = argument.get_value_names().and_then(|names| names.first()).map_or("", |name| name.as_str());
        let is_list = matches!(argument.get_action(), ArgAction::Append) || argument.get_value_delimiter().is_some();
        let key = argument.get_long().unwrap_or_default();
        let _written = match (argument.get_action().takes_values(), is_list, defaults.first()) {
            (false, ..) => writeln!(example, "{key} = false"),
            (true, true, None) => writeln!(example, "#{key} = [\"{name}\"]"),
            (true, true, Some(_)) => {
                writeln!(example, "{key} = [{}]", defaults.iter().map(|value| quoted(value)).collect::<Vec<_>>().join(", "))
            }
            (true, false, None) => writeln!(example, "#{key} = \"{name}\""),
            (true, false, Some(value)) => writeln!(example, "{key} = {}", quoted(value)),
        };
    }
    example
}

/// A value as TOML has it.
fn quoted(value: &str) -> String {
    let number = value.parse::<i64>().map(Value::Integer).or_else(|_| value.parse().map(Value::Float));
    number.unwrap_or_else(|_| Value::String(value.to_owned())).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, Parser};

    #[derive(Debug, PartialEq, Parser)]
    #[command(name = "wheel")]
    struct Wheel {
        #[arg(long)]
        config: Option<PathBuf>,
        /// How many there are
        #[arg(long, default_value_t = 6)]
        spokes: u8,
        /// What it is made of
        #[arg(long, env = "GRADFARM_TEST_WHEEL_WOOD", value_name = "WOOD", requires = "glue")]
        wood: Option<String>,
        #[arg(long)]
        glue: Option<String>,
        #[arg(long)]
        turning: bool,
        #[arg(long, value_delimiter = ',')]
        nail: Vec<String>,
    }

    fn read(file: &str, more: &[&str]) -> Result<Wheel, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("w.toml");
        std::fs::write(&path, file).unwrap();
        let arguments = ["wheel", "--config", path.to_str().unwrap()].iter().chain(more).map(OsString::from).collect();
        let wheel = parse::<Wheel>(&Wheel::command(), None, arguments);
        wheel.map(|wheel| Wheel { config: None, ..wheel }).map_err(|error| error.to_string())
    }

    #[test]
    fn the_command_line_goes_before_the_file_and_that_before_the_defaults() {
        let file = "spokes = 8\nglue = \"bone\"\nwood = \"-ash\"\nturning = true\nnail = [\"a\", \"b\"]\n";
        let wheel = read(file, &[]).unwrap();
        assert_eq!((wheel.spokes, wheel.wood.as_deref(), wheel.turning, wheel.nail.len()), (8, Some("-ash"), true, 2));
        let wheel = read(file, &["--spokes", "9", "--nail", "c", "--wood", "oak"]).unwrap();
        assert_eq!((wheel.spokes, wheel.wood.as_deref(), wheel.nail), (9, Some("oak"), vec!["c".to_owned()]));
        assert_eq!(read("", &[]).unwrap().spokes, 6);
        assert_eq!(read("glue = \"g\"", &["--wood", "oak"]).unwrap().glue.as_deref(), Some("g"), "each needs the other");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (file, said) in [
            ("\nspoke = 8", "line 2: there is no setting \"spoke\"; did you mean \"spokes\"?"),
            ("zzzzzzzz = 8", "line 1: there is no setting \"zzzzzzzz\"; --print-config lists all of them"),
            ("config = \"x\"", "there is no setting \"config\""),
            ("help = true", "there is no setting \"help\""),
            ("# so\n\nspokes = 300", "line 3: invalid value '300' for '--spokes"),
            ("spokes = true", "line 1: \"spokes\" is boolean, expected a text or a number"),
            ("turning = 1", "line 1: \"turning\" is integer, expected true or false"),
            ("glue = [\"a\"]", "\"glue\" is array"),
            ("[glue]\na = 1", "line 1: \"glue\" is table"),
            ("wood = \"oak\"", "required arguments were not provided"),
            ("spokes = 8\nspokes = 9", "line 2: "),
            ("spokes 8", "line 1: "),
        ] {
            let error = read(file, &[]).unwrap_err();
            assert!(error.contains(said), "{file:?}: {error}");
        }
    }

    #[test]
    fn the_example_is_a_file_that_says_the_defaults() {
        let example = example(&Wheel::command());
        let plain = read(&example, &[]).unwrap();
        assert_eq!(plain, read("", &[]).unwrap(), "{example}");
        for said in [
            "# How many there are\nspokes = 6\n",
            "# Environment: GRADFARM_TEST_WHEEL_WOOD\n#wood = \"WOOD\"\n",
            "#nail = [\"",
            "turning = false",
        ] {
            assert!(example.contains(said), "{said}: {example}");
        }
    }
}
