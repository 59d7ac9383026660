//! The machine on which an episode was played or a value was measured.

use std::{env::consts, fs, thread::available_parallelism};

use serde::{Deserialize, Serialize};

/// Facts about a machine. Unknown facts are `None`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    pub cpu: Option<String>,
    pub cores: Option<usize>,
    /// Names of the operating system and its kernel.
    pub os: String,
    pub architecture: String,
}

impl Machine {
    /// Describes the machine on which this program runs, as far as Linux reports it.
    pub fn here() -> Machine {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let name = value_of(&read("/etc/os-release"), "PRETTY_NAME", '=');
        let kernel = read("/proc/sys/kernel/osrelease");
        let words = [name.as_deref().unwrap_or(consts::OS), kernel.trim()];
        Machine {
            cpu: value_of(&read("/proc/cpuinfo"), "model name", ':'),
            cores: available_parallelism().ok().map(|cores| cores.get()),
            os: words.join(" ").trim().into(),
            architecture: consts::ARCH.into(),
        }
    }
}

/// Returns the value from the first line of the form `key = "value"`, with `sign` as the separator.
fn value_of(text: &str, key: &str, sign: char) -> Option<String> {
    let line = |line: &str| {
        let (name, value) = line.split_once(sign)?;
        (name.trim() == key).then(|| value.trim().trim_matches('"').to_owned())
    };
    text.lines().find_map(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_are_read_from_the_systems_own_files() {
        let cpus = "processor\t: 0\nmodel name\t: Brand X @ 2.50GHz\nprocessor\t: 1\nmodel name\t: Y\n";
        assert_eq!(value_of(cpus, "model name", ':').as_deref(), Some("Brand X @ 2.50GHz"));
        let release = "NAME=\"Debian\"\nPRETTY_NAME=\"Debian GNU/Linux 12\"\n";
        assert_eq!(value_of(release, "PRETTY_NAME", '=').as_deref(), Some("Debian GNU/Linux 12"));
        assert_eq!(value_of("", "model name", ':'), None);
    }
}
