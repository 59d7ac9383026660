//! Robots for tests: the embedded model with any pose and motion, without a physics world.

use std::sync::{Arc, OnceLock};

use rapier3d::math::{Pose, Rotation, Vector};

use super::{Acceleration, BodyEstimate, JOINTS, KnownOfBody, RobotModel};
use crate::{GRAVITY_M_S2, Sides, assets};

/// Returns the embedded robot.
pub(crate) fn model() -> &'static Arc<RobotModel> {
    static MODEL: OnceLock<Arc<RobotModel>> = OnceLock::new();
    MODEL.get_or_init(|| {
        let text = assets::robot(assets::DEFAULT_ROBOT).unwrap();
        Arc::new(RobotModel::parse("robot.xml", text).unwrap())
    })
}

/// A pose and its velocities.
#[derive(Clone)]
pub(crate) struct Posed {
    pub world_from_pelvis: Pose,
    pub pelvis_velocity_m_s: Vector,
    pub pelvis_angular_velocity_rad_s: Vector,
    pub q_rad: [f32; JOINTS],
    pub qd_rad_s: [f32; JOINTS],
}

impl Posed {
    /// Returns the robot at rest as in its file, with the soles on the ground.
    pub(crate) fn standing() -> Posed {
        let mut posed = Posed {
            world_from_pelvis: Pose::IDENTITY,
            pelvis_velocity_m_s: Vector::ZERO,
            pelvis_angular_velocity_rad_s: Vector::ZERO,
            q_rad: std::array::from_fn(|joint| model().joints[joint].rest_rad),
            qd_rad_s: [0.0; JOINTS],
        };
        posed.world_from_pelvis.translation.z = -posed.body().world_from_soles().left.translation.z;
        posed
    }

    /// Returns a robot that is turned, leaning and moving, with each joint within its limits. The state
    /// depends on `seed`.
    pub(crate) fn tumbling(seed: u32) -> Posed {
        let wave = |i: usize, part: f32| (1.7 * i as f32 + 2.3 * seed as f32 + part).sin();
        let mut posed = Posed::standing();
        posed.world_from_pelvis.rotation = Rotation::from_rotation_z(0.4 + seed as f32)
            * Rotation::from_rotation_y(0.3)
            * Rotation::from_rotation_x(-0.2);
        posed.pelvis_velocity_m_s = Vector::new(0.3, -0.2, 0.1);
        posed.pelvis_angular_velocity_rad_s = Vector::new(-0.5, 0.4, 0.8);
        for (i, joint) in model().joints.iter().enumerate() {
            let half_rad = 0.5 * (joint.upper_rad - joint.lower_rad);
            posed.q_rad[i] = joint.lower_rad + half_rad * (1.0 + 0.6 * wave(i, 0.0));
            posed.qd_rad_s[i] = 1.2 * wave(i, 1.0);
        }
        posed
    }

    /// Returns the state `time_s` later under constant accelerations of the pelvis and of the joints
    /// (rad/s^2).
    pub(crate) fn after(&self, time_s: f32, pelvis: Acceleration, qdd_rad_s2: &[f32; JOINTS]) -> Posed {
        let half_s2 = 0.5 * time_s * time_s;
        let turn_rad = self.pelvis_angular_velocity_rad_s * time_s + pelvis.angular_rad_s2 * half_s2;
        Posed {
            world_from_pelvis: Pose::from_parts(
                self.world_from_pelvis.translation
                    + self.pelvis_velocity_m_s * time_s
                    + pelvis.linear_m_s2 * half_s2,
                Rotation::from_scaled_axis(turn_rad) * self.world_from_pelvis.rotation,
            ),
            pelvis_velocity_m_s: self.pelvis_velocity_m_s + pelvis.linear_m_s2 * time_s,
            pelvis_angular_velocity_rad_s: self.pelvis_angular_velocity_rad_s
                + pelvis.angular_rad_s2 * time_s,
            q_rad: std::array::from_fn(|i| {
                self.q_rad[i] + self.qd_rad_s[i] * time_s + qdd_rad_s2[i] * half_s2
            }),
            qd_rad_s: std::array::from_fn(|i| self.qd_rad_s[i] + qdd_rad_s2[i] * time_s),
        }
    }

