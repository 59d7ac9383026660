//! Numbers of a step. All were measured on grasps, stacks and walking robots at 200 Hz; change one with a reason.

use rapier3d::glamx::DVec3;

/// A spring and damper by their frequency and damping ratio, as in Catto's soft constraints (GDC 2011).
#[derive(Clone, Copy, Debug)]
pub struct Softness {
    pub frequency_hz: f64,
    pub damping_ratio: f64,
}

impl Softness {
    /// Share of a position error that is taken back per second:  omega / (dt omega + 2 zeta).
    pub(super) fn correction_per_s(&self, dt_s: f64) -> f64 {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        omega / (dt_s * omega + 2.0 * self.damping_ratio)
    }

    /// By how much of its effective mass a row gives way:  with e = 1 / (dt correction) - 1,  e^2 / ((1 + e) 4 zeta^2).
    pub(super) fn compliance(&self, dt_s: f64) -> f64 {
        let e = 1.0 / (dt_s * self.correction_per_s(dt_s)) - 1.0;
        e * e / ((1.0 + e) * 4.0 * self.damping_ratio * self.damping_ratio)
    }
}

#[derive(Clone, Debug)]
pub struct Settings {
    pub dt_s: f64,
    pub gravity_m_s2: DVec3,
    /// Sweeps that correct positions, and after them sweeps that do not and are rigid: without the second kind, or if
    /// the next step began with their impulses, a held bottle would slip by a third of a millimetre.
    pub sweeps: usize,
    pub relaxing_sweeps: usize,
    /// Softness of contacts between two things that move, and of contacts with what does not.
    pub contact: Softness,
    pub ground_contact: Softness,
    /// Depth that is left alone. At 0 a bottle precesses on its rim; at 1 mm hung frames slip.
    pub slop_m: f64,
    /// Depth is taken back no faster than this.
    pub fastest_correction_m_s: f64,
    /// A gap that would stay open if it closed faster by this gets no row.
    pub margin_m_s: f64,
    /// A contact continues one of the last step that lies no farther away.
    pub match_m: f64,
    /// Share of an error of limits and equalities that is taken back per second.
    pub joint_correction_per_s: f64,
}

impl Settings {
    pub fn new(dt_s: f64, gravity_m_s2: DVec3) -> Settings {
        Settings {
            dt_s,
            gravity_m_s2,
            sweeps: 8,
            relaxing_sweeps: 1,
            contact: Softness { frequency_hz: 60.0, damping_ratio: 5.0 },
            ground_contact: Softness { frequency_hz: 120.0, damping_ratio: 5.0 },
            slop_m: 0.0002,
            fastest_correction_m_s: 3.0,
            margin_m_s: 0.5,
            match_m: 0.004,
            joint_correction_per_s: 40.0,
        }
    }
}

/// The two kinds of sweeps of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pass {
    /// Takes back penetration and errors of joints; positions move by what it finds.
    Correcting,
    /// Rigid and without correction, so that pushing out of a wall leaves no speed behind; velocities are what it finds.
    Relaxing,
}
