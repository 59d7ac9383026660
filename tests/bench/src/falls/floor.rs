//! A single robot on a floor without balance control: all joints, including the legs, follow random position
//! targets. `tests/peers/simulation/falls.py` sends the same commands to the robot in MuJoCo.

use std::sync::Arc;

use serde::Serialize;
use tandem_sim::body::{BodyEstimate, BodyScale, JOINTS, JointDrive, JointModel, LEGS, UPPER};
use tandem_sim::locomotion::{LegCommand, Locomotion};
use tandem_sim::{
    BaseCommand, BaseLimits, CONTROL_DT_S, PHYSICS_STEPS_PER_CONTROL, RobotCommand, RobotModel, Side, Sides,
    SplitMix64, World,
};

use super::commands::Stagger;
use super::{FallTrial, play};

/// Commands of a single robot on a floor.
#[derive(Clone, Debug, Serialize)]
pub struct FloorEpisode {
    pub seed: u64,
    pub amplitude_share: f32,
    pub hold_steps: u32,
    /// Joint targets at the end of each control step, in published order. Within a step, targets are
    /// interpolated linearly, and the drives' dampers receive the target speed as feedforward.
    pub targets_rad: Vec<Vec<f32>>,
}

impl FloorEpisode {
    fn draw(
        model: &RobotModel,
        rest_rad: &[f32; JOINTS],
        how: Stagger,
        steps: u32,
        seed: u64,
    ) -> FloorEpisode {
        let mut random = SplitMix64(seed);
        let (mut goal_rad, mut now_rad) = (*rest_rad, *rest_rad);
        let most_rad = how.pace_rad_s * CONTROL_DT_S;
        let mut row = |step: u32| {
            for joint in 0..JOINTS {
                if step.is_multiple_of(how.hold_steps) {
                    let limits = &model.joints[joint];
                    let anywhere_rad = random.uniform([limits.lower_rad, limits.upper_rad]);
                    goal_rad[joint] =
                        rest_rad[joint] + (anywhere_rad - rest_rad[joint]) * how.amplitude_share;
                }
                now_rad[joint] += (goal_rad[joint] - now_rad[joint]).clamp(-most_rad, most_rad);
            }
            now_rad.to_vec()
        };
        FloorEpisode {
            seed,
            amplitude_share: how.amplitude_share,
            hold_steps: how.hold_steps,
            targets_rad: (0..steps).map(&mut row).collect(),
        }
    }
}

/// Sends random joint targets to the robot of a world of one robot.
pub(super) fn thrash(world: &mut World, how: Stagger, steps: u32, seed: u64) -> FallTrial {
    let model = world.robots()[0].model.clone();
    let rest_rad = world.present().robots[0].sensed.joints.q_rad;
    let episode = FloorEpisode::draw(&model, &rest_rad, how, steps, seed);
    let rest = world.rest_command(0);
    let rows = Arc::new(episode.targets_rad.clone());
    let limits = world.robots()[0].base_limits();
    let legs = ScriptedLegs { limits, model, rows: rows.clone(), last_rad: rest_rad, tick: 0 };
    world.set_locomotion(0, Box::new(legs));
    let trial = play(world, steps, |_, step| {
        let upper_rad = UPPER.map(|joint| rows[step as usize][joint]);
        vec![RobotCommand { upper_rad, base: rest.base }]
    });
    FallTrial { floor: Some(episode), ..trial }
}

/// Base controller whose legs follow targets and do not balance.
struct ScriptedLegs {
    limits: BaseLimits,
    model: Arc<RobotModel>,
    rows: Arc<Vec<Vec<f32>>>,
    last_rad: [f32; JOINTS],
    tick: u32,
}

impl Locomotion for ScriptedLegs {
    fn limits(&self, _scale: &BodyScale) -> BaseLimits {
        self.limits
    }

    fn tick(&mut self, _: &BodyEstimate, _: &BaseCommand, _: f32) -> LegCommand {
        let (step, substep) = (self.tick / PHYSICS_STEPS_PER_CONTROL, self.tick % PHYSICS_STEPS_PER_CONTROL);
        self.tick += 1;
        let at = |step: u32| self.rows.get(step as usize).or(self.rows.last());
        let part = (substep + 1) as f32 / PHYSICS_STEPS_PER_CONTROL as f32;
        let drive = |joint: usize| {
            let before = step.checked_sub(1).and_then(at).map_or(self.last_rad[joint], |row| row[joint]);
            let to = at(step).map_or(before, |row| row[joint]);
            let JointModel { kp_n_m_rad, kd_n_m_s_rad, .. } = self.model.joints[joint];
            JointDrive {
                target_rad: before + (to - before) * part,
                kp_n_m_rad,
                kd_n_m_s_rad,
                feedforward_n_m: kd_n_m_s_rad * (to - before) / CONTROL_DT_S,
            }
        };
        Sides::from_fn(|side: Side| std::array::from_fn(|i| drive(LEGS[side] + i)))
    }

    fn let_go(&mut self) {
        self.tick = 0;
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_stdvec(&self.tick)
    }

    fn load(&mut self, state: &[u8]) -> Result<(), postcard::Error> {
        self.tick = postcard::from_bytes(state)?;
        Ok(())
    }
}
