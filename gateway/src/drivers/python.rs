//! Features that only the Python package has. They run as separate programs.
//!
//! One is the tool loop of language models, because the vendors' official SDKs are in Python. Another is data
//! sets, because the libraries of their formats are in Python.

use std::{env, io, process::Command};

/// Environment variable that names the interpreter with the package. The wheel's command sets it to its own
/// interpreter.
const PYTHON_VARIABLE: &str = "TANDEM_PYTHON";
/// On Windows `python3` is an alias that opens the Microsoft Store.
const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// Flag that makes the module only check its requirements.
const CHECK: &str = "--check";

/// A part of the package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PythonPart {
    /// Language models as players.
    Agent,
    /// Data sets of recordings.
    Export,
    /// Logs of Inspect.
    Inspect,
    /// Scenes and objects of other programs.
    Import,
}

/// Reason why the Python part cannot run.
#[derive(Debug, thiserror::Error)]
pub enum PythonError {
    /// The interpreter cannot be started.
    #[error(
        "{} by Python, and {python} cannot be started ({source}); install Python 3.10 or later and {}",
        part.what(), part.remedy()
    )]
    NoPython {
        /// Requested part.
        part: PythonPart,
        /// Interpreter that was tried.
        python: String,
        /// Error of the system.
        source: io::Error,
    },
    /// The interpreter does not have the package.
    #[error(
        "{} by Python's package, which {python} does not have; {}", part.what(), part.remedy()
    )]
    NoPackage {
        /// Requested part.
        part: PythonPart,
        /// Interpreter that was tried.
        python: String,
    },
    /// The module reports a missing requirement.
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
            PythonPart::Export | PythonPart::Inspect => "tandem.export",
            PythonPart::Import => "tandem.importing",
        }
    }

    /// Returns the extra of the wheel that the part needs.
    fn extra(self) -> &'static str {
        match self {
            PythonPart::Agent => "agents",
            PythonPart::Export => "lerobot",
            PythonPart::Inspect => "inspect",
            PythonPart::Import => "import",
        }
    }

    /// Returns the advice on installing the package with the extra.
    fn remedy(self) -> String {
        let extra = self.extra();
        format!(
            "pip install 'tandem-sim[{extra}]' (in a checkout './gateway/python[{extra}]'), or name an \
             interpreter that has it by {PYTHON_VARIABLE}"
        )
    }

    fn what(self) -> &'static str {
        match self {
            PythonPart::Agent => "agents are played",
            PythonPart::Export => "data sets are written",
            PythonPart::Inspect => "logs of Inspect are written",
            PythonPart::Import => "files are imported",
        }
    }

    /// Returns the prefix of the module's own error messages.
    fn command(self) -> &'static str {
        match self {
            PythonPart::Agent => "tandem agent: ",
            PythonPart::Export | PythonPart::Inspect => "tandem export: ",
            PythonPart::Import => "tandem import: ",
        }
    }
}

impl PythonModule {
    /// Creates the module with these arguments, after checking that its package and requirements are
    /// installed.
    pub fn new(part: PythonPart, arguments: Vec<String>) -> Result<PythonModule, PythonError> {
        let module = PythonModule { python: interpreter(), part, arguments };
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

    /// Returns the command of the interpreter. The `further` arguments precede the command's own arguments.
    pub fn command(&self, further: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command.args(["-m", self.part.module()]).args(further).args(&self.arguments);
        command
    }

    /// Returns the command line for a shell.
    pub fn shell_line(&self) -> String {
        let words = [self.python.as_str(), "-m", self.part.module()].into_iter();
        let words = words.chain(self.arguments.iter().map(String::as_str));
        words.map(quoted).collect::<Vec<_>>().join(" ")
    }
}

/// Returns the interpreter that runs Python parts.
pub fn interpreter() -> String {
    let named = env::var(PYTHON_VARIABLE).ok().filter(|python| !python.is_empty());
    named.unwrap_or_else(|| PYTHON.into())
}

/// Quotes a word for a shell.
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
