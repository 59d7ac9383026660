//! What no command can make: pushes at a link, weights fused to a hand, objects put elsewhere. For benches and tests of
//! controllers; no tool reaches them.

use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::{AngVector, MassProperties};

use super::World;
use crate::Side;
use crate::dynamics::{ContactPoint, DVec3, Dynamics, LinkId, Mass};
use crate::locomotion::Locomotion;
use crate::mechanism::precise;

/// Resting contacts are a little deeper than nothing.
const ALLOWED_OVERLAP_M: f64 = 0.002;

/// A force for one control step.
pub(super) struct Push {
    link: LinkId,
    point_in_link_m: Vector,
    /// World frame.
    force_n: Vector,
}

impl Push {
    /// Pushes for one physics step.
    pub fn apply(&self, dynamics: &mut Dynamics) {
        let tree = dynamics.tree_mut(self.link.tree);
        let point_m = tree.world_from_link(self.link.link) * self.point_in_link_m.as_dvec3();
        tree.push(self.link.link, point_m, self.force_n.as_dvec3());
    }
}

impl World {
    /// Sets the force (N, world) that pulls at a point (link frame) of a robot's link during the next control step, in
    /// addition to other pushes. An unknown link is a bug of the caller.
    pub fn push(&mut self, robot: usize, link: &str, point_in_link_m: Vector, force_n: Vector) {
        let robot = &self.robots[robot];
        let found = robot.model.links.iter().position(|candidate| candidate.name == link);
        let link = found.unwrap_or_else(|| panic!("no link `{link}` in the robot's file"));
        self.pushes.push(Push { link: robot.tree.link(link), point_in_link_m, force_n });
    }

    /// Fuses a point mass to a palm: the controller is not told.
    pub fn load_hand(&mut self, robot: usize, side: Side, mass_kg: f32, point_in_wrist_m: Vector) {
        let robot = &self.robots[robot];
        let wrist = robot.model.hands[side].wrist;
        let load = MassProperties::new(point_in_wrist_m, mass_kg, AngVector::splat(1e-4 * mass_kg));
        let whole = robot.model.links[wrist].mass + load;
        self.dynamics.tree_mut(robot.tree).set_mass(wrist, Mass::from_rapier(&whole));
    }

    /// As [`World::push`], at a point of the link that a hinge or slide of an object carries, in that link's frame.
    pub(crate) fn push_object(&mut self, joint: &str, point_in_link_m: Vector, force_n: Vector) {
        let link = self.jointed_link(joint);
        self.pushes.push(Push { link, point_in_link_m, force_n });
    }

    /// Sets a hinge of an object, by the name that its file gives.
    pub(crate) fn set_object_hinge(&mut self, joint: &str, position_rad: f64, velocity_rad_s: f64) {
        let link = self.jointed_link(joint);
        self.dynamics.tree_mut(link.tree).set_joint(link.link, position_rad, velocity_rad_s);
    }

    fn jointed_link(&self, joint: &str) -> LinkId {
        self.link_of(|object| object.joint.as_deref() == Some(joint))
            .unwrap_or_else(|| panic!("no joint `{joint}`"))
    }

    /// Puts a robot somewhere, at rest, as its joints are.
    pub(crate) fn put_robot(&mut self, robot: usize, world_from_pelvis: Pose) {
        let tree = self.dynamics.tree_mut(self.robots[robot].tree);
        tree.set_base(precise(&world_from_pelvis), DVec3::ZERO, DVec3::ZERO);
    }

    /// Whether a robot overlaps with anything else where it is.
    pub(crate) fn overlaps(&mut self, robot: usize) -> bool {
        let tree = self.robots[robot].tree;
        let before = self.dynamics.state();
        // A step finds out what touches, and is taken back.
        let stepped = self.dynamics.step();
        let of_robot = |touch: &ContactPoint| {
            let [a, b] = touch.colliders.map(|id| self.dynamics.collider(id).on.map(|on| on.tree));
            a != b && [a, b].contains(&Some(tree))
        };
        let overlap = |touch: &ContactPoint| of_robot(touch) && touch.gap_m < -ALLOWED_OVERLAP_M;
        let overlaps = stepped.is_err() || self.dynamics.touches().iter().any(overlap);
        self.dynamics.restore(&before).expect("a state of this world");
        overlaps
    }

    /// Puts a free object somewhere, at rest. An unknown one is a bug of the caller.
    pub(crate) fn put_object(&mut self, name: &str, world_from_object: Pose) {
        let link = self.link_of(|object| object.name == name);
        let link = link.unwrap_or_else(|| panic!("no free object `{name}`"));
        let tree = self.dynamics.tree_mut(link.tree);
        tree.set_base(precise(&world_from_object), DVec3::ZERO, DVec3::ZERO);
    }

    /// Gives a robot another base controller, which starts from how the robot stands now.
    pub fn set_locomotion(&mut self, robot: usize, locomotion: Box<dyn Locomotion>) {
        self.robots[robot].set_locomotion(locomotion);
    }
}
