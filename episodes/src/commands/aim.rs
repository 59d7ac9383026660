//! Aims of wrists, and the poses that they mean.

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// Aim of a wrist.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Aim {
    /// The arm's joints keep their targets.
    Joints,
    /// A pose in the world frame: the hand stays there while the pelvis sways or walks.
    World(Isometry3<f64>),
    /// A pose in the pelvis frame, which moves with the pelvis.
    Carried(Isometry3<f64>),
}

/// Poses of a wrist in the pelvis frame.
#[derive(Clone, Copy, Debug)]
pub struct WristPoses {
    /// Target without yielding; `unyielded` if the arm keeps its joints.
    pub target: Isometry3<f64>,
    /// Target with yielding, which the arm follows; `commanded` if the arm keeps its joints.
    pub yielded: Isometry3<f64>,
    /// Pose under the joint targets, which include the yielding.
    pub commanded: Isometry3<f64>,
    /// The commanded pose without the yielding.
    pub unyielded: Isometry3<f64>,
}

impl Aim {
    /// Returns the requested wrist pose in the frame of a pelvis at `world_from_pelvis`; `None` for joints.
    pub fn in_pelvis(&self, world_from_pelvis: &Isometry3<f64>) -> Option<Isometry3<f64>> {
        match self {
            Aim::Joints => None,
            Aim::World(world_from_wrist) => Some(world_from_pelvis.inv_mul(world_from_wrist)),
            Aim::Carried(pelvis_from_wrist) => Some(*pelvis_from_wrist),
        }
    }

    /// Returns an aim of the same kind that a wrist at `pelvis_from_wrist` has reached.
    pub fn at(&self, world_from_pelvis: &Isometry3<f64>, pelvis_from_wrist: &Isometry3<f64>) -> Aim {
        match self {
            Aim::Joints => Aim::Joints,
            Aim::World(_) => Aim::World(world_from_pelvis * pelvis_from_wrist),
            Aim::Carried(_) => Aim::Carried(*pelvis_from_wrist),
        }
    }

    /// Interpolates from this aim to `goal`, in its frame. Returns `goal` if the two are of different kinds.
    pub fn towards(&self, goal: &Aim, share: f64) -> Aim {
        match (self, goal) {
            (Aim::World(from), Aim::World(to)) => Aim::World(between(from, to, share)),
            (Aim::Carried(from), Aim::Carried(to)) => Aim::Carried(between(from, to, share)),
            (Aim::Joints | Aim::World(_) | Aim::Carried(_), goal) => *goal,
        }
    }
}

fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    from.try_lerp_slerp(to, share, 1e-9).unwrap_or(*to)
}
