//! What the Python package has and this program has not, started as any program is: the tool loop of language models, because the
//! official SDKs of the models' makers are Python's, and data sets, because the libraries of their formats are.

use std::{env, io, process::Command};

/// The environment's variable with the interpreter that has the package; the command of a wheel is its own.
const PYTHON_VARIABLE: &str = "TANDEM_PYTHON";
const PYTHON: &str = "python3";

/// Has the module only say what it would miss.
const CHECK: &str = "--check";

/// A part of the package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PythonPart {
    /// Language models as players.
    Agent,
    /// Data sets of recordings.
    Export,
}

/// Why Python does not do its part.
#[derive(Debug, thiserror::Error)]
pub enum PythonError {
    /// There is no interpreter.
    #[error(
        "{} by Python, and {python} cannot be started ({source}); install Python 3.10 or later and \
         pip install './gateway/python[{}]' in a checkout of the repository, or name an interpreter that has it by {PYTHON_VARIABLE}",
        part.what(), part.extra()
    )]
    NoPython {
        /// What was asked for.
        part: PythonPart,
        /// What was tried.
        python: String,
        /// What the system said.
        source: io::Error,
    },
    /// The interpreter has no such package.
    #[error(
        "{} by Python's package, which {python} does not have; pip install './gateway/python[{}]' in a checkout of the \
         repository, or name an interpreter that has it by {PYTHON_VARIABLE}",
        part.what(), part.extra()
    )]
    NoPackage {
        /// What was asked for.
        part: PythonPart,
        /// What was tried.
        python: String,
    },
    /// The module says what it misses.
    #[error("{0}")]
    Refused(String),
}

/// A module with its arguments.
#[derive(Debug)]
pub struct PythonModule {
    python: String,
    part: PythonPart,
    arguments: Vec<String>,
}

impl PythonPart {
    fn module(self) -> &'static str {
        match self {
            PythonPart::Agent => "tandem.agent",
            PythonPart::Export => "tandem.export",
        }
    }

    /// The extra of the wheel with what it needs.
    fn extra(self) -> &'static str {
        match self {
            PythonPart::Agent => "agents",
            PythonPart::Export => "lerobot",
        }
    }

    fn what(self) -> &'static str {
        match self {
            PythonPart::Agent => "agents are played",
            PythonPart::Export => "data sets are written",
        }
    }

    /// What the module's own errors begin with.
    fn command(self) -> &'static str {
        match self {
            PythonPart::Agent => "tandem agent: ",
            PythonPart::Export => "tandem export: ",
        }
    }
}

impl PythonModule {
    /// The module with these arguments, if it can be started with them: its package is there, and what that needs.
    pub fn new(part: PythonPart, arguments: Vec<String>) -> Result<PythonModule, PythonError> {
        let python = env::var(PYTHON_VARIABLE).ok().filter(|python| !python.is_empty());
        let module = PythonModule { python: python.unwrap_or_else(|| PYTHON.into()), part, arguments };
        let checked = module.command(&[CHECK]).output();
        let checked = checked.map_err(|source| PythonError::NoPython {
            part,
            python: module.python.clone(),
            source,
        })?;
        if checked.status.success() {
            return Ok(module);
        }
        let said = String::from_utf8_lossy(&checked.stderr);
        if said.contains("No module named tandem") || said.contains("No module named 'tandem") {
            return Err(PythonError::NoPackage { part, python: module.python });
        }
        let last = said.lines().rfind(|line| !line.trim().is_empty());
        Err(PythonError::Refused(match last {
            Some(line) => line.trim_start_matches(part.command()).into(),
            None => {
                let (python, module, status) = (module.python, part.module(), checked.status);
                format!("{python} does not start {module} ({status}), and says nothing")
            }
        }))
    }

    /// The command that does it, with further arguments in front of its own.
    pub fn command(&self, further: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command.args(["-m", self.part.module()]).args(further).args(&self.arguments);
        command
    }

    /// The command that does it, for a shell.
    pub fn shell_line(&self) -> String {
        let words = [self.python.as_str(), "-m", self.part.module()].into_iter();
        let words = words.chain(self.arguments.iter().map(String::as_str));
        words.map(quoted).collect::<Vec<_>>().join(" ")
    }
}

/// A word that a shell takes as it is.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_words_that_were_given() {
        let arguments = ["--model=it's a \"model\"; $HOME", "--max-usd=1"].map(str::to_owned).to_vec();
        let python = "printf '%s|' \"$@\" #".into();
        let agent = PythonModule { python, part: PythonPart::Agent, arguments: arguments.clone() };
        let line = agent.shell_line();
        let echo = format!("set -- {line}; shift; printf '%s|' \"$@\"");
        let output = Command::new("sh").args(["-c", &echo]).output().expect("a shell");
        let told = String::from_utf8(output.stdout).expect("text");
        assert_eq!(told, format!("-m|tandem.agent|{}|{}|", arguments[0], arguments[1]));
    }
}