    /// Returns the body estimate for a controller, with empty hands.
    pub(crate) fn body(&self) -> BodyEstimate {
        let model = model();
        let world_from_link = model.forward_kinematics(self.world_from_pelvis, &self.q_rad);
        let (mut com_m, mut com_velocity_m_s) = (Vector::ZERO, Vector::ZERO);
        for ((link, world), moving) in model.links.iter().zip(&world_from_link).zip(self.motions()) {
            let part = link.mass.mass() / model.mass_kg;
            com_m += *world * link.mass.local_com * part;
            com_velocity_m_s += moving.velocity_at(world.rotation * link.mass.local_com) * part;
        }
        BodyEstimate {
            model: Arc::clone(model),
            q_rad: self.q_rad,
            qd_rad_s: self.qd_rad_s,
            world_from_link,
            pelvis_velocity_m_s: self.pelvis_velocity_m_s,
            pelvis_angular_velocity_rad_s: self.pelvis_angular_velocity_rad_s,
            com_m,
            com_velocity_m_s,
            palm_velocity_m_s: Sides::both(Vector::ZERO),
            hand_reaction_n: Sides::both(Vector::ZERO),
            hand_holds: Sides::both(false),
            hand_presses: Sides::both(false),
            arms_told: false,
            waist_target_rad: [0.0; 3],
            known: KnownOfBody::default(),
        }
    }

    /// Returns the kinetic and potential energy of all links, without the joints' armatures.
    pub(crate) fn energy_j(&self) -> f64 {
        let model = model();
        let world_from_link = model.forward_kinematics(self.world_from_pelvis, &self.q_rad);
        let energies_j =
            model.links.iter().zip(&world_from_link).zip(self.motions()).map(|((link, world), moving)| {
                let centre_m_s = moving.velocity_at(world.rotation * link.mass.local_com);
                let axes = world.rotation * link.mass.principal_inertia_local_frame;
                let spin_rad_s = axes.inverse() * moving.spin_rad_s;
                let inertia_kg_m2 = link.mass.principal_inertia();
                let height_m = (*world * link.mass.local_com).z;
                f64::from(0.5 * link.mass.mass() * centre_m_s.length_squared())
                    + f64::from(0.5 * (inertia_kg_m2 * spin_rad_s).dot(spin_rad_s))
                    + f64::from(link.mass.mass() * GRAVITY_M_S2) * f64::from(height_m)
            });
        energies_j.sum()
    }

    /// Returns the motions of all links, at their origins.
    fn motions(&self) -> Vec<PosedMotion> {
        let model = model();
        let world_from_link = model.forward_kinematics(self.world_from_pelvis, &self.q_rad);
        let mut motions: Vec<PosedMotion> = Vec::with_capacity(model.links.len());
        for (index, link) in model.links.iter().enumerate() {
            motions.push(match (link.parent, link.joint) {
                (Some(parent), Some(joint)) => {
                    let world = world_from_link[index];
                    let offset_m = world.translation - world_from_link[parent].translation;
                    let axis = world.rotation * model.joints[joint].axis;
                    PosedMotion {
                        velocity_m_s: motions[parent].velocity_at(offset_m),
                        spin_rad_s: motions[parent].spin_rad_s + axis * self.qd_rad_s[joint],
                    }
                }
                _ => PosedMotion {
                    velocity_m_s: self.pelvis_velocity_m_s,
                    spin_rad_s: self.pelvis_angular_velocity_rad_s,
                },
            });
        }
        motions
    }
}

struct PosedMotion {
    velocity_m_s: Vector,
    spin_rad_s: Vector,
}

impl PosedMotion {
    fn velocity_at(&self, from_origin_m: Vector) -> Vector {
        self.velocity_m_s + self.spin_rad_s.cross(from_origin_m)
    }
}
