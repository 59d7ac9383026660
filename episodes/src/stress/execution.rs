//! Execution of commands that differ from the policy's: late commands, a failing partner, and slow noise, if
//! an episode has any of these.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use tandem_sim::{BaseLimits, RobotCommand, RobotModel, UPPER_JOINTS};

use super::partner::FailingPartner;
use super::{Stress, StressAxis, latency};
use crate::variation::Disturbance;

/// Maximum change of a joint's target in a control step, 2 rad/s, until a robot has caught up with its
/// commands.
const CATCH_UP_RAD: f32 = 0.04;

/// Execution of the policy's commands by the robots.
#[derive(Clone, Debug)]
pub struct Execution {
    /// Delay of commands in control steps, by robot.
    late_steps: Vec<usize>,
    partner: Option<FailingPartner>,
    disturbance: Option<Disturbance>,
    /// Time at which the policy takes over.
    begin_s: f64,
    /// Commands executed until the first command takes effect.
    rest: Vec<RobotCommand>,
    memory: ExecutionMemory,
}

/// Memory of earlier steps.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ExecutionMemory {
    /// The policy's commands, as far back as any delay reaches.
    told: VecDeque<Vec<RobotCommand>>,
    /// Executed commands of the last step, without noise.
    done: Vec<RobotCommand>,
    /// True while a partner that failed has not caught up yet.
    is_behind: bool,
}

impl Execution {
    /// Creates the execution of an episode; `None` if robots do exactly as commanded. `rest` are
    /// the commands at the episode's start, and the policy takes over at `begin_s`.
    pub fn of(
        stress: Option<Stress>,
        disturbance: Option<Disturbance>,
        seed: u32,
        begin_s: f64,
        rest: Vec<RobotCommand>,
    ) -> Option<Execution> {
        let on = |axis: StressAxis| stress.and_then(|stress| stress.on(axis));
        let partner = on(StressAxis::Partner).map(|level| FailingPartner::of(level, seed, rest.len()));
        let all_late = on(StressAxis::Latency).map_or(0, latency::steps);
        let late = |robot: usize| {
            partner.filter(|partner| partner.robot == robot).map_or(all_late, |partner| partner.late_steps())
        };
        let late_steps = (0..rest.len()).map(late).collect::<Vec<_>>();
        let memory = ExecutionMemory { done: rest.clone(), ..ExecutionMemory::default() };
        let changes = partner.is_some() || all_late > 0 || disturbance.is_some();
        changes.then_some(Execution { late_steps, partner, disturbance, begin_s, rest, memory })
    }

    /// Returns the executed commands of the control step that begins at `time_s`, for the policy's commands
    /// `told`.
    pub fn execute<'a>(
        &mut self,
        time_s: f64,
        told: &[RobotCommand],
        robots: impl Iterator<Item = (&'a RobotModel, &'a BaseLimits)> + Clone,
    ) -> Vec<RobotCommand> {
        let mut done = self.arrived(told);
        if let Some(partner) = self.partner
            && let Some((_, limits)) = robots.clone().nth(partner.robot)
        {
            let robot = partner.robot;
            let before = self.memory.done[robot];
            let overridden = partner.overrides(time_s - self.begin_s, &done[robot], &before, limits);
            self.memory.is_behind |= overridden.is_some();
            let wanted = overridden.unwrap_or(done[robot]);
            done[robot] = if self.memory.is_behind { towards(&before, &wanted) } else { wanted };
            self.memory.is_behind &= overridden.is_some() || done[robot] != wanted;
        }
        self.memory.done.clone_from(&done);
        match &self.disturbance {
            None => done,
            Some(disturbance) => {
                let disturbed =
                    done.iter().zip(robots).enumerate().map(|(robot, (command, (model, limits)))| {
                        disturbance.executed(robot, time_s, command, model, limits)
                    });
                disturbed.collect()
            }
        }
    }

    /// Returns the commands that have reached the robots by now.
    fn arrived(&mut self, told: &[RobotCommand]) -> Vec<RobotCommand> {
        let farthest = self.late_steps.iter().copied().max().unwrap_or_default();
        if farthest == 0 {
            return told.to_vec();
        }
        let queue = &mut self.memory.told;
        queue.push_back(told.to_vec());
        if queue.len() > farthest + 1 {
            queue.pop_front();
        }
        let arrived = |(robot, late): (usize, &usize)| match queue.len().checked_sub(late + 1) {
            Some(index) => queue[index][robot],
            None => self.rest[robot],
        };
        self.late_steps.iter().enumerate().map(arrived).collect()
    }

    pub fn memory(&self) -> &ExecutionMemory {
        &self.memory
    }

    pub fn set_memory(&mut self, memory: ExecutionMemory) {
        self.memory = memory;
    }
}

