//! Disturbances that no command can cause: pushes on a link, weights fixed to a hand, objects moved
//! elsewhere. They serve benchmarks, tests of controllers and stress on episodes; no tool exposes them.

use std::ops::Range;

use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::{AngVector, MassProperties};

use super::World;
use crate::dynamics::{ContactPoint, DVec3, Dynamics, LinkId, Mass};
use crate::locomotion::Locomotion;
use crate::mechanism::{precise, rounded};
use crate::owner::Owner;
use crate::{Side, mass};

/// Overlap that counts as contact: resting contacts are a little deeper than zero.
const ALLOWED_OVERLAP_M: f64 = 0.002;

/// A force for one control step.
pub(super) struct Push {
    link: LinkId,
    point_in_link_m: Vector,
    /// Force in the world frame.
    force_n: Vector,
}

/// A force that acts on a robot during some control steps, like a push by a person.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPush {
    pub robot: usize,
    /// Name of the link that is pushed.
    pub link: String,
    pub point_in_link_m: Vector,
    /// Force in the world frame.
    pub force_n: Vector,
    /// Control steps of the world, counted from 0, in which the push acts.
    pub control_steps: Range<u64>,
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
    /// Adds a force (N, world) at a point (link frame) of a robot's link during the next control step.
    ///
    /// # Panics
    ///
    /// Panics if the robot has no such link.
    pub fn push(&mut self, robot: usize, link: &str, point_in_link_m: Vector, force_n: Vector) {
        let link = self.robot_link(robot, link);
        self.pushes.push(Push { link, point_in_link_m, force_n });
    }

    fn robot_link(&self, robot: usize, link: &str) -> LinkId {
        let robot = &self.robots[robot];
        let found = robot.model.links.iter().position(|candidate| candidate.name == link);
        robot.tree.link(found.unwrap_or_else(|| panic!("no link `{link}` in the robot's file")))
    }

    /// Sets all planned pushes. They are part of the set-up, not of the state: after restoring a
    /// snapshot, the caller has to set them again.
    ///
    /// # Panics
    ///
    /// Panics if a robot has no such link.
    pub fn plan_pushes(&mut self, planned: Vec<PlannedPush>) {
        let push = |PlannedPush { robot, link, point_in_link_m, force_n, control_steps }: PlannedPush| {
            let link = self.robot_link(robot, &link);
            (control_steps, Push { link, point_in_link_m, force_n })
        };
        self.planned_pushes = planned.into_iter().map(push).collect();
    }

    /// Multiplies the mass of an object and of all its moving parts by `factor`. The change is part of the
    /// set-up, not of the state.
    pub fn scale_mass(&mut self, object: &str, factor: f64) {
        for index in self.parts_of(object) {
            let Some(link) = self.objects[index].link else { continue };
            let tree = self.dynamics.tree_mut(link.tree);
            let Mass { mass_kg, com_m, inertia_kg_m2 } = tree.links()[link.link].mass;
            let heavier = Mass { mass_kg: mass_kg * factor, com_m, inertia_kg_m2: inertia_kg_m2 * factor };
            tree.set_mass(link.link, heavier);
        }
    }

    /// Scales an object and all its moving parts to this total mass. The change is part of the set-up, not of
    /// the state.
    pub fn set_mass(&mut self, object: &str, mass_kg: f64) {
        let link_kg = |index: usize| {
            let link = self.objects[index].link?;
            Some(self.dynamics.tree(link.tree).links()[link.link].mass.mass_kg)
        };
        let now_kg: f64 = self.parts_of(object).into_iter().filter_map(link_kg).sum();
        self.scale_mass(object, mass_kg / now_kg);
    }

    /// Reduces the friction of an object and of all its moving parts to this share. The change is part of the
    /// set-up, not of the state.
    pub fn leave_friction(&mut self, object: &str, share: f64) {
        for index in self.parts_of(object) {
            self.dynamics.leave_friction(Owner::Object(index).tag(), share);
        }
    }

    /// Returns the indices of an object and of all its moving parts.
    fn parts_of(&self, object: &str) -> Vec<usize> {
        let is_part = |name: &str| {
            name.strip_prefix(object).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
        };
        (0..self.objects.len()).filter(|index| is_part(&self.objects[*index].name)).collect()
    }

    /// Fuses a point mass to a palm, without informing the controller.
    pub fn load_hand(&mut self, robot: usize, side: Side, mass_kg: f32, point_in_wrist_m: Vector) {
        let robot = &self.robots[robot];
        let wrist = robot.model.hands[side].wrist;
        let load = MassProperties::new(point_in_wrist_m, mass_kg, AngVector::splat(1e-4 * mass_kg));
        let whole = mass::sum(robot.model.links[wrist].mass, load);
        self.dynamics.tree_mut(robot.tree).set_mass(wrist, Mass::from_rapier(&whole));
    }

    /// Pushes like [`World::push`], at a point of the link that a hinge or slide of an object carries,
    /// in that link's frame.
    ///
    /// # Panics
    ///
    /// Panics if no object has such a joint.
    pub fn push_object(&mut self, joint: &str, point_in_link_m: Vector, force_n: Vector) {
        let link = self.jointed_link(joint);
        self.pushes.push(Push { link, point_in_link_m, force_n });
    }

    /// Sets position and velocity of an object's hinge, by the joint's name in the file.
    ///
    /// # Panics
    ///
    /// Panics if no object has such a joint.
    pub fn set_object_hinge(&mut self, joint: &str, position_rad: f64, velocity_rad_s: f64) {
        let link = self.jointed_link(joint);
        self.dynamics.tree_mut(link.tree).set_joint(link.link, position_rad, velocity_rad_s);
    }

    fn jointed_link(&self, joint: &str) -> LinkId {
        self.link_of(|object| object.joint.as_deref() == Some(joint))
            .unwrap_or_else(|| panic!("no joint `{joint}`"))
    }

    /// Moves a robot to a pose, at rest, with its joints unchanged.
    ///
    /// # Panics
    ///
    /// Panics if there is no such robot.
    pub fn put_robot(&mut self, robot: usize, world_from_pelvis: Pose) {
        let tree = self.dynamics.tree_mut(self.robots[robot].tree);
        tree.set_base(precise(&world_from_pelvis), DVec3::ZERO, DVec3::ZERO);
    }

    /// Returns true if a robot overlaps with another body at its present pose.
    ///
    /// # Panics
    ///
    /// Panics if there is no such robot.
    pub fn overlaps(&mut self, robot: usize) -> bool {
        let tree = self.robots[robot].tree;
        let before = self.dynamics.state();
        // A trial step finds the contacts, and is undone.
        let stepped = self.dynamics.step();
        let of_robot = |touch: &ContactPoint| {
            let [a, b] = touch.colliders.map(|id| self.dynamics.collider(id).on.map(|on| on.tree));
            a != b && [a, b].contains(&Some(tree))
        };
        let overlap = |touch: &ContactPoint| of_robot(touch) && touch.gap_m < -ALLOWED_OVERLAP_M;
        let overlaps = stepped.is_err() || self.dynamics.touches().any(overlap);
        self.dynamics.restore(&before).expect("a state of this world");
        overlaps
    }

    /// Returns true if a box along the world's axes meets the bounds of any collider other than an
    /// endless floor.
    pub fn touches_box(&self, middle_m: Vector, half_m: Vector) -> bool {
        let [low_m, high_m] = [middle_m - half_m, middle_m + half_m];
        self.dynamics.colliders().filter(|(collider, _)| !collider.endless).any(
            |(collider, world_from_shape)| {
                let bounds = collider.shape.compute_aabb(&rounded(&world_from_shape));
                (0..3).all(|axis| bounds.mins[axis] < high_m[axis] && bounds.maxs[axis] > low_m[axis])
            },
        )
    }

    /// Moves a free object to a pose, at rest.
    ///
    /// # Panics
    ///
    /// Panics if there is no such free object.
    pub fn put_object(&mut self, name: &str, world_from_object: Pose) {
        let link = self.link_of(|object| object.name == name);
        let link = link.unwrap_or_else(|| panic!("no free object `{name}`"));
        let tree = self.dynamics.tree_mut(link.tree);
        tree.set_base(precise(&world_from_object), DVec3::ZERO, DVec3::ZERO);
    }

    /// Gives a robot another base controller, which starts from the robot's present posture.
    pub fn set_locomotion(&mut self, robot: usize, locomotion: Box<dyn Locomotion>) {
        self.robots[robot].set_locomotion(locomotion);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CONTROL_DT_S, GRAVITY_M_S2, ObjectPlacement, RobotCommand, RobotPlacement, WorldSpec};

    fn world() -> World {
        let robot = RobotPlacement { name: "A".into(), position_m: [-2.0, 0.0], yaw_rad: 0.0 };
        let crate_ =
            ObjectPlacement { name: "crate".into(), file: "crate".into(), world_from_object: Pose::IDENTITY };
        World::new(&WorldSpec { scene: "floor".into(), robots: vec![robot], objects: vec![crate_] }).unwrap()
    }

    fn rest(world: &World) -> Vec<RobotCommand> {
        vec![world.rest_command(0)]
    }

    /// Returns the speed that a crate sliding at 2 m/s loses in a fifth of a second.
    fn slowed_m_s(mut world: World) -> f64 {
        let commands = rest(&world);
        for _ in 0..10 {
            world.control_step(&commands).unwrap();
        }
        let link = world.link_of(|object| object.name == "crate").unwrap();
        let pose = world.dynamics.tree(link.tree).world_from_link(0);
        world.dynamics.tree_mut(link.tree).set_base(pose, DVec3::X * 2.0, DVec3::ZERO);
        for _ in 0..10 {
            world.control_step(&commands).unwrap();
        }
        2.0 - f64::from(world.present().object("crate").unwrap().velocity_m_s.x)
    }

    #[test]
    fn a_slippery_object_is_slowed_by_what_is_left_of_friction_and_a_heavy_one_as_any() {
        // Wood on wood, as in both files.
        let expected_m_s = 0.4 * f64::from(GRAVITY_M_S2) * 10.0 * f64::from(CONTROL_DT_S);
        for (share, times) in [(1.0, 1.0), (0.5, 1.0), (1.0, 2.0)] {
            let mut world = world();
            world.leave_friction("crate", share);
            world.scale_mass("crate", times);
            let slowed_m_s = slowed_m_s(world);
            let wanted_m_s = share * expected_m_s;
            assert!((slowed_m_s - wanted_m_s).abs() < 0.05 * wanted_m_s, "{share} {times}: {slowed_m_s} m/s");
        }
    }

    #[test]
    fn a_heavier_object_has_so_many_times_the_mass_and_nothing_else_has() {
        let mut world = world();
        let masses_kg = |world: &World| -> Vec<f64> {
            world.dynamics.tree_ids().map(|id| world.dynamics.tree(id).mass_kg()).collect()
        };
        let before_kg = masses_kg(&world);
        world.scale_mass("crate", 1.5);
        let ratios: Vec<f64> =
            masses_kg(&world).iter().zip(&before_kg).map(|(after, before)| after / before).collect();
        assert_eq!(ratios.iter().filter(|ratio| **ratio != 1.0).count(), 1, "{ratios:?}");
        assert!(ratios.iter().any(|ratio| (ratio - 1.5).abs() < 1e-12), "{ratios:?}");
    }

    #[test]
    fn a_planned_push_acts_in_its_steps_and_so_it_does_again_from_a_snapshot() {
        let (mut plain, mut pushed) = (world(), world());
        let push = PlannedPush {
            robot: 0,
            link: "torso_link".into(),
            point_in_link_m: Vector::ZERO,
            force_n: Vector::new(0.0, 30.0, 0.0),
            control_steps: 3..8,
        };
        pushed.plan_pushes(vec![push]);
        let commands = rest(&plain);
        let mut snapshot = None;
        for step in 0..10 {
            if step == 5 {
                snapshot = Some(pushed.snapshot().unwrap());
            }
            plain.control_step(&commands).unwrap();
            pushed.control_step(&commands).unwrap();
            assert_eq!(plain.state_hash() == pushed.state_hash(), step < 3, "step {step}");
        }
        let velocity_m_s = |world: &World| world.present().robots[0].truth.world_from_pelvis().translation.y;
        assert!(velocity_m_s(&pushed) > velocity_m_s(&plain) + 1e-4);
        let end = pushed.state_hash();
        pushed.restore(&snapshot.unwrap()).unwrap();
        for _ in 5..10 {
            pushed.control_step(&commands).unwrap();
        }
        assert_eq!(pushed.state_hash(), end);
    }
}
