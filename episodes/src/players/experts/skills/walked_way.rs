//! The way of an object that several robots carry, by how far the robot walks that has farthest to go: where the object turns, those at
//! its ends walk farther than its middle does.

use tandem_sim::Pose;

/// Pieces in which a part between two stops is measured.
const PIECES: usize = 16;

/// Straight from stop to stop, turning evenly meanwhile.
pub struct WalkedWay {
    parts: Vec<Part>,
}

struct Part {
    from: Pose,
    to: Pose,
    length_m: f32,
}

impl Part {
    fn at(&self, share: f32) -> Pose {
        self.from.lerp(&self.to, share)
    }
}

impl WalkedWay {
    /// Through `stops` of the object, world frame, by robots that stand at `object_from_stand`, in the object's frame.
    pub fn new(stops: &[Pose], object_from_stand: &[Pose]) -> WalkedWay {
        let part = |ends: &[Pose]| {
            let mut part = Part { from: ends[0], to: ends[1], length_m: 0.0 };
            let walked_m = |stand: &Pose| -> f32 {
                let place_m = |piece: usize| (part.at(piece as f32 / PIECES as f32) * *stand).translation;
                (0..PIECES).map(|piece| (place_m(piece + 1) - place_m(piece)).length()).sum()
            };
            part.length_m = object_from_stand.iter().map(walked_m).fold(0.0, f32::max);
            part
        };
        WalkedWay { parts: stops.windows(2).map(part).collect() }
    }

    /// How far the robot walks that has farthest to go.
    pub fn length_m(&self) -> f32 {
        self.parts.iter().map(|part| part.length_m).sum()
    }

    /// Where the object is once so much has been gone.
    pub fn at(&self, gone_m: f32) -> Pose {
        let mut left_m = gone_m;
        for part in &self.parts {
            if left_m < part.length_m {
                return part.at(left_m / part.length_m);
            }
            left_m -= part.length_m;
        }
        self.parts.last().expect("a way has two stops").to
    }
}
