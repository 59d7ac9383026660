//! Cases of the bench of base controllers in which teams hold an object together and are commanded to stand.
//! They require hands.
//!
//! The teams grasp an object with the experts' skills, lift it and, in some cases, walk a short distance with
//! it. Then all bases are commanded to stand and all arms to keep their posture, except for the case's
//! disturbance.

mod disturbance;
pub(super) mod loads;
mod measure;

use std::ops::RangeInclusive;

use tandem_episodes::{
    Controller, EpisodeSpec, RobotFile, Session,
    players::{InProcess, PlayerError, experts::skills::HandMove},
};
use tandem_sim::render::RendererKind;
use tandem_sim::{BaseCommand, CONTROL_HZ, RobotCommand, Sensing, Side, Vector};
use tandem_tools_spec::Protocol;

use crate::error::BenchError;
use crate::report::{CaseFigures, CaseReport};
use crate::seeds::{is_asked, over_seeds};
use disturbance::{ArmDisturbance, Disturber};
use loads::{BAR, BASKET, LEGS, ROUND_TABLE, SharedLoad, TABLE};
use measure::{HoldMeasure, HoldResult};

/// The team's action before the command to stand.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Before {
    Lifts,
    /// Lifts the object and walks a short distance with it. The team is commanded to stand while it walks.
    Carries,
    /// Lowers the targets of the first robot's hands by this distance.
    LowersOne(f32),
    /// Sets the object down, with targets below its resting height by this distance.
    SetsDown(f32),
}

/// A team's load, the load's mass, and the team's action before the command to stand.
#[derive(Clone, Copy)]
struct Setup {
    load: &'static SharedLoad,
    before: Before,
    /// Mass of the load per robot. `None` keeps the mass in the object's file.
    robot_share_kg: Option<f32>,
}

const HOLDS_S: f32 = 6.0;
const LOWERING_S: f32 = 1.0;

