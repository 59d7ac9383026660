//! State of a robot's base for reports: whether it stands or steps and why, and its displacement from the
//! commanded place. All of it is based on the robot's own controller and odometry.

use nalgebra::{Isometry3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};
use tandem_sim::{BaseCommand, BaseVelocity, RobotSensed};
use tandem_tools_spec::{BaseReport, BaseState};

use crate::convert::{coarse, isometry_from_sim};

/// Number of control steps within which a robot stops after a stop command, measured from 0.05 to 0.4 m/s in
/// every direction. A robot that steps later has been pushed.
const SETTLES_STEPS: u32 = 75;
/// Maximum duration of a motion whose displacement is computed as speed times time, and maximum distance of
/// the base from the place computed in this way.
const SHORT_STEPS: u32 = 125;
const LEASH_M: f64 = 0.25;
/// Parameters of the coasting distance after longer walks, which grows with the speed:
///   d = v (0.25 s + 0.6 s^2/m |v|),
/// fitted to walks of 3 s ahead, back and to the side: 3 cm from 0.1 m/s, 8 from 0.2, 12 from 0.3 and 21
/// from 0.4.
const COASTS_S: f64 = 0.25;
const COASTS_S2_M: f64 = 0.6;
const CONTROL_S: f64 = 0.02;
/// Number of control steps after the feet have stopped for which a pelvis away from its height counts as
/// moving, even if it does not rise yet. Later it counts as moving only above this vertical speed.
const PLANTED_STEPS: u32 = 10;
const RISES_M_S: f64 = 0.02;
/// Weight of one control step in the running mean of the vertical speed.
const RISING_PART: f64 = 0.2;
/// Minimum differences that are reported.
const HEIGHT_M: f64 = 0.02;
const DISPLACED_M: f64 = 0.02;

/// Recent motion of a base.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Footing {
    pub pelvis_from_start: Isometry3<f64>,
    is_stepping: Option<bool>,
    /// Control steps since the last motion command, and that command's velocity.
    still_steps: u32,
    told_m_s: [f64; 2],
    /// Destination of the motion commands since the base last stood.
    walk: Option<ToldWalk>,
    /// Pose at which the base came to rest after that walk, in the frame of its estimate.
    rests_at: Option<Isometry3<f64>>,
    /// Control steps since the feet last moved; height of the pelvis, and its recent vertical speed.
    planted_steps: u32,
    height_m: f64,
    rises_m_s: f64,
    /// True if the base has stepped since its last command began, despite a command to stand.
    stepped: bool,
}

/// Destination, in the start frame, of the motion commands since the base last stood.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ToldWalk {
    to_m: Vector3<f64>,
    control_steps: u32,
}

impl Footing {
    /// Returns the state of a robot that stands at the start of the episode.
    pub fn new(world_from_pelvis: Isometry3<f64>) -> Footing {
        let height_m = world_from_pelvis.translation.z;
        Footing {
            pelvis_from_start: Isometry3::translation(0.0, 0.0, -height_m),
            is_stepping: None,
            still_steps: SETTLES_STEPS,
            told_m_s: [0.0; 2],
            walk: None,
            rests_at: None,
            planted_steps: PLANTED_STEPS,
            height_m,
            rises_m_s: 0.0,
            stepped: false,
        }
    }

    /// Begins a command.
    pub fn begin(&mut self) {
        self.stepped = false;
    }

    /// Updates the state from the robot's sensor readings after a control step under the command `base`.
    pub fn feel(&mut self, sensed: &RobotSensed, base: &BaseCommand, world_from_pelvis: &Isometry3<f64>) {
        self.pelvis_from_start = isometry_from_sim(&sensed.start_from_pelvis).inverse();
        self.is_stepping = sensed.is_stepping;
        self.planted_steps = if sensed.is_stepping == Some(true) { 0 } else { self.planted_steps + 1 };
        let height_m = f64::from(sensed.start_from_pelvis.translation.z);
        self.rises_m_s += RISING_PART * ((height_m - self.height_m) / CONTROL_S - self.rises_m_s);
        self.height_m = height_m;
        if base.velocity() == BaseVelocity::STILL {
            self.still_steps = self.still_steps.saturating_add(1);
        } else {
            self.still_steps = 0;
            self.told_m_s = [base.vx_m_s.into(), base.vy_m_s.into()];
            self.rests_at = None;
            self.walk_on();
        }
        if self.still_steps >= SETTLES_STEPS || (self.still_steps > 0 && sensed.is_stepping == Some(false)) {
            self.rests_at.get_or_insert(*world_from_pelvis);
            self.walk = None;
        }
        self.stepped |= self.still_steps >= SETTLES_STEPS && sensed.is_stepping == Some(true);
    }

