//! `move_wrists`: wrists and fingers move in a straight line and reach their goals at the order's last step.
//! The line is straight in the world frame, or for carried targets in the pelvis frame.

use nalgebra::{Isometry3, Translation3};
use tandem_sim::{BaseCommand, HAND_JOINTS, Side, Sides, UPPER_JOINTS};
use tandem_tools_spec::{PoseFrame, WristMove};

use super::aim::Aim;
use super::columns::{self, Clamped};
use super::motion::{Compliance, Motion, Restraint};
use crate::convert::unit_quaternion;

/// Trajectory of both wrists and their fingers.
pub struct WristTrajectory {
    steps: u32,
    /// Aims at the start, of the same kinds as the goals.
    from: Sides<Aim>,
    to: Sides<Aim>,
    compliance: Compliance,
    from_rad: [f64; UPPER_JOINTS],
    /// Goals of the fingers; `None` for fingers that stay.
    fingers_rad: Sides<Option<[f64; HAND_JOINTS]>>,
    base: BaseCommand,
}

impl WristTrajectory {
    /// Starts `entry` on `motion`, to be finished within `steps` control steps.
    pub fn begin(
        entry: &WristMove,
        steps: u32,
        motion: &mut Motion,
        clamped: &mut Clamped,
    ) -> WristTrajectory {
        let velocity =
            [entry.vx_m_s.unwrap_or(0.0), entry.vy_m_s.unwrap_or(0.0), entry.yaw_rate_rad_s.unwrap_or(0.0)];
        let base =
            clamped.base(&motion.robot.base_limits, motion.base_command(velocity, entry.pelvis_height_m));
        let to = aims(entry, motion);
        let mut fingers = |side: Side, asked_rad: &Option<[f64; HAND_JOINTS]>| {
            let first = columns::hand(side).start;
            asked_rad.map(|asked_rad| {
                std::array::from_fn(|finger| {
                    clamped.joint(&motion.robot.model, first + finger, asked_rad[finger])
                })
            })
        };
        let fingers_rad = Sides {
            left: fingers(Side::Left, &entry.left_fingers_rad),
            right: fingers(Side::Right, &entry.right_fingers_rad),
        };
        let restraint = Restraint {
            keeps_waist: entry.keep_waist.unwrap_or(false),
            stands_fast: entry.stand_fast.unwrap_or(false),
        };
        motion.aim(to, restraint, entry.frame.unwrap_or_default());
        let (pelvis, wrists) = (motion.world_from_pelvis(), motion.wrists());
        WristTrajectory {
            steps,
            from: Sides::from_fn(|side| to[side].at(pelvis, &wrists[side].unyielded)),
            to,
            compliance: Compliance {
                ahead_n_s_m: entry.compliance_n_s_m,
                side_n_s_m: entry.side_compliance_n_s_m,
                turn_n_m_s_rad: entry.turn_compliance_n_m_s_rad,
            },
            from_rad: motion.state().upper_rad,
            fingers_rad,
            base,
        }
    }

    /// Makes control step `step`, counted from 1.
    pub fn advance(&self, step: u32, motion: &mut Motion) {
        let part = f64::from(step) / f64::from(self.steps);
        motion.advance_yielding(self.compliance);
        motion.walk(self.base);
        for side in Side::BOTH {
            if let Some(goal_rad) = &self.fingers_rad[side] {
                let from_rad = &self.from_rad[columns::hand(side)];
                let between: [f64; HAND_JOINTS] =
                    std::array::from_fn(|i| from_rad[i] + (goal_rad[i] - from_rad[i]) * part);
                motion.set_fingers(side, &between);
            }
        }
        motion.follow(&Sides::from_fn(|side| self.from[side].towards(&self.to[side], part)));
    }
}

/// Returns the wrists' goals.
fn aims(entry: &WristMove, motion: &Motion) -> Sides<Aim> {
    let halves = Sides {
        left: (entry.left_position_m, entry.left_quaternion_wxyz),
        right: (entry.right_position_m, entry.right_quaternion_wxyz),
    };
    wrist_targets(halves, entry.frame.unwrap_or_default(), motion).map(|target| {
        match (target, entry.carried.unwrap_or(false)) {
            (None, _) => Aim::Joints,
            (Some(pelvis_from_wrist), true) => Aim::Carried(pelvis_from_wrist),
            (Some(pelvis_from_wrist), false) => Aim::World(motion.world_from_pelvis() * pelvis_from_wrist),
        }
    })
}

/// Optional position and orientation of a wrist.
type Halves = (Option<[f64; 3]>, Option<[f64; 4]>);

/// Converts wrist targets from `frame` to the pelvis frame. An omitted half keeps its earlier target, not
/// the pose after yielding; otherwise each command would let the hand yield anew.
pub fn wrist_targets(
    halves: Sides<Halves>,
    frame: PoseFrame,
    motion: &Motion,
) -> Sides<Option<Isometry3<f64>>> {
    let present = motion.wrists().map(|wrist| wrist.target);
    if frame == PoseFrame::Pelvis {
        // A conversion to another frame and back would change the omitted half by rounding.
        return Sides::from_fn(|side| wrist_target(halves[side].0, halves[side].1, &present[side]));
    }
    let pelvis_from_frame = motion.pelvis_from(frame);
    Sides::from_fn(|side| {
        let present = pelvis_from_frame.inv_mul(&present[side]);
        let (position_m, quaternion_wxyz) = halves[side];
        wrist_target(position_m, quaternion_wxyz, &present).map(|target| pelvis_from_frame * target)
    })
}

/// Returns a wrist's target in the pelvis frame, with an omitted half taken from `present`; `None` if
/// both are omitted.
fn wrist_target(
    position_m: Option<[f64; 3]>,
    quaternion_wxyz: Option<[f64; 4]>,
    present: &Isometry3<f64>,
) -> Option<Isometry3<f64>> {
    if position_m.is_none() && quaternion_wxyz.is_none() {
        return None;
    }
    let translation = position_m.map_or(present.translation, Translation3::from);
    let rotation = quaternion_wxyz.map_or(present.rotation, unit_quaternion);
    Some(Isometry3::from_parts(translation, rotation))
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    /// A third of a metre has infinitely many decimals, while replies have six.
    #[test]
    fn what_is_left_out_stays_to_the_last_bit() {
        let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.7, 1.0 / 3.0));
        let present = Isometry3::from_parts(Translation3::new(1.0 / 3.0, -0.2, 0.1), turned);
        let ahead = [1.0, 0.0, 0.0, 0.0];
        let moved = wrist_target(Some([0.3, -0.2, 0.15]), None, &present).unwrap();
        assert_eq!(moved, Isometry3::from_parts(Translation3::new(0.3, -0.2, 0.15), turned));
        let turned = wrist_target(None, Some(ahead), &present).unwrap();
        assert_eq!(turned, Isometry3::from_parts(present.translation, UnitQuaternion::identity()));
        assert_eq!(wrist_target(None, None, &present), None);
        let both = wrist_target(Some([0.3, -0.2, 0.15]), Some(ahead), &present);
        assert_eq!(both, Some(Isometry3::translation(0.3, -0.2, 0.15)));
    }
}
