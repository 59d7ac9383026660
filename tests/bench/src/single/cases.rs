//! The table of cases.

use tandem_sim::BaseVelocity;
use tandem_sim::body::BodyScale;

use super::motion::Arms;
use super::tour::Tour;

/// One situation; a seed draws its arm motion and directions.
#[derive(Clone)]
pub struct Case {
    pub name: &'static str,
    pub duration_s: f32,
    pub(super) arms: Arms,
    pub(super) hand_load_kg: f32,
    pub(super) plan: Plan,
    pub(super) disturbance: Disturbance,
}

/// Plan of the base commands.
#[derive(Clone)]
pub(super) enum Plan {
    Hold,
    /// A velocity command, followed by a stop in the last [`STOP_S`] seconds.
    Move(BaseVelocity),
    /// Squat down, then back up, each in a third of the time.
    Squat {
        high_m: f32,
        low_m: f32,
    },
    /// A motion from rest to rest: a velocity along one axis for a limited time. The seed selects speed and
    /// duration.
    Pulse(PulseAxis),
    Tour(Tour),
}

/// Axis of a commanded velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PulseAxis {
    Ahead,
    Aside,
    Turn,
}

/// Speeds (m/s and rad/s) and durations of pulses. The last digit of the seed selects the speed; seed
/// and tens together select the duration.
const PULSE_SPEEDS: [f32; 10] = [0.03, -0.05, 0.1, -0.1, 0.15, -0.15, 0.2, -0.3, 0.3, -0.2];
const PULSE_S: [f32; 4] = [0.5, 1.0, 2.0, 3.0];

/// Returns the velocity and the duration (s) of a seed's pulse.
pub(super) fn pulse(axis: PulseAxis, seed: u32, scale: &BodyScale) -> (BaseVelocity, f32) {
    let speed = PULSE_SPEEDS[seed as usize % PULSE_SPEEDS.len()];
    let duration_s = PULSE_S[(seed as usize + seed as usize / PULSE_SPEEDS.len()) % PULSE_S.len()];
    let still = BaseVelocity::STILL;
    let velocity = match axis {
        PulseAxis::Ahead => BaseVelocity { vx_m_s: scale.speed_m_s(speed), ..still },
        PulseAxis::Aside => BaseVelocity { vy_m_s: scale.speed_m_s(speed), ..still },
        PulseAxis::Turn => BaseVelocity { yaw_rate_rad_s: scale.rate_1_s(speed), ..still },
    };
    (velocity, duration_s)
}

/// Disturbance during a case.
#[derive(Clone)]
pub(super) enum Disturbance {
    None,
    /// A steady force on each hand, in a direction drawn from the seed.
    Pull {
        force_n: f32,
    },
    /// A horizontal force on each of these hands until `end_s`. The seed selects one of ten directions.
    LevelPull {
        force_n: f32,
        hands: PulledHands,
        end_s: f32,
    },
    /// A force on the torso for one second. The seed selects one of eight directions.
    Push {
        force_n: f32,
    },
}

impl Case {
    /// Scales the case's speeds, heights, loads and forces to a robot of another size.
    pub(super) fn of_size(&self, scale: &BodyScale) -> Case {
        let plan = match self.plan.clone() {
            Plan::Hold => Plan::Hold,
            Plan::Pulse(axis) => Plan::Pulse(axis),
            Plan::Move(BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s }) => Plan::Move(BaseVelocity {
                vx_m_s: scale.speed_m_s(vx_m_s),
                vy_m_s: scale.speed_m_s(vy_m_s),
                yaw_rate_rad_s: scale.rate_1_s(yaw_rate_rad_s),
            }),
            Plan::Squat { high_m, low_m } => {
                Plan::Squat { high_m: scale.height_m(high_m), low_m: scale.height_m(low_m) }
            }
            Plan::Tour(tour) => {
                Plan::Tour(Tour { punch_n: tour.punch_n.map(|force_n| scale.force_n(force_n)), ..tour })
            }
        };
        let disturbance = match self.disturbance.clone() {
            Disturbance::None => Disturbance::None,
            Disturbance::Pull { force_n } => Disturbance::Pull { force_n: scale.force_n(force_n) },
            Disturbance::LevelPull { force_n, hands, end_s } => {
                Disturbance::LevelPull { force_n: scale.force_n(force_n), hands, end_s }
            }
            Disturbance::Push { force_n } => Disturbance::Push { force_n: scale.force_n(force_n) },
        };
        Case { hand_load_kg: scale.force_n(self.hand_load_kg), plan, disturbance, ..self.clone() }
    }
}

#[derive(Clone, Copy)]
pub(super) enum PulledHands {
    Both,
    /// The left hand for even seeds, the right hand for odd seeds.
    One,
}

pub(super) const STOP_S: f32 = 5.0;

const HOLD: Case = Case {
    name: "",
    duration_s: 20.0,
    arms: Arms::Forward,
    hand_load_kg: 0.0,
    plan: Plan::Hold,
    disturbance: Disturbance::None,
};

const fn moving(name: &'static str, [vx_m_s, vy_m_s, yaw_rate_rad_s]: [f32; 3]) -> Case {
    let velocity = BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s };
    Case { name, duration_s: 21.0 + STOP_S, plan: Plan::Move(velocity), ..HOLD }
}