    /// Moves the commanded place by one control step.
    fn walk_on(&mut self) {
        let start_from_pelvis = self.pelvis_from_start.inverse();
        let pelvis_m = start_from_pelvis.translation.vector;
        let walk = self.walk.get_or_insert(ToldWalk { to_m: pelvis_m, control_steps: 0 });
        let ahead = start_from_pelvis.rotation * Vector3::x();
        let level = Rotation3::from_axis_angle(&Vector3::z_axis(), ahead.y.atan2(ahead.x));
        walk.to_m += level * Vector3::new(self.told_m_s[0], self.told_m_s[1], 0.0) * CONTROL_S;
        walk.to_m = pelvis_m + (walk.to_m - pelvis_m).cap_magnitude(LEASH_M);
        walk.control_steps += 1;
    }

    /// Returns the place in the start frame at which the base comes to rest without further commands.
    fn rests_m(&self) -> Vector3<f64> {
        if let Some(walk) = self.walk.as_ref().filter(|walk| walk.control_steps <= SHORT_STEPS) {
            return walk.to_m;
        }
        let start_from_pelvis = self.pelvis_from_start.inverse();
        let told_m_s = Vector3::new(self.told_m_s[0], self.told_m_s[1], 0.0);
        let coasts_s = COASTS_S + COASTS_S2_M * told_m_s.norm() - f64::from(self.still_steps) * CONTROL_S;
        start_from_pelvis.translation.vector + start_from_pelvis.rotation * told_m_s * coasts_s.max(0.0)
    }

    fn state(&self, base: &BaseCommand) -> Option<BaseState> {
        let is_off = (self.height_m - f64::from(base.pelvis_height_m)).abs() > HEIGHT_M;
        let rises = is_off && (self.planted_steps < PLANTED_STEPS || self.rises_m_s.abs() > RISES_M_S);
        self.is_stepping.map(|steps| match (steps, self.still_steps) {
            (false, _) if rises => BaseState::Settling,
            (false, _) => BaseState::Standing,
            (true, 0) => BaseState::Stepping,
            (true, still) if still < SETTLES_STEPS => BaseState::Settling,
            (true, _) => BaseState::Pushed,
        })
    }

    /// Returns the report on a base under the command `base`, with the pelvis at `world_from_pelvis`.
    pub fn report(&self, base: &BaseCommand, world_from_pelvis: &Isometry3<f64>) -> BaseReport {
        let pelvis_height_m = self.pelvis_from_start.inverse().translation.z;
        let commanded_m = f64::from(base.pelvis_height_m);
        let state = self.state(base);
        let moves = matches!(state, Some(BaseState::Stepping | BaseState::Settling));
        let rests_m = self.rests_m();
        let displaced_m = self.rests_at.map(|rests| {
            rests.inverse_transform_vector(&(world_from_pelvis.translation.vector - rests.translation.vector))
        });
        BaseReport {
            state,
            pelvis_height_m: coarse(pelvis_height_m),
            commanded_height_m: ((pelvis_height_m - commanded_m).abs() > HEIGHT_M)
                .then_some(coarse(commanded_m)),
            comes_to_rest_m: moves.then_some([coarse(rests_m.x), coarse(rests_m.y)]),
            displaced_m: displaced_m
                .filter(|off_m| off_m.xy().norm() > DISPLACED_M)
                .map(|off_m| [coarse(off_m.x), coarse(off_m.y)]),
            stepped: self.stepped,
        }
    }
}
