//! The flags for stress: disturbances in episodes.

use clap::Args;
use tandem_episodes::stress::{Stress, StressAxis, StressLevel};

use crate::settings::{Layer, one_of};

/// Stress of every episode.
#[derive(Debug, Args)]
pub struct StressFlags {
    /// Disturbance: one of the stress axes of `evaluate`; results name it.
    #[arg(long, env = "TANDEM_STRESS", value_name = "AXIS", value_parser = one_of(StressAxis::ALL, StressAxis::name))]
    stress: Option<StressAxis>,
    /// Level of the stress, from 1 to 3 [default: 1].
    #[arg(long, env = "TANDEM_LEVEL", value_name = "LEVEL", requires = "stress")]
    level: Option<StressLevel>,
}

impl StressFlags {
    /// Returns the stress for the specification of an episode.
    pub fn stress(&self) -> Option<Stress> {
        self.stress.map(|axis| Stress { axis, level: self.level.unwrap_or(StressLevel::One) })
    }

    /// Adds the stress to the settings of a server.
    pub fn over(self, layer: Layer) -> Layer {
        Layer { stress: self.stress, level: self.level, ..layer }
    }
}

/// Stress of evaluations that are played in addition to the evaluation without stress.
#[derive(Debug, Args)]
pub struct StressPlanFlags {
    /// Also play under stress: a comma-separated list of camera, light, texture, layout, mass, friction,
    /// sensors, latency, push, words and partner, or `all`. Each axis and level repeats the same episodes in
    /// its own folder, in the folder `stress` of --out.
    #[arg(long, env = "TANDEM_STRESS", value_name = "AXES", value_parser = parse_axes)]
    stress: Option<Axes>,
    /// Levels of each axis: one, or a range such as 1..3 or 1-3, both ends included [default: 1..3].
    #[arg(long, env = "TANDEM_LEVEL", value_name = "LEVELS", value_parser = parse_levels, requires = "stress")]
    level: Option<Levels>,
}

/// Axes given on the command line. The separate type keeps clap from treating them as a flag that can be
/// given several times.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Axes(Vec<StressAxis>);

/// Levels given on the command line. The type is separate for the same reason as [`Axes`].
#[derive(Debug, Clone, PartialEq, Eq)]
struct Levels(Vec<StressLevel>);

fn parse_axes(text: &str) -> Result<Axes, String> {
    let axis = |name: &str| {
        let found = StressAxis::ALL.into_iter().find(|axis| axis.name() == name.trim());
        found.ok_or_else(|| {
            let have = StressAxis::ALL.map(StressAxis::name).join(", ");
            format!("no axis {name:?}; have: {have}, or all")
        })
    };
    match text {
        "all" => Ok(Axes(StressAxis::ALL.to_vec())),
        names => names.split(',').map(axis).collect::<Result<_, _>>().map(Axes),
    }
}

fn parse_levels(text: &str) -> Result<Levels, String> {
    let (first, last) = text.split_once("..").or_else(|| text.split_once('-')).unwrap_or((text, text));
    let [first, last]: [StressLevel; 2] = [first.parse()?, last.parse()?];
    let levels: Vec<StressLevel> =
        StressLevel::ALL.into_iter().filter(|level| (first..=last).contains(level)).collect();
    if levels.is_empty() { Err("no level; give one, or a range as 1..3".into()) } else { Ok(Levels(levels)) }
}

impl StressPlanFlags {
    /// Returns all combinations of axes and levels, axis by axis.
    pub fn stresses(&self) -> Vec<Stress> {
        let levels = self.level.as_ref().map_or(&StressLevel::ALL[..], |Levels(levels)| levels);
        let axes = self.stress.iter().flat_map(|Axes(axes)| axes);
        axes.flat_map(|axis| levels.iter().map(|level| Stress { axis: *axis, level: *level })).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_name_axes_and_levels() {
        let all = |axes: &str, levels: Option<&str>| {
            let flags = StressPlanFlags {
                stress: Some(parse_axes(axes)?),
                level: levels.map(parse_levels).transpose()?,
            };
            let names: Vec<String> = flags.stresses().iter().map(Stress::to_string).collect();
            Ok::<String, String>(names.join(" "))
        };
        assert_eq!(all("push,camera", Some("2")).unwrap(), "push-2 camera-2");
        assert_eq!(all("push", None).unwrap(), "push-1 push-2 push-3");
        assert_eq!(all("push", Some("1..2")).unwrap(), "push-1 push-2");
        assert_eq!(all("all", Some("2-3")).unwrap().split(' ').count(), 22);
        for (axes, levels, error) in [
            ("pusch", None, "no axis \"pusch\"; have: camera, light"),
            ("push", Some("4"), "no level 4 of stress; have: 1, 2, 3"),
            ("push", Some("3..1"), "give one, or a range as 1..3"),
            ("push", Some("much"), "no level \"much\" of stress; have: 1, 2, 3"),
        ] {
            let found = all(axes, levels).unwrap_err();
            assert!(found.contains(error), "{found}");
        }
    }
}
