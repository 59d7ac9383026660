//! Loads that no command can make: pushes at a link, weights fused to a hand. For benches and tests of controllers; no
//! tool reaches them.

use rapier3d::math::Vector;
use rapier3d::prelude::{AngVector, MassProperties};

use super::World;
use crate::Side;
use crate::locomotion::Locomotion;

impl World {
    /// Sets the force (N, world) that pulls at a point (link frame) of a robot's link during the next control step, in
    /// addition to other pushes. An unknown link is a bug of the caller.
    pub fn push(&mut self, robot: usize, link: &str, point_in_link_m: Vector, force_n: Vector) {
        let robot = &self.robots[robot];
        let found = robot.model.links.iter().position(|candidate| candidate.name == link);
        let link = found.unwrap_or_else(|| panic!("no link `{link}` in the robot's file"));
        let body = &mut self.physics.bodies[robot.bodies[link]];
        let point_m = *body.position() * point_in_link_m;
        body.add_force_at_point(force_n, point_m, true);
        self.pushed = true;
    }

    /// Fuses a point mass to a palm: the controller is not told.
    pub fn load_hand(&mut self, robot: usize, side: Side, mass_kg: f32, point_in_wrist_m: Vector) {
        let robot = &self.robots[robot];
        let wrist = robot.model.hands[side].wrist;
        let load = MassProperties::new(point_in_wrist_m, mass_kg, AngVector::splat(1e-4 * mass_kg));
        let whole = robot.model.links[wrist].mass + load;
        self.physics.bodies[robot.bodies[wrist]].set_additional_mass_properties(whole, true);
    }

    /// Gives a robot another base controller, which starts from how the robot stands now.
    pub fn set_locomotion(&mut self, robot: usize, locomotion: Box<dyn Locomotion>) {
        self.robots[robot].set_locomotion(locomotion);
    }

    /// Pushes last one control step.
    pub(super) fn end_pushes(&mut self) {
        if std::mem::take(&mut self.pushed) {
            for body in self.robots.iter().flat_map(|robot| &robot.bodies) {
                self.physics.bodies[*body].reset_forces(true);
                self.physics.bodies[*body].reset_torques(true);
            }
        }
    }
}
