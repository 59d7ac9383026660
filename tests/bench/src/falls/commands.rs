//! Commands of staggering robots.

use std::sync::Arc;

use tandem_sim::body::{UPPER, UPPER_JOINTS};
use tandem_sim::{BaseCommand, BaseLimits, CONTROL_DT_S, RobotCommand, RobotModel, SplitMix64, World};

/// Parameters of a robot's staggering.
#[derive(Clone, Copy, Debug)]
pub struct Stagger {
    /// Amplitude of a joint's target, as a share of the distance from its rest angle to a random angle in its
    /// range.
    pub amplitude_share: f32,
    /// Number of control steps after which all targets are drawn anew.
    pub hold_steps: u32,
    /// Speed at which the targets move.
    pub pace_rad_s: f32,
}

/// Maximum base velocities drawn, before they are clamped to the controller's limits.
const FASTEST_BASE_M_S: f32 = 0.5;
const FASTEST_TURN_RAD_S: f32 = 0.5;

/// A robot's commands, drawn from a seed.
pub(super) struct Staggering {
    how: Stagger,
    random: SplitMix64,
    model: Arc<RobotModel>,
    limits: BaseLimits,
    rest_rad: [f32; UPPER_JOINTS],
    goal_rad: [f32; UPPER_JOINTS],
    command: RobotCommand,
}

impl Staggering {
    pub fn of(world: &World, robot: usize, how: Stagger, seed: u64) -> Staggering {
        let command = world.rest_command(robot);
        let robot_seed = seed.wrapping_mul(1_000_003).wrapping_add(robot as u64);
        let robot = &world.robots()[robot];
        Staggering {
            how,
            random: SplitMix64(robot_seed),
            model: robot.model.clone(),
            limits: robot.base_limits(),
            rest_rad: command.upper_rad,
            goal_rad: command.upper_rad,
            command,
        }
    }

    /// Sets joint angles to stagger about, instead of the rest pose.
    pub fn about(&mut self, rest_rad: [f32; UPPER_JOINTS]) {
        self.rest_rad = rest_rad;
    }

    /// Returns the command of control step `step`, counted from 0.
    pub fn next(&mut self, step: u32) -> RobotCommand {
        if step.is_multiple_of(self.how.hold_steps) {
            self.draw();
        }
        let most_rad = self.how.pace_rad_s * CONTROL_DT_S;
        for (target, goal) in self.command.upper_rad.iter_mut().zip(self.goal_rad) {
            *target += (goal - *target).clamp(-most_rad, most_rad);
        }
        self.command
    }

    fn draw(&mut self) {
        for (column, joint) in UPPER.into_iter().enumerate() {
            let model = &self.model.joints[joint];
            let anywhere_rad = self.random.uniform([model.lower_rad, model.upper_rad]);
            let rest_rad = self.rest_rad[column];
            self.goal_rad[column] = rest_rad + (anywhere_rad - rest_rad) * self.how.amplitude_share;
        }
        let mut velocity = |most: f32| self.random.uniform([-most, most]);
        let base = BaseCommand {
            vx_m_s: velocity(FASTEST_BASE_M_S),
            vy_m_s: velocity(FASTEST_BASE_M_S),
            yaw_rate_rad_s: velocity(FASTEST_TURN_RAD_S),
            pelvis_height_m: self.random.uniform(self.limits.pelvis_height_m),
        };
        self.command.base = self.limits.clamp(base);
    }
}
