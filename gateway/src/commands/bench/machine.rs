//! Description of the machine on which a figure was measured.

use std::{fs, path::Path};

use serde::Serialize;
use tandem_evaluation::results::Machine;

/// Facts about this machine and this program. Unknown facts are `None`.
#[derive(Debug, Serialize)]
pub struct BenchMachine {
    #[serde(flatten)]
    machine: Machine,
    tandem: &'static str,
    rustc: &'static str,
    profile: &'static str,
    /// Load averages of the last 1, 5 and 15 minutes; times on a loaded machine are longer.
    load_values: Option<[f64; 3]>,
}

/// A report with the machine on which it was measured.
#[derive(Debug, Serialize)]
pub struct WithMachine<R> {
    machine: BenchMachine,
    #[serde(flatten)]
    report: R,
}

impl<R> WithMachine<R> {
    /// Adds this machine and its current load to `report`.
    pub fn here(report: R) -> WithMachine<R> {
        WithMachine { machine: BenchMachine::here(), report }
    }
}

impl<R: Serialize> WithMachine<R> {
    /// Writes the report as JSON.
    pub fn write(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        Ok(fs::write(path, serde_json::to_string_pretty(self)? + "\n")?)
    }
}

impl BenchMachine {
    /// Describes the machine on which this program runs, its load, and the program.
    pub fn here() -> BenchMachine {
        BenchMachine {
            machine: Machine::here(),
            tandem: env!("CARGO_PKG_VERSION"),
            rustc: env!("TANDEM_RUSTC"),
            profile: env!("TANDEM_PROFILE"),
            load_values: load(&fs::read_to_string("/proc/loadavg").unwrap_or_default()),
        }
    }
}

fn load(text: &str) -> Option<[f64; 3]> {
    let mut means = text.split_whitespace().map(|word| word.parse().ok());
    Some([means.next()??, means.next()??, means.next()??])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_load_is_read_from_the_systems_own_file() {
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
