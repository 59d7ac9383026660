//! A movement under way: wrists and fingers go in a straight line and arrive with the command's last step. The line is
//! straight in the world, or for carried targets in the pelvis frame.

use tandem_sim::{HAND_JOINTS, RobotCommand, Side, Sides, UPPER_JOINTS};

use super::aim::Aim;
use super::columns;
use super::motion::Motion;
use super::{Goals, Movement};

/// A movement under way.
pub struct Run {
    movement: Movement,
    steps: u32,
    done: u32,
    /// Of the kind of the aims that the movement goes to.
    from: Sides<Aim>,
    from_rad: [f64; UPPER_JOINTS],
}

impl Run {
    /// Has `motion` take up a movement of `steps` control steps; [`Run::command`] gives each of them.
    pub fn begin(movement: Movement, steps: u32, motion: &mut Motion) -> Run {
        match &movement {
            Movement::Hold => {}
            Movement::Reach(goals) => motion.aim(goals.wrists),
            Movement::Walk(_) | Movement::Rows(_) => motion.aim(Sides::both(Aim::Joints)),
        }
        let commanded = motion.commanded_wrists().map(|wrist| motion.without_yield(&wrist));
        let arrived = |side| motion.state().aims[side].at(motion.world_from_pelvis(), &commanded[side]);
        let from = Sides::from_fn(arrived);
        Run { movement, steps, done: 0, from, from_rad: motion.state().upper_rad }
    }

    /// The next control step's command.
    pub fn command(&mut self, motion: &mut Motion) -> RobotCommand {
        self.done += 1;
        motion.give_way(match &self.movement {
            Movement::Reach(goals) => goals.compliance_n_s_m,
            Movement::Hold | Movement::Walk(_) | Movement::Rows(_) => None,
        });
        match &self.movement {
            Movement::Hold => {
                motion.stand();
                motion.follow(&motion.state().aims.clone());
            }
            Movement::Walk(base) => motion.walk(*base),
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
        for side in Side::BOTH {
            if let Some(goal_rad) = &goals.fingers_rad[side] {
                let from_rad = &self.from_rad[columns::hand(side)];
                let between: [f64; HAND_JOINTS] =
                    std::array::from_fn(|i| from_rad[i] + (goal_rad[i] - from_rad[i]) * part);
                motion.set_fingers(side, &between);
            }
        }
        motion.follow(&Sides::from_fn(|side| self.from[side].towards(&goals.wrists[side], part)));
    }
}