/// Returns a step from the last executed command towards the wanted one, with limited joint speeds.
fn towards(before: &RobotCommand, wanted: &RobotCommand) -> RobotCommand {
    let upper_rad: [f32; UPPER_JOINTS] = std::array::from_fn(|column| {
        let (from_rad, to_rad) = (before.upper_rad[column], wanted.upper_rad[column]);
        if (to_rad - from_rad).abs() <= CATCH_UP_RAD {
            to_rad
        } else {
            from_rad + CATCH_UP_RAD.copysign(to_rad - from_rad)
        }
    });
    RobotCommand { upper_rad, base: wanted.base }
}

#[cfg(test)]
mod tests {
    use tandem_sim::BaseCommand;

    use super::*;
    use crate::stress::StressLevel;
    use crate::stress::partner;

    const DT_S: f64 = 0.02;
    const LIMITS: BaseLimits = BaseLimits {
        vx_m_s: [-0.3, 0.3],
        vy_m_s: [-0.3, 0.3],
        yaw_rate_rad_s: [-0.5, 0.5],
        pelvis_height_m: [0.5, 0.75],
    };

    /// Returns a command with all upper joints at one angle.
    fn command(angle_rad: f32) -> RobotCommand {
        let base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m: 0.7 };
        RobotCommand { upper_rad: [angle_rad; UPPER_JOINTS], base }
    }

    /// Returns the executed commands of two robots over `steps` steps, both commanded the same slow motion.
    fn played(axis: StressAxis, level: StressLevel, seed: u32, steps: usize) -> Vec<[RobotCommand; 2]> {
        let model = crate::spec::RobotFile::default().model().unwrap();
        let stress = Some(Stress { axis, level });
        let mut execution = Execution::of(stress, None, seed, 0.0, vec![command(0.0); 2]).unwrap();
        let step = |number: usize| {
            let told = [command(told_rad(number)); 2];
            let robots = [(&*model, &LIMITS); 2];
            let done = execution.execute(number as f64 * DT_S, &told, robots.into_iter());
            [done[0], done[1]]
        };
        (0..steps).map(step).collect()
    }

    fn told_rad(step: usize) -> f32 {
        0.001 * (step + 1) as f32
    }

    #[test]
    fn commands_are_late_by_so_many_steps_and_otherwise_as_told() {
        for (level, late) in StressLevel::ALL.into_iter().zip([2, 5, 10]) {
            for (step, done) in played(StressAxis::Latency, level, 3, 100).into_iter().enumerate() {
                let wanted = command(step.checked_sub(late).map_or(0.0, told_rad));
                assert_eq!(done, [wanted; 2], "step {step}");
            }
        }
        assert!(Execution::of(None, None, 3, 0.0, vec![command(0.0); 2]).is_none());
    }

    /// Returns the number of steps out of 20 s in which one robot deviates from its commands. The other
    /// robot must always follow them.
    fn strayed(level: StressLevel, seed: u32) -> (usize, Vec<[RobotCommand; 2]>) {
        let done = played(StressAxis::Partner, level, seed, 1000);
        let astray = |robot: usize| {
            let steps = done.iter().enumerate();
            steps.filter(|(step, done)| done[robot] != command(told_rad(*step))).count()
        };
        let [one, other] = [astray(0), astray(1)];
        assert_eq!(one.min(other), 0, "one robot alone fails: {one}, {other}");
        (one.max(other), done)
    }

    #[test]
    fn a_partner_fails_as_its_seed_has_it_the_longer_the_higher_the_level_and_the_same_again() {
        for seed in 10..20 {
            let strayed = StressLevel::ALL.map(|level| strayed(level, seed));
            let steps = strayed.each_ref().map(|(steps, _)| *steps);
            match partner::kind(seed) {
                "says nothing" => assert_eq!(steps, [0; 3]),
                // It is late in every step.
                "reacts late" => {
                    let last = strayed.each_ref().map(|(_, done)| {
                        done[999].iter().map(|done| done.upper_rad[0]).fold(f32::INFINITY, f32::min)
                    });
                    assert_eq!(
                        last.map(f32::to_bits),
                        [985, 970, 940].map(|step| told_rad(step - 1).to_bits())
                    );
                }
                kind => {
                    assert!(steps.is_sorted_by(|a, b| a < b) && steps[0] >= 40, "{kind}: {steps:?}");
                    // It has caught up at the end of each ten seconds.
                    for (_, done) in &strayed {
                        assert_eq!(done[499], [command(told_rad(499)); 2], "{kind}");
                    }
                }
            }
            assert_eq!(strayed[1].1, played(StressAxis::Partner, StressLevel::Two, seed, 1000));
        }
    }

    #[test]
    fn a_partner_does_what_it_is_said_to_do() {
        let failing = |kind: &str, level: StressLevel| {
            let seed = (100..).find(|seed| partner::kind(*seed) == kind).unwrap();
            let done = played(StressAxis::Partner, level, seed, 500);
            let is_astray = |(step, done): &(usize, &[RobotCommand; 2])| {
                done.iter().any(|done| *done != command(told_rad(*step)))
            };
            let first = done.iter().enumerate().find(is_astray).unwrap().0;
            let robot = (0..2).find(|robot| done[first][*robot] != command(told_rad(first))).unwrap();
            let of_robot: Vec<RobotCommand> = done.into_iter().map(|done| done[robot]).collect();
            (first, of_robot)
        };
        let (first, frozen) = failing("freezes", StressLevel::Two);
        let still =
            frozen[first..].iter().take_while(|done| done.upper_rad == frozen[first].upper_rad).count();
        assert!((99..=101).contains(&still), "two seconds: {still} steps");
        let (first, away) = failing("walks off", StressLevel::Two);
        let walks = away[first..].iter().take_while(|done| done.base.vx_m_s != 0.0).count();
        assert!((99..=101).contains(&walks), "{walks} steps");
        assert!((away[first].base.vx_m_s.hypot(away[first].base.vy_m_s) - 0.25).abs() < 1e-5);
        // Fingers open, and arms and waist follow their commands.
        let (first, open) = failing("drops what it holds", StressLevel::Two);
        let (fingers, arm) = (open[first + 20].upper_rad[14], open[first + 20].upper_rad[0]);
        assert!(fingers == 0.0 && arm == told_rad(first + 20), "{fingers} {arm}");
    }

    #[test]
    fn of_what_a_silent_partner_says_ever_less_is_heard() {
        let seed = (100..).find(|seed| partner::kind(*seed) == "says nothing").unwrap();
        let heard = StressLevel::ALL.map(|level| {
            let silence = Stress { axis: StressAxis::Partner, level }.silence(seed, 2).unwrap();
            assert!((0..8).all(|said| silence.lets_hear(1 - silence.robot, said)), "the other is heard");
            (0..8).filter(|said| silence.lets_hear(silence.robot, *said)).count()
        });
        assert_eq!(heard, [4, 2, 0]);
        assert_eq!(Stress { axis: StressAxis::Partner, level: StressLevel::One }.silence(seed + 1, 2), None);
    }
}
