//! Language models: the tool loop of the Python package, which is started as any program is. It is Python's, because the official SDKs
//! of the models' makers are.

use std::{env, io, process::Command};

/// The environment's variable with the interpreter that has the package; the command of a wheel is its own.
const PYTHON_VARIABLE: &str = "TANDEM_PYTHON";
const PYTHON: &str = "python3";

const MODULE: [&str; 2] = ["-m", "tandem.agent"];

/// Has the loop only say what it would miss.
const CHECK: &str = "--check";

/// Why a model cannot play.
#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    /// There is no interpreter.
    #[error(
        "agents are played by Python, and {python} cannot be started ({source}); install Python 3.10 or later and \
         pip install 'tandem-sim[agents]', or name an interpreter that has it by {PYTHON_VARIABLE}"
    )]
    NoPython {
        /// What was tried.
        python: String,
        /// What the system said.
        source: io::Error,
    },
    /// The interpreter has no such package.
    #[error(
        "agents are played by Python's package, which {python} does not have; pip install 'tandem-sim[agents]', or name an \
         interpreter that has it by {PYTHON_VARIABLE}"
    )]
    NoPackage {
        /// What was tried.
        python: String,
    },
    /// The loop says what it misses.
    #[error("{0}")]
    Refused(String),
}

/// The loop with its arguments.
#[derive(Debug)]
pub struct AgentLoop {
    python: String,
    arguments: Vec<String>,
}

impl AgentLoop {
    /// The loop with these arguments, if it can be started with them: its package is there, and its SDK, and a key.
    pub fn new(arguments: Vec<String>) -> Result<AgentLoop, AgentError> {
        let python = env::var(PYTHON_VARIABLE).ok().filter(|python| !python.is_empty());
        let agent = AgentLoop { python: python.unwrap_or_else(|| PYTHON.into()), arguments };
        let checked = agent.command(&[CHECK]).output();
        let checked =
            checked.map_err(|source| AgentError::NoPython { python: agent.python.clone(), source })?;
        if checked.status.success() {
            return Ok(agent);
        }
        let said = String::from_utf8_lossy(&checked.stderr);
        if said.contains("No module named tandem") || said.contains("No module named 'tandem") {
            return Err(AgentError::NoPackage { python: agent.python });
        }
        let last = said.lines().rfind(|line| !line.trim().is_empty());
        Err(AgentError::Refused(match last {
            Some(line) => line.trim_start_matches("tandem agent: ").into(),
            None => {
                format!("{} does not start the agent ({}), and says nothing", agent.python, checked.status)
            }
        }))
    }

    /// The command that plays, with further arguments.
    pub fn command(&self, further: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command.args(MODULE).args(&self.arguments).args(further);
        command
    }

    /// The command that plays, for a shell.
    pub fn shell_line(&self) -> String {
        let words = [self.python.as_str()].into_iter().chain(MODULE);
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
        let agent = AgentLoop { python: "printf '%s|' \"$@\" #".into(), arguments: arguments.clone() };
        let line = agent.shell_line();
        let echo = format!("set -- {line}; shift; printf '%s|' \"$@\"");
        let output = Command::new("sh").args(["-c", &echo]).output().expect("a shell");
        let told = String::from_utf8(output.stdout).expect("text");
        assert_eq!(told, format!("-m|tandem.agent|{}|{}|", arguments[0], arguments[1]));
    }
}