/// Rise time of pulls at the hands, similar to fingers that close on a load. Let f be the total force on both
/// hands at the height z, m g the robot's weight, and a the distance from the middle of the feet to the toes.
/// Against a steady pull, the centre of mass has to lean by f z / (m g) - a. A sudden pull leaves no time for
/// that: even with the centre of pressure at the toes, the centre of mass accelerates along the pull, c'' =
/// (g / h) (c + f z / (m g) - a), from the first instant. At 2 x 25 N, f z / (m g) is 15 cm; soles of 17 cm
/// have a = 8.5 cm.
pub(super) const PULL_RISE_S: f32 = 1.0;

/// End times of pulls at the hands of a standing robot. A long pull lasts to the end of the case and measures
/// the robot under load. A short pull ends earlier, so that the recovery is measured.
const LONG_PULL_END_S: f32 = 20.0;
const SHORT_PULL_END_S: f32 = 7.0;

const fn pulled(name: &'static str, force_n: f32, hands: PulledHands, end_s: f32) -> Case {
    Case { name, disturbance: Disturbance::LevelPull { force_n, hands, end_s }, ..HOLD }
}

const fn pulsed(name: &'static str, axis: PulseAxis, hand_load_kg: f32) -> Case {
    Case { name, duration_s: 9.0, plan: Plan::Pulse(axis), hand_load_kg, ..HOLD }
}

pub const CASES: [Case; 36] = [
    Case { name: "stand", ..HOLD },
    Case { name: "stand_waving", duration_s: 60.0, arms: Arms::Waving, ..HOLD },
    Case { name: "stand_1kg", hand_load_kg: 1.0, ..HOLD },
    Case { name: "stand_2kg", hand_load_kg: 2.0, ..HOLD },
    Case { name: "stand_3kg", hand_load_kg: 3.0, ..HOLD },
    Case { name: "stand_pull_15n", disturbance: Disturbance::Pull { force_n: 15.0 }, ..HOLD },
    pulled("stand_pull_25n_both_hands", 25.0, PulledHands::Both, LONG_PULL_END_S),
    Case {
        arms: Arms::Closing,
        ..pulled("stand_pull_25n_closing", 25.0, PulledHands::Both, LONG_PULL_END_S)
    },
    pulled("stand_pull_25n_one_hand", 25.0, PulledHands::One, LONG_PULL_END_S),
    pulled("stand_pull_40n", 40.0, PulledHands::Both, SHORT_PULL_END_S),
    moving("forward_0.4", [0.4, 0.0, 0.0]),
    moving("forward_0.2", [0.2, 0.0, 0.0]),
    moving("backward_0.3", [-0.3, 0.0, 0.0]),
    moving("left_0.3", [0.0, 0.3, 0.0]),
    moving("right_0.3", [0.0, -0.3, 0.0]),
    moving("turn_left_0.5", [0.0, 0.0, 0.5]),
    moving("turn_right_0.5", [0.0, 0.0, -0.5]),
    moving("mix_forward_left_turn", [0.3, 0.15, 0.3]),
    moving("mix_backward_right_turn", [-0.2, -0.15, -0.3]),
    Case { arms: Arms::Waving, ..moving("forward_0.3_waving", [0.3, 0.0, 0.0]) },
    Case { hand_load_kg: 2.0, ..moving("left_0.25_2kg", [0.0, 0.25, 0.0]) },
    Case { hand_load_kg: 2.0, ..moving("forward_0.3_2kg", [0.3, 0.0, 0.0]) },
    Case {
        disturbance: Disturbance::Pull { force_n: 15.0 },
        ..moving("left_0.25_pull_15n", [0.0, 0.25, 0.0])
    },
    Case {
        disturbance: Disturbance::Pull { force_n: 15.0 },
        ..moving("forward_0.3_pull_15n", [0.3, 0.0, 0.0])
    },
    pulsed("pulse_ahead", PulseAxis::Ahead, 0.0),
    pulsed("pulse_aside", PulseAxis::Aside, 0.0),
    pulsed("pulse_turn", PulseAxis::Turn, 0.0),
    pulsed("pulse_ahead_2kg", PulseAxis::Ahead, 2.0),
    pulsed("pulse_aside_2kg", PulseAxis::Aside, 2.0),
    pulsed("pulse_turn_2kg", PulseAxis::Turn, 2.0),
    Case { name: "squat", plan: Plan::Squat { high_m: 0.75, low_m: 0.55 }, ..HOLD },
    Case { name: "squat_1kg", hand_load_kg: 1.0, plan: Plan::Squat { high_m: 0.75, low_m: 0.55 }, ..HOLD },
    Case { name: "push_40n", disturbance: Disturbance::Push { force_n: 40.0 }, ..HOLD },
    Case { disturbance: Disturbance::Push { force_n: 30.0 }, ..moving("push_30n_walking", [0.3, 0.0, 0.0]) },
    Case { name: "punch", duration_s: 6.0, arms: Arms::Waving, plan: Plan::Tour(Tour::LEG), ..HOLD },
    Case { name: "tour", duration_s: 90.0, arms: Arms::Waving, plan: Plan::Tour(Tour::STANDARD), ..HOLD },
];
