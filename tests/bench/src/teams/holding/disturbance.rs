//! Disturbances of a team that holds an object and is commanded to stand.

use std::f32::consts::PI;

use tandem_sim::body::{
    ARM_COLUMNS, ARM_JOINTS, HAND_COLUMNS, HAND_JOINTS, UPPER_JOINTS, WAIST_COLUMN, WAIST_JOINTS,
};
use tandem_sim::{CONTROL_HZ, RobotCommand, Side, SplitMix64};

/// Offset of the targets of arms, waist and fingers. Nothing corrects it, because no robot measures the pose
/// of the load or of its teammates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ArmDisturbance {
    None,
    /// Offset (rad) of every robot's shoulder pitch joints, reached within a second. With negative values,
    /// the hands press towards the load ahead.
    Shoulders(f32),
    /// The same offset with the opposite sign for every second robot: all hands push the load in one
    /// direction.
    OneWay(f32),
    /// Normal noise with this standard deviation (rad) on arms and waist, redrawn five times a second.
    Noise(f32),
    /// The hands of the last robot open.
    LastOpens,
}

/// Time in which targets move to their disturbed values.
const COMES_S: f32 = 1.0;
const NOISE_STEPS: u32 = 10;

/// State of one disturbance.
pub(super) struct Disturber {
    disturbance: ArmDisturbance,
    random: SplitMix64,
    noise_rad: Vec<[f32; UPPER_JOINTS]>,
}

impl Disturber {
    pub(super) fn new(disturbance: ArmDisturbance, seed: u32, team_size: usize) -> Disturber {
        let noise_rad = vec![[0.0; UPPER_JOINTS]; team_size];
        Disturber { disturbance, random: SplitMix64(seed.into()), noise_rad }
    }

    /// Disturbs the commands of the team for one control step, the first being 0. `team` has the robots'
    /// indices in `commands`.
    pub(super) fn disturb(&mut self, control_step: u32, team: &[usize], commands: &mut [RobotCommand]) {
        let share = (control_step as f32 / (COMES_S * CONTROL_HZ as f32)).min(1.0);
        for (place, robot) in team.iter().enumerate() {
            let upper_rad = &mut commands[*robot].upper_rad;
            match self.disturbance {
                ArmDisturbance::None => {}
                ArmDisturbance::Shoulders(by_rad) => pitch_shoulders(upper_rad, by_rad * share),
                ArmDisturbance::OneWay(by_rad) => {
                    let sign = if place.is_multiple_of(2) { 1.0 } else { -1.0 };
                    pitch_shoulders(upper_rad, by_rad * share * sign);
                }
                ArmDisturbance::Noise(deviation_rad) => {
                    if control_step.is_multiple_of(NOISE_STEPS) {
                        self.noise_rad[place] = noise(deviation_rad, &mut self.random);
                    }
                    upper_rad
                        .iter_mut()
                        .zip(self.noise_rad[place])
                        .for_each(|(target, noise)| *target += noise);
                }
                ArmDisturbance::LastOpens if place + 1 == team.len() => {
                    for first in HAND_COLUMNS.iter() {
                        upper_rad[*first..*first + HAND_JOINTS].iter_mut().for_each(|q| *q *= 1.0 - share);
                    }
                }
                ArmDisturbance::LastOpens => {}
            }
        }
    }
}

fn pitch_shoulders(upper_rad: &mut [f32; UPPER_JOINTS], by_rad: f32) {
    for side in Side::BOTH {
        upper_rad[ARM_COLUMNS[side]] += by_rad;
    }
}

/// Draws normal noise on arms and waist.
fn noise(deviation_rad: f32, random: &mut SplitMix64) -> [f32; UPPER_JOINTS] {
    let mut noise_rad = [0.0; UPPER_JOINTS];
    let arms = Side::BOTH.into_iter().flat_map(|side| ARM_COLUMNS[side]..ARM_COLUMNS[side] + ARM_JOINTS);
    for column in arms.chain(WAIST_COLUMN..WAIST_COLUMN + WAIST_JOINTS) {
        let (size, angle) = (random.uniform([1e-6, 1.0]), random.uniform([0.0, 2.0 * PI]));
        noise_rad[column] = deviation_rad * (-2.0 * size.ln()).sqrt() * angle.cos();
    }
    noise_rad
}
