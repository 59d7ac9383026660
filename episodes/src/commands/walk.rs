//! `walk`: moves the base, and the waist if the command has a target for it; arms and hands keep their
//! joints.

use tandem_sim::{BaseCommand, CONTROL_HZ, JOINTS, Pose, RobotModel};
use tandem_tools_spec::WalkMove;

use super::columns::{self, Clamped};
use super::motion::{Compliance, Motion};

/// Maximum rates of the trunk's yaw and pitch.
const YAW_RAD_S: f64 = 1.0;
const PITCH_RAD_S: f64 = 0.5;
/// Maximum vertical angle between a point to look at and the middle of the image.
const OFF_MIDDLE_RAD: f64 = 0.35;
/// Maximum pitch for a look; a robot that bends further steps.
const MAX_BEND_RAD: f64 = 0.35;

/// The same base command at every step, while waist joints move to their targets.
pub struct WalkTrajectory {
    base: BaseCommand,
    yaw: Option<WaistTurn>,
    pitch: Option<WaistTurn>,
}

/// Motion of one waist joint, given by its column, at a constant rate.
struct WaistTurn {
    column: usize,
    from_rad: f64,
    to_rad: f64,
    rate_rad_s: f64,
}

impl WalkTrajectory {
    /// Starts `entry` on `motion`.
    pub fn begin(entry: &WalkMove, motion: &mut Motion, clamped: &mut Clamped) -> WalkTrajectory {
        let velocity = [entry.vx_m_s, entry.vy_m_s, entry.yaw_rate_rad_s];
        let base =
            clamped.base(&motion.robot.base_limits, motion.base_command(velocity, entry.pelvis_height_m));
        motion.keep_joints();
        let [yaw, pitch] = [columns::waist().start, columns::waist().end - 1];
        let mut turn = |column: usize, asked_rad: f64, rate_rad_s: f64| WaistTurn {
            column,
            from_rad: motion.upper_rad()[column],
            to_rad: clamped.joint(&motion.robot.model, column, asked_rad),
            rate_rad_s,
        };
        let point_rad = entry.look_at_m.map(|[x_m, y_m, _]| y_m.atan2(x_m));
        let bend_rad = entry
            .look_at_m
            .map(|point_m| bend_to_see(&motion.robot.model, point_m, motion.upper_rad()[pitch]));
        WalkTrajectory {
            base,
            yaw: entry.waist_yaw_rad.or(point_rad).map(|asked_rad| turn(yaw, asked_rad, YAW_RAD_S)),
            pitch: bend_rad.map(|asked_rad| turn(pitch, asked_rad, PITCH_RAD_S)),
        }
    }

    /// Makes one control step.
    pub fn advance(&self, step: u32, motion: &mut Motion) {
        for WaistTurn { column, from_rad, to_rad, rate_rad_s } in self.yaw.iter().chain(&self.pitch) {
            let most_rad = rate_rad_s * f64::from(step) / CONTROL_HZ;
            motion.turn_waist(*column, from_rad + (to_rad - from_rad).clamp(-most_rad, most_rad));
        }
        motion.advance_yielding(Compliance::NONE);
        motion.walk(self.base);
    }
}

/// Returns the waist pitch that brings a point in the pelvis frame near the middle of the image, once the
/// waist has turned towards the point. It is the pitch closest to `present_rad`. The camera's pitch follows
/// the trunk's; the camera's displacement is neglected.
fn bend_to_see(model: &RobotModel, point_m: [f64; 3], present_rad: f64) -> f64 {
    let links = model.forward_kinematics(Pose::IDENTITY, &[0.0; JOINTS]);
    let upright = links[model.egocentric_link] * model.egocentric.body_from_camera;
    // MJCF's cameras look along -z.
    let ahead = upright.rotation * -tandem_sim::Vector::Z;
    let upright_rad = f64::from(ahead.z).atan2(f64::from(ahead.x));
    let [x_m, y_m, z_m] = point_m;
    let away_m = x_m.hypot(y_m) - f64::from(upright.translation.x);
    let point_rad = (z_m - f64::from(upright.translation.z)).atan2(away_m.max(0.05));
    let middle_rad = upright_rad - point_rad;
    if (present_rad - middle_rad).abs() <= OFF_MIDDLE_RAD {
        return present_rad;
    }
    present_rad.clamp(middle_rad - OFF_MIDDLE_RAD, middle_rad + OFF_MIDDLE_RAD).clamp(0.0, MAX_BEND_RAD)
}
