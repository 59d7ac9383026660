//! Standing: both feet stay planted, the pelvis holds its place and follows the height command.
//!
//! Each physics step: place the pelvis so that the centre of mass stays over the feet, solve both legs' inverse
//! kinematics for it, and add the torques of a virtual spring and damper on centre of mass and trunk, shared by the
//! feet as ground reaction forces. PD and feedforward act through the leg joints alone.

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::ground::{distribute, leg_torques_n_m};
use super::legs::{LegAngles, inverse, rotation_vector_rad};
use super::{BaseCommand, BaseLimits, LegCommand, Locomotion};
use crate::robot::{LEG_JOINT_COUNT, LEGS, Side, WholeBody};
use crate::world::GRAVITY_M_S2;

/// The centre of mass may lie this far from the middle of the feet before the pelvis gives way.
const COM_ZONE_M: f32 = 0.03;
const PELVIS_SHIFT_TIME_S: f32 = 0.25;
const LARGEST_SHIFT_M: [f32; 2] = [0.2, 0.1];
/// Below this pelvis height the trunk leans forward, so that the hips can go back.
const LEAN_BELOW_M: f32 = 0.70;
const LEAN_RAD_PER_M: f32 = 2.0;
const LARGEST_LEAN_RAD: f32 = 0.5;
const HEIGHT_RATE_M_S: f32 = 0.15;
const HEIGHT_RANGE_M: [f32; 2] = [0.50, 0.76];

/// Virtual spring and damper, per kg of robot: horizontal, vertical.
const HORIZONTAL_STIFFNESS_1_S2: f32 = 60.0;
const HORIZONTAL_DAMPING_1_S: f32 = 14.0;
const VERTICAL_STIFFNESS_1_S2: f32 = 80.0;
const VERTICAL_DAMPING_1_S: f32 = 15.0;
const TRUNK_STIFFNESS_N_M_RAD: f32 = 150.0;
const TRUNK_DAMPING_N_M_S_RAD: f32 = 15.0;
/// Horizontal force stays within this share of the vertical one: the feet must not slip.
const FRICTION_USED: f32 = 0.5;
const SMALLEST_LOAD_SHARE: f32 = 0.2;

/// Inverse kinematics is warm-started from the last step, so that two iterations are enough.
const IK_ITERATIONS: usize = 2;

/// Standing controller; see the module's text.
#[derive(Default)]
pub struct Stand {
    state: Option<State>,
}

#[derive(Clone, Serialize, Deserialize)]
struct State {
    /// Ankle roll links where they were planted, world.
    feet: [Pose; 2],
    soles: [Pose; 2],
    home_m: Vector,
    heading_rad: f32,
    shift_m: Vector,
    height_m: f32,
    q_rad: [LegAngles; 2],
}

impl Stand {
    fn plant(body: &WholeBody) -> State {
        let pelvis = body.world_from_pelvis();
        let forward = pelvis.rotation * Vector::X;
        State {
            feet: Side::BOTH.map(|side| body.world_from_link[body.model.joints[LEGS[side.index()] + 5].link]),
            soles: soles(body),
            home_m: pelvis.translation,
            heading_rad: forward.y.atan2(forward.x),
            shift_m: Vector::ZERO,
            height_m: pelvis.translation.z - ground_height_m(body),
            q_rad: Side::BOTH.map(|side| std::array::from_fn(|i| body.q_rad[LEGS[side.index()] + i])),
        }
    }
}

impl Locomotion for Stand {
    fn limits(&self) -> BaseLimits {
        let none = [0.0, 0.0];
        BaseLimits { vx_m_s: none, vy_m_s: none, yaw_rate_rad_s: none, pelvis_height_m: HEIGHT_RANGE_M }
    }

    fn tick(&mut self, body: &WholeBody, command: &BaseCommand, dt_s: f32) -> LegCommand {
        let state = self.state.get_or_insert_with(|| Stand::plant(body));
        let wanted_m = command.pelvis_height_m.clamp(HEIGHT_RANGE_M[0], HEIGHT_RANGE_M[1]);
        let rise_m = (wanted_m - state.height_m).clamp(-HEIGHT_RATE_M_S * dt_s, HEIGHT_RATE_M_S * dt_s);
        state.height_m += rise_m;
        let goal = state.pelvis_goal(body, dt_s);
        for side in Side::BOTH {
            let leg = &mut state.q_rad[side.index()];
            *leg = inverse(body.model, side, goal, state.feet[side.index()], leg, IK_ITERATIONS);
        }
        let torques = balance_torques_n_m(body, goal, rise_m / dt_s);
        let gravity = body.gravity_torques_n_m();
        let joint = |i: usize| &body.model.joints[LEGS[i / LEG_JOINT_COUNT] + i % LEG_JOINT_COUNT];
        LegCommand {
            q_rad: std::array::from_fn(|i| state.q_rad[i / LEG_JOINT_COUNT][i % LEG_JOINT_COUNT]),
            kp_n_m_rad: std::array::from_fn(|i| joint(i).kp_n_m_rad),
            kd_n_m_s_rad: std::array::from_fn(|i| joint(i).kd_n_m_s_rad),
            feedforward_n_m: std::array::from_fn(|i| {
                let (leg, own) = (i / LEG_JOINT_COUNT, i % LEG_JOINT_COUNT);
                gravity[LEGS[leg] + own] + torques[leg][own]
            }),
        }
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_stdvec(&self.state)
    }

