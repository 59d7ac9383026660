//! Capsules, which are spheres swept along segments, and the closest points of two capsules.

use nalgebra::{Point3, Vector3};

use crate::model::{Configuration, FrameId};

/// A sphere swept along a segment, fixed to a frame. If both ends are the same, it is a sphere.
#[derive(Clone, Debug)]
pub struct Capsule {
    /// Frame that it moves with.
    pub frame: FrameId,
    /// Ends of the segment in that frame, m.
    pub ends: [Point3<f64>; 2],
    /// Radius, m.
    pub radius_m: f64,
}

/// A capsule's axis in the root's frame, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub centre: Vector3<f64>,
    /// The vector from the centre to the second end.
    half: Vector3<f64>,
    pub half_length: f64,
}

impl Segment {
    pub fn of(capsule: &Capsule, configuration: &Configuration) -> Segment {
        let pose = configuration.root_from_frame(capsule.frame);
        let [first, second] = capsule.ends.map(|end| (pose * end).coords);
        let half = (second - first) * 0.5;
        Segment { centre: (first + second) * 0.5, half, half_length: half.norm() }
    }

    pub fn ends(&self) -> [Vector3<f64>; 2] {
        [self.centre - self.half, self.centre + self.half]
    }
}

/// Returns the closest points of two segments. Source: Ericson, Real-time collision detection, 2004,
/// section 5.1.9.
pub(super) fn closest_points([a, b]: [[Vector3<f64>; 2]; 2]) -> [Vector3<f64>; 2] {
    let (da, db, between) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, bb, f) = (da.norm_squared(), db.norm_squared(), db.dot(&between));
    let point_like = 1e-18;
    let (s, t) = if aa <= point_like && bb <= point_like {
        (0.0, 0.0)
    } else if aa <= point_like {
        (0.0, (f / bb).clamp(0.0, 1.0))
    } else {
        let c = da.dot(&between);
        if bb <= point_like {
            ((-c / aa).clamp(0.0, 1.0), 0.0)
        } else {
            let ab = da.dot(&db);
            let parallel = aa * bb - ab * ab;
            let s =
                if parallel > 1e-12 * aa * bb { ((ab * f - c * bb) / parallel).clamp(0.0, 1.0) } else { 0.5 };
            let t = (ab * s + f) / bb;
            if t < 0.0 {
                ((-c / aa).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((ab - c) / aa).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    [a[0] + da * s, b[0] + db * t]
}
