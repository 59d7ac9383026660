//! The machine on which a figure was measured.

use std::{env::consts, fs, path::Path, thread::available_parallelism};

use serde::Serialize;

/// Facts about this machine and this program. Unknown facts are `None`.
#[derive(Debug, Serialize)]
pub struct Machine {
    cpu: Option<String>,
    cores: Option<usize>,
    /// Names of the system and of its kernel.
    os: String,
    architecture: &'static str,
    tandem: &'static str,
    rustc: &'static str,
    profile: &'static str,
    /// Load averages of the last 1, 5 and 15 minutes; times on a loaded machine are longer.
    load_values: Option<[f64; 3]>,
}

/// A report with the machine on which it was measured.
#[derive(Debug, Serialize)]
pub struct WithMachine<R> {
    machine: Machine,
    #[serde(flatten)]
    report: R,
}

impl<R> WithMachine<R> {
    /// Adds this machine and its present load to `report`.
    pub fn here(report: R) -> WithMachine<R> {
        WithMachine { machine: Machine::here(), report }
    }
}

impl<R: Serialize> WithMachine<R> {
    /// Writes the report as JSON.
    pub fn write(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        Ok(fs::write(path, serde_json::to_string_pretty(self)? + "\n")?)
    }
}

impl Machine {
    /// Describes the machine on which this program runs, as far as Linux does.
    pub fn here() -> Machine {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let name = value_of(&read("/etc/os-release"), "PRETTY_NAME", '=');
        let kernel = read("/proc/sys/kernel/osrelease");
        let words = [name.as_deref().unwrap_or(consts::OS), kernel.trim()];
        Machine {
            cpu: value_of(&read("/proc/cpuinfo"), "model name", ':'),
            cores: available_parallelism().ok().map(|cores| cores.get()),
            os: words.join(" ").trim().into(),
            architecture: consts::ARCH,
            tandem: env!("CARGO_PKG_VERSION"),
            rustc: env!("TANDEM_RUSTC"),
            profile: env!("TANDEM_PROFILE"),
            load_values: load(&read("/proc/loadavg")),
        }
    }
}

/// Returns the value in the first line `key = "value"`, with `sign` as the separator.
fn value_of(text: &str, key: &str, sign: char) -> Option<String> {
    let line = |line: &str| {
        let (name, value) = line.split_once(sign)?;
        (name.trim() == key).then(|| value.trim().trim_matches('"').to_owned())
    };
    text.lines().find_map(line)
}

fn load(text: &str) -> Option<[f64; 3]> {
    let mut means = text.split_whitespace().map(|word| word.parse().ok());
    Some([means.next()??, means.next()??, means.next()??])
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
        assert_eq!(load("2.18 1.50 0.25 3/411 77\n"), Some([2.18, 1.5, 0.25]));
        assert_eq!(load("no numbers"), None);
    }

    #[test]
    fn a_report_keeps_its_fields_beside_the_machine() {
        #[derive(Serialize)]
        struct Report {
            step_us: f64,
        }
        let json = serde_json::to_value(WithMachine::here(Report { step_us: 1.5 })).unwrap();
        assert_eq!(json["step_us"], 1.5);
        assert!(json["machine"]["rustc"].as_str().unwrap().starts_with("rustc "), "{json}");
    }
}
