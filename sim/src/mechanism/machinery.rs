//! Keys of a file: the initial state, and the schedule of its actuators' controls.

use super::{PlacedTree, joint_link};
use crate::SimError;
use crate::dynamics::{DPose3, DQuat, DVec3, Drive, Dynamics, LinkId, TreeId};
use crate::mjcf::{Actuator, ActuatorKind, Document, Key, LinkJoint};

/// Actuators of a file. They follow the controls of the key `start`, and from the time of every later
/// key those of that key.
#[derive(Default)]
pub(crate) struct Machinery {
    actuated: Vec<(LinkId, Actuator)>,
    /// Keys with controls, earliest first.
    keys: Vec<Key>,
}

/// Name of the keyframe in which a file begins.
pub(crate) const START: &str = "start";

impl Machinery {
    /// Collects the actuators and keys of a file whose trees were placed.
    pub fn of(document: &Document, placed: &[PlacedTree]) -> Result<Machinery, SimError> {
        let mut actuated: Vec<(LinkId, Actuator)> = Vec::new();
        for actuator in document.actuators()? {
            let Some(link) = joint_link(placed, &actuator.joint) else { continue };
            if actuated.iter().any(|(other, _)| *other == link) {
                let what = format!("joint `{}` has two actuators; put both into one", actuator.joint);
                return Err(document.unsupported(what));
            }
            if actuator.effort_range.is_some_and(|[low, high]| low != -high) {
                let what = format!("the actuator of joint `{}` is stronger one way", actuator.joint);
                return Err(document.unsupported(format!("{what}; use a forcerange of -x x")));
            }
            actuated.push((link, actuator));
        }
        let mut keys = document.keys()?;
        keys.retain(|key| (key.name == START || key.time_s > 0.0) && !key.controls.is_empty());
        keys.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        Ok(Machinery { actuated, keys })
    }

    /// Sets the drives from this time on. As in MuJoCo, an actuator's control is 0 before the first key.
    pub fn drive(&self, dynamics: &mut Dynamics, time_s: f64) {
        let key = self.keys.iter().rev().find(|key| key.time_s <= time_s);
        for (link, actuator) in &self.actuated {
            let command = key.map_or(0.0, |key| key.controls[actuator.index]);
            dynamics.tree_mut(link.tree).drive(link.link, drive(actuator, command));
        }
    }
}

fn drive(actuator: &Actuator, command: f64) -> Drive {
    let command = actuator.control_range.map_or(command, |[low, high]| command.clamp(low, high));
    match actuator.kind {
        ActuatorKind::Motor => Drive { feedforward: command * actuator.gear, ..Drive::NONE },
        ActuatorKind::Position { kp, kd } => {
            Drive { target: command / actuator.gear - actuator.placed_at, kp, kd, ..Drive::NONE }
        }
    }
}

/// Sets the trees of a file, which is at `world_from_file`, to the state of a key. Bodies that the key
/// leaves out stay in their placed poses, at rest.
pub(crate) fn begin(dynamics: &mut Dynamics, placed: &[PlacedTree], key: &Key, world_from_file: &DPose3) {
    let (mut positions, mut velocities) = (key.positions.as_slice(), key.velocities.as_slice());
    for PlacedTree { tree, id, .. } in placed {
        let Some(id) = *id else { continue };
        for (index, link) in tree.links.iter().enumerate() {
            match link.joint {
                LinkJoint::Fixed => {}
                LinkJoint::Free { .. } => {
                    let (position, velocity) = (take(&mut positions), take(&mut velocities));
                    put(dynamics, id, world_from_file, position, velocity);
                }
                LinkJoint::Hinge(_) | LinkJoint::Slide(_) => {
                    let tree = dynamics.tree_mut(id);
                    let [position] = take(&mut positions).unwrap_or([tree.joint_position(index)]);
                    let [velocity] = take(&mut velocities).unwrap_or_default();
                    tree.set_joint(index, position, velocity);
                }
            }
        }
    }
}

/// Sets a free body to the numbers of MuJoCo's `qpos` and `qvel`.
fn put(
    dynamics: &mut Dynamics,
    id: TreeId,
    world_from_file: &DPose3,
    position: Option<[f64; 7]>,
    velocity: Option<[f64; 6]>,
) {
    let tree = dynamics.tree_mut(id);
    let world_from_body = match position {
        Some([x, y, z, qw, qx, qy, qz]) => {
            let rotation = DQuat::from_xyzw(qx, qy, qz, qw).normalize();
            *world_from_file * DPose3::from_parts(DVec3::new(x, y, z), rotation)
        }
        None => tree.world_from_link(0),
    };
    let [vx, vy, vz, wx, wy, wz] = velocity.unwrap_or_default();
    let spin_rad_s = world_from_body.rotation * DVec3::new(wx, wy, wz);
    let velocity_m_s = world_from_file.rotation * DVec3::new(vx, vy, vz);
    tree.set_base(world_from_body, velocity_m_s, spin_rad_s);
}

/// Takes the next numbers of a key, if the key has numbers.
fn take<const N: usize>(rest: &mut &[f64]) -> Option<[f64; N]> {
    let (next, others) = rest.split_first_chunk()?;
    *rest = others;
    Some(*next)
}
