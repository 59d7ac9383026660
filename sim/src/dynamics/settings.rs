//! Parameters of a step. All were tuned on grasps, stacks and walking robots at 200 Hz; a change needs a
//! reason.

use rapier3d::glamx::DVec3;

/// Spring and damper, given by frequency and damping ratio as in Catto's soft constraints (GDC 2011).
#[derive(Clone, Copy, Debug)]
pub struct Softness {
    pub frequency_hz: f64,
    pub damping_ratio: f64,
}

impl Softness {
    /// Returns the share of a position error that is corrected per second:  omega / (dt omega + 2 zeta).
    pub(super) fn correction_per_s(&self, dt_s: f64) -> f64 {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        omega / (dt_s * omega + 2.0 * self.damping_ratio)
    }

    /// Returns the compliance of a row as a share of its effective mass:
    /// with e = 1 / (dt correction) - 1,  e^2 / ((1 + e) 4 zeta^2).
    pub(super) fn compliance(&self, dt_s: f64) -> f64 {
        let e = 1.0 / (dt_s * self.correction_per_s(dt_s)) - 1.0;
        e * e / ((1.0 + e) * 4.0 * self.damping_ratio * self.damping_ratio)
    }
}

#[derive(Clone, Debug)]
pub struct Settings {
    pub dt_s: f64,
    pub gravity_m_s2: DVec3,
    /// Number of sweeps that correct positions, and of rigid sweeps without correction after them. Without
    /// the latter, or if the next step began with their impulses, a held bottle would slip by a third of a
    /// millimetre.
    pub sweeps: usize,
    pub relaxing_sweeps: usize,
    /// Softness of contacts between two moving bodies, and of contacts with fixed ones.
    pub contact: Softness,
    pub ground_contact: Softness,
    /// Penetration depth that is not corrected. At 0 a bottle precesses on its rim; at 1 mm hung frames slip.
    pub slop_m: f64,
    /// Maximum speed at which penetration is corrected.
    pub fastest_correction_m_s: f64,
    /// Margin on the closing speed. A gap that would stay open even at a closing speed higher by this margin
    /// gets no row.
    pub margin_m_s: f64,
    /// Maximum distance between a contact point and the point of the last step that it continues.
    pub match_m: f64,
    /// Share of the error of limits and equalities that is corrected per second.
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
    /// Corrects penetration and joint errors. Its velocities move the positions.
    Correcting,
    /// Rigid and without correction, so that correcting a penetration adds no velocity. Its velocities are
    /// those at the end of the step.
    Relaxing,
}
