//! What the seed changes: offsets drawn uniformly, in table order, from a generator that is the same everywhere.

use std::ops::RangeInclusive;

use tandem_sim::SplitMix64;

use super::Task;

/// A displacement that some objects share, uniform on each axis of the world and about it.
#[derive(Debug)]
pub struct Offset {
    /// Objects that move together.
    pub objects: &'static [&'static str],
    pub x_m: RangeInclusive<f32>,
    pub y_m: RangeInclusive<f32>,
    pub z_m: RangeInclusive<f32>,
    /// Turn about each object's own vertical axis.
    pub yaw_rad: RangeInclusive<f32>,
}

/// An offset of up to `x_m` and `y_m` either way along world x and y, independently.
pub const fn uniform_xy(objects: &'static [&'static str], x_m: f32, y_m: f32) -> Offset {
    Offset { objects, x_m: -x_m..=x_m, y_m: -y_m..=y_m, z_m: 0.0..=0.0, yaw_rad: 0.0..=0.0 }
}

impl Task {
    /// Where every object starts under `seed`, in the order of [`Task::objects`]: world position in metres, and yaw.
    pub fn start_poses(&self, seed: u32) -> Vec<StartPose> {
        let mut random = SplitMix64(seed.into());
        let mut start_poses: Vec<StartPose> = self
            .objects
            .iter()
            .map(|spot| StartPose { position_m: spot.position_m, yaw_rad: spot.yaw_rad })
            .collect();
        for offset in self.randomize {
            let [x_m, y_m, z_m, yaw_rad] = [&offset.x_m, &offset.y_m, &offset.z_m, &offset.yaw_rad]
                .map(|range| random.uniform([*range.start(), *range.end()]));
            let moved = |spot: &super::ObjectSpot| offset.objects.contains(&spot.name);
            for (start, _) in start_poses.iter_mut().zip(self.objects).filter(|(_, spot)| moved(spot)) {
                start.position_m =
                    [start.position_m[0] + x_m, start.position_m[1] + y_m, start.position_m[2] + z_m];
                start.yaw_rad += yaw_rad;
            }
        }
        start_poses
    }
}

/// Where one object starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPose {
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
}

/// Seeds and ranges.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks::ALL;

    #[test]
    fn offsets_fill_their_ranges_and_stay_inside() {
        for task in ALL {
            let start_poses: Vec<_> = (0..400).map(|seed| task.start_poses(seed)).collect();
            for (index, spot) in task.objects.iter().enumerate() {
                let own: Vec<_> =
                    task.randomize.iter().filter(|offset| offset.objects.contains(&spot.name)).collect();
                let axes: [fn(&Offset) -> &RangeInclusive<f32>; 4] =
                    [|o| &o.x_m, |o| &o.y_m, |o| &o.z_m, |o| &o.yaw_rad];
                let rest = [spot.position_m[0], spot.position_m[1], spot.position_m[2], spot.yaw_rad];
                for (axis, range) in axes.into_iter().enumerate() {
                    let low: f32 = own.iter().map(|offset| *range(offset).start()).sum();
                    let high: f32 = own.iter().map(|offset| *range(offset).end()).sum();
                    let value = |start: &StartPose| {
                        [start.position_m[0], start.position_m[1], start.position_m[2], start.yaw_rad][axis]
                    };
                    let moved = start_poses.iter().map(|start| value(&start[index]) - rest[axis]);
                    let (least, most) = moved.fold((f32::MAX, f32::MIN), |(l, h), m| (l.min(m), h.max(m)));
                    // Sums of several offsets seldom come near their ends.
                    let (slack, width) = (1e-5, high - low);
                    assert!(
                        least >= low - slack && least <= low + 0.25 * width + slack,
                        "{} {axis}",
                        spot.name
                    );
                    assert!(
                        most <= high + slack && most >= high - 0.25 * width - slack,
                        "{} {axis}",
                        spot.name
                    );
                }
            }
        }
    }

    #[test]
    fn a_seed_always_means_the_same_start_and_seeds_differ() {
        for task in ALL {
            assert_eq!(task.start_poses(7), task.start_poses(7));
            assert_ne!(task.start_poses(7), task.start_poses(8));
        }
    }
}
