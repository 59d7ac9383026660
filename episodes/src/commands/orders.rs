//! What a tool's arguments ask of one robot, within the limits of its joints and its base.

use nalgebra::Isometry3;
use tandem_sim::{BaseCommand, HAND_JOINTS, Side, Sides, UPPER, UPPER_JOINTS};
use tandem_tools_spec::{WalkMove, WristMove};

use super::aim::Aim;
use super::columns;
use super::motion::{Motion, RobotSheet};
use super::{Cut, Goals, Movement, Order, Row};
use crate::convert::{isometry, wire_pose};

pub fn reach(entry: &WristMove, motion: &Motion) -> Order {
    let mut cut = Cut::default();
    let velocity =
        [entry.vx_m_s.unwrap_or(0.0), entry.vy_m_s.unwrap_or(0.0), entry.yaw_rate_rad_s.unwrap_or(0.0)];
    let base = base(velocity, entry.pelvis_height_m, motion, &mut cut);
    let present = motion.targets();
    let targets = Sides {
        left: wrist_target(entry.left_position_m, entry.left_quaternion_wxyz, &present.left),
        right: wrist_target(entry.right_position_m, entry.right_quaternion_wxyz, &present.right),
    };
    let wrists = targets.map(|target| match (target, entry.carried.unwrap_or(false)) {
        (None, _) => Aim::Joints,
        (Some(pelvis_from_wrist), true) => Aim::Carried(pelvis_from_wrist),
        (Some(pelvis_from_wrist), false) => Aim::World(motion.world_from_pelvis() * pelvis_from_wrist),
    });
    let mut fingers = |side: Side, asked_rad: &Option<[f64; HAND_JOINTS]>| {
        let first = columns::hand(side).start;
        asked_rad.map(|asked_rad| {
            std::array::from_fn(|finger| {
                within_joint_limits(&motion.robot, first + finger, asked_rad[finger], &mut cut)
            })
        })
    };
    let fingers_rad = Sides {
        left: fingers(Side::Left, &entry.left_fingers_rad),
        right: fingers(Side::Right, &entry.right_fingers_rad),
    };
    let compliance_n_s_m = entry.compliance_n_s_m;
    Order { movement: Movement::Reach(Box::new(Goals { wrists, compliance_n_s_m, fingers_rad, base })), cut }
}

pub fn walk(entry: &WalkMove, motion: &Motion) -> Order {
    let mut cut = Cut::default();
    let velocity = [entry.vx_m_s, entry.vy_m_s, entry.yaw_rate_rad_s];
    let base = base(velocity, entry.pelvis_height_m, motion, &mut cut);
    Order { movement: Movement::Walk(base), cut }
}

pub fn rows(rows: &[Vec<f64>], motion: &Motion) -> Order {
    let mut cut = Cut::default();
    let row = |row: &Vec<f64>| {
        let upper_rad =
            std::array::from_fn(|column| within_joint_limits(&motion.robot, column, row[column], &mut cut));
        let asked = columns::base_command(std::array::from_fn(|i| row[UPPER_JOINTS + i] as f32));
        Row { upper_rad, base: within_base_limits(&motion.robot, asked, &mut cut) }
    };
    let rows = rows.iter().map(row).collect();
    Order { movement: Movement::Rows(rows), cut }
}

/// A pose of which either half may be left as it was; `None` where both are.
pub fn wrist_target(
    position_m: Option<[f64; 3]>,
    quaternion_wxyz: Option<[f64; 4]>,
    present: &Isometry3<f64>,
) -> Option<Isometry3<f64>> {
    if position_m.is_none() && quaternion_wxyz.is_none() {
        return None;
    }
    let kept = wire_pose(present);
    Some(isometry(position_m.unwrap_or(kept.position_m), quaternion_wxyz.unwrap_or(kept.quaternion_wxyz)))
}

/// Without a height, the base keeps the one it was last told.
fn base(velocity_command: [f64; 3], height_m: Option<f64>, motion: &Motion, cut: &mut Cut) -> BaseCommand {
    let [vx_m_s, vy_m_s, yaw_rate_rad_s] = velocity_command.map(|part| part as f32);
    let pelvis_height_m = height_m.map_or(motion.base().pelvis_height_m, |height_m| height_m as f32);
    let asked = BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m };
    within_base_limits(&motion.robot, asked, cut)
}

fn within_base_limits(robot: &RobotSheet, asked: BaseCommand, cut: &mut Cut) -> BaseCommand {
    let done = robot.base_limits.clamp(asked);
    for field in columns::clamped_fields(&asked, &done) {
        if !cut.base.contains(&field) {
            cut.base.push(field);
        }
    }
    done
}

fn within_joint_limits(robot: &RobotSheet, column: usize, asked_rad: f64, cut: &mut Cut) -> f64 {
    let joint = &robot.model.joints[UPPER[column]];
    let within_rad = asked_rad.clamp(joint.lower_rad.into(), joint.upper_rad.into());
    if within_rad != asked_rad && !cut.columns.contains(&column) {
        cut.columns.push(column);
    }
    within_rad
}
