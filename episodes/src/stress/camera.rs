//! Camera stress: each head camera is displaced, as after a knock, and slightly blurred. Robots still
//! receive the pose from their file. Depth is measured from the displaced camera, so points are off by the
//! same displacement.

use tandem_sim::render::LensFlaw;
use tandem_sim::{Pose, Rotation, SplitMix64, Vector};

use super::{StressAxis, StressLevel, random};

const SHIFT_M: [f32; 3] = [0.01, 0.02, 0.04];
const TURN_DEG: [f32; 3] = [1.5, 3.0, 6.0];
/// Blur of images that are 320 pixels wide.
const BLUR_PX: [f32; 3] = [0.7, 1.2, 2.0];

pub fn lens(level: StressLevel, seed: u32, robot: usize) -> LensFlaw {
    let mut random = random(StressAxis::Camera, seed, robot);
    let towards = direction(&mut random);
    // A camera looks along -z, so this never moves it back into the head.
    let shift_m = towards.with_z(-towards.z.abs()) * level.of(SHIFT_M);
    let turn = Rotation::from_axis_angle(direction(&mut random), level.of(TURN_DEG).to_radians());
    LensFlaw { camera_from_lens: Pose::from_parts(shift_m, turn), blur_px: level.of(BLUR_PX) }
}

/// Draws a unit vector, with all directions equally likely.
fn direction(random: &mut SplitMix64) -> Vector {
    Vector::new(random.normal(), random.normal(), random.normal()).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_goes_ever_farther_off_the_same_way_and_each_robot_has_its_own() {
        for seed in 0..20 {
            let lenses = StressLevel::ALL.map(|level| lens(level, seed, 0));
            for (lens, level) in lenses.iter().zip(0..) {
                let Pose { translation, rotation, .. } = lens.camera_from_lens;
                assert!((translation.length() - SHIFT_M[level]).abs() < 1e-5);
                let turn_rad = rotation.angle_between(Rotation::IDENTITY);
                assert!((turn_rad.to_degrees() - TURN_DEG[level]).abs() < 0.05, "{turn_rad}");
                assert!(
                    translation.normalize().dot(lenses[0].camera_from_lens.translation.normalize()) > 0.999
                );
            }
            assert_eq!(lens(StressLevel::Two, seed, 0), lenses[1]);
            assert_ne!(lens(StressLevel::Two, seed, 1), lenses[1]);
        }
    }
}
