//! Contact estimates of the feet from the torques of the legs: the stance foot, its certainty, and the
//! centre of pressure on its sole.

use rapier3d::glamx::{DQuat, DVec3};
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::na::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::body::{JOINTS, LEG_JOINTS, LEGS, RobotModel};
use crate::{GRAVITY_M_S2, Side, Sides};

/// Estimate of one foot.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Foot {
    /// Ankle roll link, to which the sole belongs.
    pub link: usize,
    /// Point of the ground under the centre of pressure, world frame.
    pub point_m: DVec3,
    /// Heading of the foot since the robot has stood still.
    pub heading_rad: f64,
    /// Certainty that the foot stands: from 0 (certainly lifted) to 1 (certainly standing).
    pub contact_share: f64,
    /// Centre of pressure in the link's frame, filtered.
    pressure_m: Vector,
    /// Vertical force, filtered.
    force_n: f32,
}

/// Force and moment about a foot's link origin with which the ground reacts to a leg, world axes.
struct GroundWrench {
    force_n: Vector,
    moment_n_m: Vector,
}

/// Force below which a foot counts as lifted, and force above which it counts as standing.
const LIFTED_N: f32 = 40.0;
const STANDING_N: f32 = 110.0;
const FORCE_FILTER_TIME_S: f32 = 0.006;
const PRESSURE_FILTER_TIME_S: f32 = 0.015;
/// Height above the other foot from which a foot no longer counts as standing.
const HIGHER_M: f32 = 0.012;
/// Damping of the least squares for a wrench: a stretched leg has no torques from forces along it.
const WRENCH_DAMPING: f32 = 2e-4;

impl Foot {
    /// Creates a foot that carries half of the robot, with unknown position.
    pub fn standing(model: &RobotModel, side: Side) -> Foot {
        let sole = &model.soles[side];
        Foot {
            link: sole.link,
            point_m: DVec3::ZERO,
            heading_rad: 0.0,
            contact_share: 1.0,
            pressure_m: sole.link_from_site.translation,
            force_n: 0.5 * model.mass_kg * GRAVITY_M_S2,
        }
    }

    /// Returns the vector from the IMU to the centre of pressure, in the pelvis' axes.
    pub fn arm_m(&self, pelvis_from_foot: &Pose, model: &RobotModel) -> DVec3 {
        (*pelvis_from_foot * self.pressure_m - model.imu_in_pelvis_m).as_dvec3()
    }

    /// Processes one reading of the legs' torques. If a centre of pressure moves, its point of the
    /// ground moves along.
    pub fn feel(
        feet: &mut Sides<Foot>,
        model: &RobotModel,
        pelvis_from_link: &[Pose],
        world_from_pelvis: Rotation,
        torque_n_m: &[f32; JOINTS],
        dt_s: f32,
    ) {
        let down = world_from_pelvis.inverse() * -Vector::Z;
        let lifted_n = model.scale.force_n(LIFTED_N);
        let lowest_m = Sides::from_fn(|side| {
            let pelvis_from_foot = &pelvis_from_link[feet[side].link];
            let corners_m = model.sole_corners_m[side].iter();
            -corners_m
                .map(|corner_m| (*pelvis_from_foot * *corner_m).dot(down))
                .fold(f32::NEG_INFINITY, f32::max)
        });
        for (side, foot) in Side::BOTH.into_iter().zip(feet.iter_mut()) {
            let wrench = ground_wrench(model, pelvis_from_link, side, down, torque_n_m);
            let upwards_n = wrench.force_n.dot(-down);
            foot.force_n += (upwards_n - foot.force_n) * (dt_s / FORCE_FILTER_TIME_S).min(1.0);
            let moved_m = foot.press(model, side, &wrench, pelvis_from_link[foot.link].rotation, dt_s);
            let axes = world_from_pelvis * pelvis_from_link[foot.link].rotation;
            foot.point_m += (axes * moved_m).as_dvec3();
            let loaded = (foot.force_n - lifted_n) / (model.scale.force_n(STANDING_N) - lifted_n);
            let higher_m = model.scale.length_m(HIGHER_M);
            let above_m = lowest_m[side] - lowest_m[side.other()];
            let low = 1.0 - (above_m - 0.5 * higher_m) / (0.5 * higher_m);
            foot.contact_share = f64::from(loaded.min(low).clamp(0.0, 1.0));
        }
    }