/// Returns each setup with its cases: the suffix of the case's name, and its disturbance. All cases of a
/// setup branch from the same episode at the command to stand.
fn setups() -> Vec<(Setup, Vec<(&'static str, ArmDisturbance)>)> {
    use ArmDisturbance::{LastOpens, Noise, None as Undisturbed, OneWay, Shoulders};
    let mut setups = Vec::new();
    for load in [&TABLE, &ROUND_TABLE, &LEGS, &BASKET, &BAR] {
        let setup = Setup { load, before: Before::Lifts, robot_share_kg: None };
        let all = vec![
            ("", Undisturbed),
            ("_press_0.05", Shoulders(-0.05)),
            ("_press_0.10", Shoulders(-0.10)),
            ("_pull_0.05", Shoulders(0.05)),
            ("_pull_0.10", Shoulders(0.10)),
            ("_one_way_0.10", OneWay(0.10)),
            ("_noise_0.02", Noise(0.02)),
            ("_noise_0.05", Noise(0.05)),
            ("_opens", LastOpens),
        ];
        setups.push((setup, all));
        setups.push((Setup { before: Before::LowersOne(0.05), ..setup }, vec![("_low", Undisturbed)]));
        let carried = vec![("_stop", Undisturbed), ("_stop_press_0.10", Shoulders(-0.10))];
        setups.push((Setup { before: Before::Carries, ..setup }, carried));
        for (kg, names) in [
            (1.0, ["_1kg", "_1kg_press_0.10"]),
            (3.0, ["_3kg", "_3kg_press_0.10"]),
            (5.0, ["_5kg", "_5kg_press_0.10"]),
        ] {
            let heavy = vec![(names[0], Undisturbed), (names[1], Shoulders(-0.10))];
            setups.push((Setup { robot_share_kg: Some(kg), ..setup }, heavy));
        }
    }
    for load in [&TABLE, &ROUND_TABLE, &LEGS, &BASKET] {
        let setup = Setup { load, before: Before::SetsDown(0.02), robot_share_kg: None };
        setups.push((setup, vec![("_set_down", Undisturbed)]));
    }
    setups
}

/// Plays the cases whose names match `filter` on these seeds.
pub fn run(
    robot: &RobotFile,
    controller: &Controller,
    sensing: Sensing,
    filter: &str,
    seeds: &RangeInclusive<u32>,
    done: &mut dyn FnMut(CaseReport),
) -> Result<(), BenchError> {
    for (setup, mut cases) in setups() {
        cases.retain(|(end, _)| is_asked(filter, &format!("{}{end}", setup.load.name)));
        if cases.is_empty() {
            continue;
        }
        let tried: Vec<ArmDisturbance> = cases.iter().map(|(_, disturbance)| *disturbance).collect();
        let trials = over_seeds(seeds, |seed| {
            let spec = setup.spec(robot, controller, sensing, seed)?;
            setup.trials(&spec, &tried)
        });
        let trials = trials.into_iter().collect::<Result<Vec<_>, BenchError>>()?;
        for (place, (end, _)) in cases.iter().enumerate() {
            let held: Vec<&HoldResult> = trials.iter().filter_map(|trial| trial[place].as_ref()).collect();
            done(report(&format!("{}{end}", setup.load.name), trials.len(), &held));
        }
    }
    Ok(())
}

fn report(name: &str, seeds: usize, held: &[&HoldResult]) -> CaseReport {
    let worst = |value: fn(&HoldResult) -> f32| held.iter().map(|held| value(held)).reduce(f32::max);
    let figures = CaseFigures {
        final_drift_m: worst(|held| held.drift_m),
        sway_m: worst(|held| held.late_drift_m),
        load_drift_m: worst(|held| held.load_drift_m),
        standing_after_s: worst(|held| held.standing_after_s),
        load_tilt_deg: worst(|held| held.tilt_deg),
        power_w: held.iter().map(|held| held.power_w).sum::<f32>() / held.len().max(1) as f32,
        ..CaseFigures::default()
    };
    CaseReport { case: name.into(), seeds, survived: held.len(), figures }
}

impl Setup {
    fn spec(
        &self,
        robot: &RobotFile,
        controller: &Controller,
        sensing: Sensing,
        seed: u32,
    ) -> Result<EpisodeSpec, BenchError> {
        Ok(EpisodeSpec {
            robot: robot.clone(),
            locomotion: controller.clone(),
            sensing,
            renderer: RendererKind::Cpu,
            ..EpisodeSpec::new(self.load.task(), seed, Protocol::Benchmark)
        })
    }

    /// Returns the result of each disturbance, all applied from the same state. A result is `None` if a robot
    /// fell, or the team did not grasp the object.
    fn trials(
        &self,
        spec: &EpisodeSpec,
        tried: &[ArmDisturbance],
    ) -> Result<Vec<Option<HoldResult>>, BenchError> {
        let mut session = Session::start(spec, None).map_err(Box::new)?;
        if let Some(robot_share_kg) = self.robot_share_kg {
            let mass_kg = robot_share_kg * self.load.team_size() as f32;
            session.world_mut().set_mass(self.load.object, mass_kg.into());
        }
        let mut episode = InProcess::new(session);
        let team: Vec<usize> = self.load.team().collect();
        let began_m = match self.begin(&mut episode, &team) {
            Ok(began_m) => began_m,
            Err(PlayerError::GaveUp(_) | PlayerError::EpisodeOver) => return Ok(vec![None; tried.len()]),
            Err(error) => return Err(error.into()),
        };
        let commands = standing(&episode.session);
        let world = episode.session.world_mut();
        let moment = world.snapshot()?;
        let mut outcomes = Vec::with_capacity(tried.len());
        for disturbance in tried {
            world.restore(&moment)?;
            let mut disturber = Disturber::new(*disturbance, spec.seed, team.len());
            let mut measure = HoldMeasure::new(&world.present(), self.load.object, &team, began_m.as_deref());
            let steps = (HOLDS_S * CONTROL_HZ as f32) as u32;
            for step in 0..steps {
                let mut commands = commands.clone();
                disturber.disturb(step, &team, &mut commands);
                measure.add(&world.control_step(&commands).map_err(tandem_sim::SimError::from)?);
            }
            outcomes.push(measure.held());
        }
        Ok(outcomes)
    }

    /// Plays up to the command to stand. Returns the pelvis positions at the moment when the team began to
    /// set the object down, or `None` if the case does not set it down.
    fn begin(&self, episode: &mut InProcess, team: &[usize]) -> Result<Option<Vec<Vector>>, PlayerError> {
        match self.before {
            Before::Lifts => self.load.take(episode, false)?,
            Before::Carries => self.load.take(episode, true)?,
            Before::LowersOne(by_m) => self.load.with_team(episode, |commander, _| {
                let robot = team[0];
                let mut lower = Vec::new();
                for side in Side::BOTH {
                    let mut wrist = commander.world_from_wrist(robot, side)?;
                    wrist.translation.z -= by_m;
                    lower.push(HandMove::reach(robot, side, wrist));
                }
                commander.perform(LOWERING_S, &lower)
            })?,
            Before::SetsDown(by_m) => {
                let rested = episode.session.facts().object(self.load.object).pose_in_world;
                let mut began_m = Vec::new();
                self.load.with_team(episode, |commander, carry_team| {
                    let facts = commander.facts()?;
                    began_m =
                        team.iter().map(|robot| facts.robots[*robot].pelvis_in_world.translation).collect();
                    let mut place = carry_team.object(commander)?;
                    place.translation.z = rested.translation.z - by_m;
                    carry_team.set_down(commander, &place)
                })?;
                return Ok(Some(began_m));
            }
        }
        Ok(None)
    }
}

/// Returns the last commands of all robots, with their bases commanded to stand.
fn standing(session: &Session) -> Vec<RobotCommand> {
    let stand = |command: RobotCommand| RobotCommand {
        base: BaseCommand::standing(command.base.pelvis_height_m),
        ..command
    };
    session.present().robots.iter().map(|robot| stand(robot.command)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Limits on the drift of pelvises and loads from 1.5 s after the command, and on the time until the last
    /// robot stands.
    const MAX_SWAY_M: f32 = 0.03;
    const MAX_LOAD_DRIFT_M: f32 = 0.02;
    const MAX_STANDING_AFTER_S: f32 = 1.5;

    /// Plays these cases on three seeds and checks each against the limits.
    fn comes_to_rest(filter: &str) {
        let mut played = 0;
        let mut check = |report: CaseReport| {
            played += 1;
            assert_eq!(report.survived, report.seeds, "{report}");
            let most = |value: Option<f32>| value.expect("measured in every case");
            assert!(most(report.figures.sway_m) <= MAX_SWAY_M, "{report}");
            assert!(most(report.figures.load_drift_m) <= MAX_LOAD_DRIFT_M, "{report}");
            assert!(most(report.figures.standing_after_s) <= MAX_STANDING_AFTER_S, "{report}");
        };
        let (robot, controller) = (RobotFile::default(), Controller::default());
        run(&robot, &controller, Sensing::default(), filter, &(3000..=3002), &mut check).unwrap();
        assert!(played > 0, "no case is called {filter}");
    }

    #[test]
    fn teams_with_a_table_come_to_rest() {
        comes_to_rest("shared_table_press,shared_table_stop,shared_table_one_way,shared_table_set_down");
    }

    #[test]
    fn teams_of_three_come_to_rest() {
        comes_to_rest("shared_round_table_press,shared_round_table_stop,shared_round_table_set_down");
    }

    #[test]
    fn teams_that_hold_legs_come_to_rest() {
        comes_to_rest("shared_legs_press,shared_legs_pull,shared_legs_stop,shared_legs_opens");
    }

    #[test]
    fn teams_with_a_basket_or_a_bar_come_to_rest() {
        comes_to_rest("shared_basket_press,shared_basket_set_down,shared_bar_press");
    }
}
