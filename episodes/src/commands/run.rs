//! A movement under way: wrists and fingers go in a straight line and arrive with the command's last step.

use nalgebra::Isometry3;
use tandem_sim::{HAND_JOINTS, RobotCommand, Side, Sides, UPPER_JOINTS};

use super::columns;
use super::motion::Motion;
use super::{Goals, Movement};

/// A movement under way.
pub struct Run {
    movement: Movement,
    steps: u32,
    done: u32,
    from_wrists: Sides<Isometry3<f64>>,
    from_rad: [f64; UPPER_JOINTS],
}

impl Run {
    /// Has `motion` take up a movement of `steps` control steps; [`Run::command`] gives each of them.
    pub fn begin(movement: Movement, steps: u32, motion: &mut Motion) -> Run {
        let (from_wrists, from_rad) = (motion.commanded_wrists(), motion.state().upper_rad);
        match &movement {
            Movement::Reach(goals) => motion.aim(&goals.wrists),
            Movement::Hold | Movement::Walk(_) | Movement::Rows(_) => {}
        }
        Run { movement, steps, done: 0, from_wrists, from_rad }
    }

    /// The next control step's command.
    pub fn command(&mut self, motion: &mut Motion) -> RobotCommand {
        self.done += 1;
        let targets = *motion.targets();
        match &self.movement {
            Movement::Hold => {
                motion.stand();
                motion.follow(&targets);
            }
            Movement::Walk(base) => {
                motion.walk(*base);
                motion.follow(&targets);
            }
            Movement::Reach(goals) => self.reach(goals, motion),
            Movement::Rows(rows) => {
                let row = rows[self.done as usize - 1];
                motion.walk(row.base);
                motion.set_joints(row.upper_rad);
            }
        }
        let state = motion.state();
        RobotCommand { upper_rad: state.upper_rad.map(|target_rad| target_rad as f32), base: state.base }
    }

    fn reach(&self, goals: &Goals, motion: &mut Motion) {
        let part = f64::from(self.done) / f64::from(self.steps);
        motion.walk(goals.base);
        let mut targets = *motion.targets();
        for side in Side::BOTH {
            if let Some(goal_rad) = &goals.fingers_rad[side] {
                let from_rad = &self.from_rad[columns::hand(side)];
                let between: [f64; HAND_JOINTS] =
                    std::array::from_fn(|i| from_rad[i] + (goal_rad[i] - from_rad[i]) * part);
                motion.set_fingers(side, &between);
            }
            if let Some(goal) = &goals.wrists[side] {
                targets[side] = between(&self.from_wrists[side], goal, part);
            }
        }
        motion.follow(&targets);
    }
}

fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    from.try_lerp_slerp(to, share, 1e-9).unwrap_or(*to)
}
