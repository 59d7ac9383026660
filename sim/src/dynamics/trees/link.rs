//! Components of a tree: links, their joints and masses. This module does not depend on robots or file
//! formats.

use rapier3d::glamx::{DMat3, DPose3, DVec3};
use rapier3d::prelude::MassProperties;

/// A rigid body and the joint that connects it to its parent.
#[derive(Clone, Debug)]
pub struct Link {
    pub name: String,
    /// An earlier link of the tree; `None` is the world.
    pub parent: Option<usize>,
    /// Pose with the joint at 0; for a free link, the initial pose in the world.
    pub parent_from_link: DPose3,
    pub joint: Joint,
    pub mass: Mass,
}

#[derive(Clone, Debug)]
pub enum Joint {
    /// Six degrees of freedom; only the first link of a tree may be free.
    Free,
    Fixed,
    Hinge(Axis),
    Slide(Axis),
}

/// Joint of one degree of freedom. Positions are in rad for a hinge and m for a slide, efforts in N m and N.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Unit vector, link frame.
    pub direction: DVec3,
    /// Point on a hinge's axis, link frame.
    pub anchor_m: DVec3,
    /// Inertia of the drive as seen by the joint: kg m^2 or kg.
    pub armature: f64,
    /// Effort of dry friction.
    pub friction_loss: f64,
    /// Effort per unit of velocity.
    pub damping: f64,
    /// Effort per unit of displacement from `spring_rest`.
    pub stiffness: f64,
    pub spring_rest: f64,
    /// Minimum and maximum position.
    pub range: Option<[f64; 2]>,
    /// Maximum effort of a drive; infinite if the drive has no limit.
    pub effort_limit: f64,
    /// Speed at which a drive exerts no effort in the direction of motion; its effort falls near that speed.
    /// Infinite for a drive without a speed limit.
    pub speed_limit: f64,
}

/// Setpoint of a joint's drive. It stays in effect until it is replaced, and is not part of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Target position, rad or m.
    pub target: f64,
    /// Effort per unit of position error.
    pub kp: f64,
    /// Effort per unit of joint velocity.
    pub kd: f64,
    /// Constant effort, N m or N.
    pub feedforward: f64,
}

/// A drive's impulse in a step as a function of the velocity v' at its end:  rest - implicit v', within
/// +-most. A motor that turns fast pushes less in the direction in which it turns, and brakes with its
/// full effort:
///   impulse <= slope (speed_limit - v'),   slope = most / (0.2 speed_limit),   for v' > 0,
/// which is the full effort at 80 % of the limit and zero at the limit. Beyond the limit, where something
/// else turns the motor, its voltage exceeds the supply's. It drives a current back through the diodes of its
/// bridge, which no controller can prevent. It then brakes along the same line whatever the setpoint is, and
/// from 120 % on with more than `most`. Like the rest of the law, this holds at the end of the step. So no
/// motor drives itself beyond its limit within a step, however light its link is.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriveLaw {
    pub rest: f64,
    pub implicit: f64,
    pub most: f64,
    pub speed_limit: f64,
}

impl Drive {
    pub const NONE: Drive = Drive { target: 0.0, kp: 0.0, kd: 0.0, feedforward: 0.0 };
}

impl Axis {
    /// Creates an axis through the link's origin without drive, spring, friction or range.
    pub fn along(direction: DVec3) -> Axis {
        Axis {
            direction: direction.normalize(),
            anchor_m: DVec3::ZERO,
            armature: 0.0,
            friction_loss: 0.0,
            damping: 0.0,
            stiffness: 0.0,
            spring_rest: 0.0,
            range: None,
            effort_limit: f64::INFINITY,
            speed_limit: f64::INFINITY,
        }
    }
}

impl Joint {
    pub(in crate::dynamics) fn axis(&self) -> Option<&Axis> {
        match self {
            Joint::Free | Joint::Fixed => None,
            Joint::Hinge(axis) | Joint::Slide(axis) => Some(axis),
        }
    }

    pub(in crate::dynamics) fn dofs(&self) -> usize {
        match self {
            Joint::Free => 6,
            Joint::Fixed => 0,
            Joint::Hinge(_) | Joint::Slide(_) => 1,
        }
    }
}

/// Mass of a link, link frame.
#[derive(Clone, Copy, Debug)]
pub struct Mass {
    pub mass_kg: f64,
    pub com_m: DVec3,
    /// Inertia about the centre of mass, link axes.
    pub inertia_kg_m2: DMat3,
}

impl Mass {
    /// Mass of links that only carry others, for example between two joints in series.
    pub const NONE: Mass = Mass { mass_kg: 0.0, com_m: DVec3::ZERO, inertia_kg_m2: DMat3::ZERO };

    pub fn from_rapier(mass: &MassProperties) -> Mass {
        let axes = DMat3::from_quat(mass.principal_inertia_local_frame.as_dquat().normalize());
        let principal = DMat3::from_diagonal(mass.principal_inertia().as_dvec3());
        Mass {
            mass_kg: f64::from(mass.mass()),
            com_m: mass.local_com.as_dvec3(),
            inertia_kg_m2: axes * principal * axes.transpose(),
        }
    }

    /// Returns the mass of a solid box of uniform density, centred at the link's origin.
    pub fn of_box(mass_kg: f64, half_extents_m: DVec3) -> Mass {
        let s = half_extents_m * half_extents_m * (mass_kg / 3.0);
        let inertia_kg_m2 = DMat3::from_diagonal(DVec3::new(s.y + s.z, s.x + s.z, s.x + s.y));
        Mass { mass_kg, com_m: DVec3::ZERO, inertia_kg_m2 }
    }
}
