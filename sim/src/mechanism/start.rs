//! The state in which a file begins.

use super::Placed;
use crate::dynamics::{DPose3, DQuat, DVec3, Dynamics, TreeId};
use crate::mjcf::{Key, LinkJoint};

/// Puts the trees of a file, which lies at `world_from_file`, where a key has them. What the key leaves out stays as the bodies are
/// placed, at rest.
pub(crate) fn begin(dynamics: &mut Dynamics, placed: &[Placed], key: &Key, world_from_file: &DPose3) {
    let (mut positions, mut velocities) = (key.positions.as_slice(), key.velocities.as_slice());
    for Placed { tree, id } in placed {
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

/// A free body by the numbers of MuJoCo's `qpos` and `qvel`.
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

/// The next numbers of a key, unless it has none.
fn take<const N: usize>(rest: &mut &[f64]) -> Option<[f64; N]> {
    let (next, others) = rest.split_first_chunk()?;
    *rest = others;
    Some(*next)
}