    fn load(&mut self, state: &[u8]) -> Result<(), postcard::Error> {
        self.state = postcard::from_bytes(state)?;
        Ok(())
    }
}

impl State {
    /// Pelvis pose (world) that keeps the centre of mass within [`COM_ZONE_M`] of the middle of the planted feet,
    /// as near to home as that allows.
    fn pelvis_goal(&mut self, body: &WholeBody, dt_s: f32) -> Pose {
        let middle_m = (self.soles[0].translation + self.soles[1].translation) * 0.5;
        let com_from_pelvis_m = body.com_m - body.world_from_pelvis().translation;
        let at_home_m = self.home_m + com_from_pelvis_m - middle_m;
        let excess = |offset_m: f32| offset_m.clamp(-COM_ZONE_M, COM_ZONE_M) - offset_m;
        let wanted_m = Vector::new(excess(at_home_m.x), excess(at_home_m.y), 0.0);
        self.shift_m += (wanted_m - self.shift_m) * (dt_s / PELVIS_SHIFT_TIME_S);
        self.shift_m.x = self.shift_m.x.clamp(-LARGEST_SHIFT_M[0], LARGEST_SHIFT_M[0]);
        self.shift_m.y = self.shift_m.y.clamp(-LARGEST_SHIFT_M[1], LARGEST_SHIFT_M[1]);
        let lean_rad = ((LEAN_BELOW_M - self.height_m) * LEAN_RAD_PER_M).clamp(0.0, LARGEST_LEAN_RAD);
        let mut position_m = self.home_m + self.shift_m;
        position_m.z = middle_m.z + self.height_m;
        Pose::from_parts(
            position_m,
            Rotation::from_rotation_z(self.heading_rad) * Rotation::from_rotation_y(lean_rad),
        )
    }
}

fn soles(body: &WholeBody) -> [Pose; 2] {
    ["left_foot", "right_foot"].map(|site| body.world_from_site(site).unwrap_or(Pose::IDENTITY))
}

fn ground_height_m(body: &WholeBody) -> f32 {
    let [left, right] = soles(body);
    (left.translation.z + right.translation.z) * 0.5
}

/// Leg torques of the ground forces that accelerate the centre of mass and right the trunk towards `goal`.
fn balance_torques_n_m(body: &WholeBody, goal: Pose, rise_m_s: f32) -> [[f32; LEG_JOINT_COUNT]; 2] {
    let mass_kg = body.model.mass_kg;
    let pelvis = body.world_from_pelvis();
    let error_m = goal.translation - pelvis.translation;
    let acceleration_m_s2 = Vector::new(
        HORIZONTAL_STIFFNESS_1_S2 * error_m.x - HORIZONTAL_DAMPING_1_S * body.com_velocity_m_s.x,
        HORIZONTAL_STIFFNESS_1_S2 * error_m.y - HORIZONTAL_DAMPING_1_S * body.com_velocity_m_s.y,
        VERTICAL_STIFFNESS_1_S2 * error_m.z + VERTICAL_DAMPING_1_S * (rise_m_s - body.pelvis_velocity_m_s.z),
    );
    let weight_n = mass_kg * GRAVITY_M_S2;
    let mut force_n = acceleration_m_s2 * mass_kg;
    force_n.z = (force_n.z + weight_n).max(SMALLEST_LOAD_SHARE * weight_n);
    let horizontal_n = force_n.x.hypot(force_n.y);
    if horizontal_n > FRICTION_USED * force_n.z {
        let scale = FRICTION_USED * force_n.z / horizontal_n;
        force_n.x *= scale;
        force_n.y *= scale;
    }
    let tilt_rad = rotation_vector_rad(goal.rotation * pelvis.rotation.inverse());
    let moment_n_m =
        tilt_rad * TRUNK_STIFFNESS_N_M_RAD - body.pelvis_angular_velocity_rad_s * TRUNK_DAMPING_N_M_S_RAD;
    let feet = distribute(body.com_m, force_n, moment_n_m, soles(body));
    let turning_n_m = Vector::new(0.0, 0.0, moment_n_m.z * 0.5);
    Side::BOTH.map(|side| leg_torques_n_m(body, side, feet[side.index()], turning_n_m))
}