    /// Moves the centre of pressure towards that of the wrench, on the sole. Returns the displacement in
    /// the link's frame. With h the sole's depth below the link's origin,  x = -(m_y + h f_x) / f_z,  y
    /// = (m_x - h f_y) / f_z.
    fn press(
        &mut self,
        model: &RobotModel,
        side: Side,
        wrench: &GroundWrench,
        pelvis_from_foot: Rotation,
        dt_s: f32,
    ) -> Vector {
        let middle_m = model.soles[side].link_from_site.translation;
        let force_n = pelvis_from_foot.inverse() * wrench.force_n;
        let moment_n_m = pelvis_from_foot.inverse() * wrench.moment_n_m;
        let point_m = if force_n.z > model.scale.force_n(LIFTED_N) {
            let x = (middle_m.z * force_n.x - moment_n_m.y) / force_n.z;
            let y = (middle_m.z * force_n.y + moment_n_m.x) / force_n.z;
            let corners_m = &model.sole_corners_m[side];
            let low_m = corners_m.iter().fold(Vector::INFINITY, |low, corner| low.min(*corner));
            let high_m = corners_m.iter().fold(Vector::NEG_INFINITY, |high, corner| high.max(*corner));
            Vector::new(x.clamp(low_m.x, high_m.x), y.clamp(low_m.y, high_m.y), middle_m.z)
        } else {
            middle_m
        };
        let moved_m = (point_m - self.pressure_m) * (dt_s / PRESSURE_FILTER_TIME_S).min(1.0);
        self.pressure_m += moved_m;
        moved_m
    }
}

/// Solves J^T w = tau_gravity - tau by damped least squares, in the pelvis' axes; `down_direction` is
/// that of gravity. J: 6 x 6, rows force and moment, columns the leg's joints [m; 1].
fn ground_wrench(
    model: &RobotModel,
    pelvis_from_link: &[Pose],
    side: Side,
    down_direction: Vector,
    torque_n_m: &[f32; JOINTS],
) -> GroundWrench {
    let foot_m = pelvis_from_link[model.soles[side].link].translation;
    let mut jacobian = SMatrix::<f32, 6, 6>::zeros();
    let mut rest_n_m = SVector::<f32, 6>::zeros();
    // Mass and its moment from this joint on, from the foot up.
    let (mut mass_kg, mut moment_kg_m) = (0.0, Vector::ZERO);
    for index in model.leg_chains[side].iter().rev() {
        let (i, joint) = (index - LEGS[side], &model.joints[*index]);
        let pose = pelvis_from_link[joint.link];
        let (origin_m, axis) = (pose.translation, pose.rotation * joint.axis);
        let mass = &model.links[joint.link].mass;
        mass_kg += mass.mass();
        moment_kg_m += pose * mass.local_com * mass.mass();
        let holding_n_m = -axis.dot((moment_kg_m - origin_m * mass_kg).cross(down_direction * GRAVITY_M_S2));
        rest_n_m[i] = holding_n_m - torque_n_m[*index];
        let linear = axis.cross(foot_m - origin_m);
        jacobian.set_column(i, &SVector::from([linear.x, linear.y, linear.z, axis.x, axis.y, axis.z]));
    }
    if let Some((origin_m, axis)) = model.sole_axis(side, pelvis_from_link[model.soles[side].link]) {
        let linear = axis.cross(foot_m - origin_m);
        let column = [linear.x, linear.y, linear.z, axis.x, axis.y, axis.z];
        jacobian.set_column(LEG_JOINTS - 1, &SVector::from(column));
    }
    let normal = jacobian * jacobian.transpose() + SMatrix::identity() * WRENCH_DAMPING;
    let fitted = normal.cholesky().map_or_else(SVector::zeros, |factor| factor.solve(&(jacobian * rest_n_m)));
    GroundWrench {
        force_n: Vector::new(fitted[0], fitted[1], fitted[2]),
        moment_n_m: Vector::new(fitted[3], fitted[4], fitted[5]),
    }
}

/// Returns the heading of the x axis, seen from above.
pub(super) fn facing_rad(rotation: DQuat) -> f64 {
    let forward = rotation * DVec3::X;
    forward.y.atan2(forward.x)
}
