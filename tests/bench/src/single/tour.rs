//! Tours: a robot walks to random waypoints in a square, one after the other, and receives a punch on each
//! leg. A shorter case is a single leg with a hard punch.

use tandem_sim::{BaseCommand, BaseLimits, SplitMix64, Vector};

/// Parameters of a tour.
#[derive(Clone)]
pub(super) struct Tour {
    pub waypoints: usize,
    pub half_side_m: f32,
    pub leg_s: f32,
    /// Ranges of the time of a punch since the start of its leg, and of its force; `punch_s` is its duration.
    pub punch_at_s: [f32; 2],
    pub punch_n: [f32; 2],
    pub punch_s: f32,
}

impl Tour {
    pub(super) const STANDARD: Tour = Tour {
        waypoints: 18,
        half_side_m: 1.5,
        leg_s: 5.0,
        punch_at_s: [0.5, 4.5],
        punch_n: [0.0, 300.0],
        punch_s: 0.08,
    };
    /// Tour of one leg with one hard punch. In the same simulated time it causes more than twice as many
    /// falls as the standard tour.
    pub(super) const LEG: Tour =
        Tour { waypoints: 1, leg_s: 6.0, punch_at_s: [1.5, 3.5], punch_n: [200.0, 300.0], ..Tour::STANDARD };
}

/// Links that receive punches.
const BODIES: [&str; 6] = [
    "pelvis",
    "torso_link",
    "left_shoulder_yaw_link",
    "right_shoulder_yaw_link",
    "left_elbow_link",
    "right_elbow_link",
];
const POSITION_GAIN_1_S: f32 = 1.0;
const NEAR_M: f32 = 0.05;

/// One leg: its target, and the punch on the way.
pub(super) struct Leg {
    pub target_m: Vector,
    pub punch_at_s: f32,
    pub punched_link: &'static str,
    pub punch_n: Vector,
}

/// Returns the legs of a seed.
pub(super) fn legs(tour: &Tour, random: &mut SplitMix64) -> Vec<Leg> {
    let reach_m = tour.leg_s * 0.25;
    let mut from_m = Vector::ZERO;
    (0..tour.waypoints)
        .map(|_| {
            let angle = random.uniform([0.0, std::f32::consts::TAU]);
            let length_m = random.uniform([0.3, reach_m]);
            let side = tour.half_side_m;
            let next = from_m + Vector::new(angle.cos(), angle.sin(), 0.0) * length_m;
            let target_m = Vector::new(next.x.clamp(-side, side), next.y.clamp(-side, side), 0.0);
            from_m = target_m;
            let direction = random.uniform([0.0, std::f32::consts::TAU]);
            let size_n = random.uniform(tour.punch_n);
            Leg {
                target_m,
                punch_at_s: random.uniform(tour.punch_at_s),
                punched_link: BODIES
                    [(random.uniform([0.0, BODIES.len() as f32]) as usize).min(BODIES.len() - 1)],
                punch_n: Vector::new(direction.cos(), direction.sin(), 0.0) * size_n,
            }
        })
        .collect()
}

/// Returns the command to walk straight to the target without turning, or to stand once the target is closer
/// than [`NEAR_M`].
pub(super) fn command(
    away_m: Vector,
    heading_rad: f32,
    limits: &BaseLimits,
    pelvis_height_m: f32,
) -> BaseCommand {
    let (sine, cosine) = heading_rad.sin_cos();
    let still = away_m.length() < NEAR_M;
    let along = |part: f32| if still { 0.0 } else { part * POSITION_GAIN_1_S };
    limits.clamp(BaseCommand {
        vx_m_s: along(away_m.x * cosine + away_m.y * sine),
        vy_m_s: along(away_m.y * cosine - away_m.x * sine),
        yaw_rate_rad_s: -heading_rad.clamp(-0.5, 0.5) * if still { 0.0 } else { 1.0 },
        pelvis_height_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn punches_are_as_late_and_as_hard_as_their_tour_says() {
        for tour in [Tour::STANDARD, Tour::LEG] {
            for seed in 0..100 {
                let legs = legs(&tour, &mut SplitMix64(seed));
                assert_eq!(legs.len(), tour.waypoints);
                for leg in legs {
                    let within = |[low, high]: [f32; 2], value: f32| (low..=high).contains(&value);
                    assert!(within(tour.punch_at_s, leg.punch_at_s), "{} s", leg.punch_at_s);
                    assert!(within([tour.punch_n[0] - 0.01, tour.punch_n[1] + 0.01], leg.punch_n.length()));
                    assert!(leg.punch_at_s + tour.punch_s < tour.leg_s);
                }
            }
        }
    }
}
