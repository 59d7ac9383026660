//! Measurements of a trial, from its log.

use tandem_sim::body::BodyScale;
use tandem_sim::{BaseCommand, BaseVelocity, CONTROL_DT_S as DT_S, Rotation, Side, Sides, Vector, flat};

use super::cases::{Case, Plan, STOP_S, pulse};
use super::tour::Leg;
use crate::report::CaseFigures;

/// Time before commands and measurements begin, in which the arms rise and swinging loads settle.
pub(super) const SETTLE_S: f32 = 2.0;
/// Time after the start of motion before a velocity is measured.
const RAMP_S: f32 = 2.0;
/// Height above its initial position from which a foot counts as lifted.
const LIFTED_M: f32 = 0.015;

/// One control step of the log.
pub(super) struct Sample {
    pub pelvis_m: Vector,
    /// Angle between the pelvis's vertical axis and the world's.
    pub pelvis_tilt_rad: f32,
    /// Positions of the ankle roll links.
    pub feet_m: Sides<Vector>,
    /// Unwrapped heading.
    pub heading_rad: f32,
    pub command: BaseCommand,
}

/// Fills in the measurements of the case, for a robot that has not fallen.
pub(super) fn measure(
    case: &Case,
    seed: u32,
    scale: &BodyScale,
    log: &[Sample],
    legs: &[Leg],
    figures: &mut CaseFigures,
) {
    let at = |time_s: f32| ((time_s / DT_S) as usize).min(log.len() - 1);
    let (start, end) = (at(SETTLE_S), log.len() - 1);
    match &case.plan {
        Plan::Hold | Plan::Squat { .. } => {
            let (mut low, mut high) = (Vector::INFINITY, Vector::NEG_INFINITY);
            for sample in &log[start..] {
                low = low.min(sample.pelvis_m);
                high = high.max(sample.pelvis_m);
            }
            figures.sway_m = Some((high.x - low.x).max(high.y - low.y));
            figures.final_drift_m = Some(flat(log[end].pelvis_m - log[0].pelvis_m).length());
            figures.heading_error_deg = Some((log[end].heading_rad - log[0].heading_rad).abs().to_degrees());
            figures.steps = Some(steps(log));
        }
        Plan::Move(velocity) => {
            let stop = at(case.duration_s - STOP_S);
            let walk = &log[at(SETTLE_S + RAMP_S)..stop];
            figures.velocity_error_share = Some(velocity_error(walk, *velocity));
            let turned_rad = velocity.yaw_rate_rad_s * (stop - start) as f32 * DT_S;
            figures.heading_error_deg =
                Some((log[end].heading_rad - log[start].heading_rad - turned_rad).abs().to_degrees());
            figures.height_error_m = Some(walking_height_error_m(walk));
            figures.pelvis_tilt_deg =
                walk.iter().map(|sample| sample.pelvis_tilt_rad.to_degrees()).reduce(f32::max);
            figures.standing_after_s = Some(slower_after_s(&log[stop..], 0.1));
            figures.still_after_s = Some(slower_after_s(&log[stop..], 0.02));
        }
        Plan::Pulse(axis) => {
            let (velocity, pulse_s) = pulse(*axis, seed, scale);
            let stop = at(SETTLE_S + pulse_s);
            let [off_m, off_rad] = off_pulse(&log[start], &log[end], velocity, pulse_s);
            figures.final_drift_m = Some(off_m);
            figures.heading_error_deg = Some(off_rad.to_degrees());
            figures.standing_after_s = Some(slower_after_s(&log[stop..], 0.1));
            figures.still_after_s = Some(slower_after_s(&log[stop..], 0.02));
        }
        Plan::Tour(tour) => {
            let error_m = |leg: usize| {
                let last = at((leg + 1) as f32 * tour.leg_s - DT_S);
                flat(log[last].pelvis_m - legs[leg].target_m).length()
            };
            figures.final_drift_m = Some((0..legs.len()).map(error_m).sum::<f32>() / legs.len() as f32);
        }
    }
    if let Plan::Squat { .. } = &case.plan {
        figures.height_error_m = squat_error_m(case, |time_s| &log[at(time_s)]);
    }
}

