//! Seeds, ranges, and the generator's published numbers.

use super::*;
use crate::tasks::ALL;

#[test]
fn generator_gives_the_published_numbers() {
    let mut random = SplitMix64(1234567);
    let published = [6457827717110365317, 3203168211198807973, 9817491932198370423];
    assert_eq!([random.next(), random.next(), random.next()], published);
}

#[test]
fn offsets_fill_their_ranges_and_stay_inside() {
    for task in ALL {
        let starts: Vec<_> = (0..400).map(|seed| task.starts(seed)).collect();
        for (index, spot) in task.objects.iter().enumerate() {
            let own: Vec<_> =
                task.randomize.iter().filter(|offset| offset.objects.contains(&spot.name)).collect();
            let axes: [fn(&Offset) -> &RangeInclusive<f32>; 4] =
                [|o| &o.x_m, |o| &o.y_m, |o| &o.z_m, |o| &o.yaw_rad];
            let rest = [spot.position_m[0], spot.position_m[1], spot.position_m[2], spot.yaw_rad];
            for (axis, range) in axes.into_iter().enumerate() {
                let low: f32 = own.iter().map(|offset| *range(offset).start()).sum();
                let high: f32 = own.iter().map(|offset| *range(offset).end()).sum();
                let value = |start: &Start| {
                    [start.position_m[0], start.position_m[1], start.position_m[2], start.yaw_rad][axis]
                };
                let moved = starts.iter().map(|start| value(&start[index]) - rest[axis]);
                let (least, most) = moved.fold((f32::MAX, f32::MIN), |(l, h), m| (l.min(m), h.max(m)));
                // Sums of several offsets seldom come near their ends.
                let (slack, width) = (1e-5, high - low);
                assert!(least >= low - slack && least <= low + 0.25 * width + slack, "{} {axis}", spot.name);
                assert!(most <= high + slack && most >= high - 0.25 * width - slack, "{} {axis}", spot.name);
            }
        }
    }
}

#[test]
fn a_seed_always_means_the_same_start_and_seeds_differ() {
    for task in ALL {
        assert_eq!(task.starts(7), task.starts(7));
        assert_ne!(task.starts(7), task.starts(8));
    }
}