/// Returns the largest error of the pelvis height at the ends of a squat's thirds.
fn squat_error_m<'a>(case: &Case, at: impl Fn(f32) -> &'a Sample) -> Option<f32> {
    let ends = [case.duration_s / 3.0, case.duration_s * 2.0 / 3.0, case.duration_s];
    let error_m = |end_s: &f32| {
        let sample = at(end_s - 2.0 * DT_S);
        (sample.pelvis_m.z - sample.command.pelvis_height_m).abs()
    };
    ends.iter().map(error_m).reduce(f32::max)
}

/// Tolerated error, as a share of a pulse's displacement and turn.
const PULSE_SHARE: f32 = 0.1;

/// Returns the position and heading error of a robot at rest after a pulse, each reduced by [`PULSE_SHARE`]
/// of the displacement or turn.
fn off_pulse(from: &Sample, to: &Sample, velocity: BaseVelocity, pulse_s: f32) -> [f32; 2] {
    let BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s } = velocity;
    let way_m = Vector::new(vx_m_s, vy_m_s, 0.0) * pulse_s;
    let way_m = Rotation::from_rotation_z(from.heading_rad) * way_m;
    let turn_rad = yaw_rate_rad_s * pulse_s;
    let off_m = flat(to.pelvis_m - from.pelvis_m - way_m).length() - PULSE_SHARE * way_m.length();
    let off_rad = (to.heading_rad - from.heading_rad - turn_rad).abs() - PULSE_SHARE * turn_rad.abs();
    [off_m, off_rad].map(|off| off.max(0.0))
}

/// Returns the number of times that a foot left the ground.
fn steps(log: &[Sample]) -> u32 {
    let lifted = |sample: &Sample, side: Side| sample.feet_m[side].z - log[0].feet_m[side].z > LIFTED_M;
    let lifts =
        |side: Side| log.windows(2).filter(|pair| !lifted(&pair[0], side) && lifted(&pair[1], side)).count();
    Side::BOTH.into_iter().map(|side| lifts(side) as u32).sum()
}

/// Returns the deviation of the mean pelvis height during a walk from the commanded height.
fn walking_height_error_m(log: &[Sample]) -> f32 {
    let error_m = |sample: &Sample| sample.pelvis_m.z - sample.command.pelvis_height_m;
    (log.iter().map(error_m).sum::<f32>() / log.len() as f32).abs()
}

/// Returns the largest deviation of the mean velocity in the heading frame, as a share of the commanded
/// speed (m/s or rad/s).
fn velocity_error(log: &[Sample], velocity: BaseVelocity) -> f32 {
    let mut moved = [0.0_f32; 3];
    for pair in log.windows(2) {
        let step_m = pair[1].pelvis_m - pair[0].pelvis_m;
        let (sine, cosine) = pair[0].heading_rad.sin_cos();
        moved[0] += step_m.x * cosine + step_m.y * sine;
        moved[1] += step_m.y * cosine - step_m.x * sine;
        moved[2] += pair[1].heading_rad - pair[0].heading_rad;
    }
    let time_s = (log.len() - 1) as f32 * DT_S;
    let BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s } = velocity;
    let [x, y, turn] = moved.map(|moved| moved / time_s);
    let (x, y, turn) = (x - vx_m_s, y - vy_m_s, turn - yaw_rate_rad_s);
    let speed_m_s = vx_m_s.hypot(vy_m_s);
    let linear = if speed_m_s > 0.0 { x.hypot(y) / speed_m_s } else { 0.0 };
    let angular = if yaw_rate_rad_s != 0.0 { (turn / yaw_rate_rad_s).abs() } else { 0.0 };
    linear.max(angular)
}

/// Returns the time after which the pelvis speed, averaged over 0.2 s, stays below a limit.
fn slower_after_s(log: &[Sample], limit_m_s: f32) -> f32 {
    const WINDOW: usize = 10;
    let speed_m_s =
        |i: usize| flat(log[i + WINDOW].pelvis_m - log[i].pelvis_m).length() / (WINDOW as f32 * DT_S);
    let last = (0..log.len() - WINDOW).rev().find(|i| speed_m_s(*i) > limit_m_s);
    last.map_or(0.0, |i| (i + WINDOW) as f32 * DT_S)
}
