//! Small worlds for tests.

use rapier3d::glamx::{DMat3, DPose3, DVec3};
use rapier3d::prelude::SharedShape;

use super::super::{
    Axis, Collider, ColliderId, Directions, Dynamics, Friction, Joint, Link, LinkId, Mask, Mass, Settings,
    Tree, TreeId,
};

pub const DT_S: f64 = 1.0 / 200.0;
pub const G_M_S2: f64 = 9.81;
pub const DOWN: DVec3 = DVec3::new(0.0, 0.0, -G_M_S2);

pub struct Bench {
    pub dynamics: Dynamics,
}

impl Bench {
    pub fn new(gravity_m_s2: DVec3) -> Bench {
        Bench { dynamics: Dynamics::new(Settings::new(DT_S, gravity_m_s2)) }
    }

    /// Creates a world with the upper side of a large slab at z = 0.
    pub fn with_floor(gravity_m_s2: DVec3, friction: Friction) -> Bench {
        let mut bench = Bench::new(gravity_m_s2);
        bench.add_slab(20.0, friction);
        bench
    }

    pub fn add(&mut self, tree: Tree) -> TreeId {
        self.dynamics.add_tree(tree)
    }

    /// Adds a fixed slab whose upper side is at z = 0.
    pub fn add_slab(&mut self, half_width_m: f32, friction: Friction) {
        let shape = SharedShape::cuboid(half_width_m, half_width_m, 0.1);
        let body_from_shape = DPose3::from_translation(DVec3::new(0.0, 0.0, -0.1));
        self.dynamics.add_collider(Collider {
            shape,
            on: None,
            body_from_shape,
            friction,
            endless: false,
            tag: 0,
            touches: Mask::ALL,
        });
    }

    /// Adds an endless floor at z = 0. Its shape is a part of 80 m at any time.
    pub fn add_endless_floor(&mut self, friction: Friction) {
        let shape = SharedShape::cuboid(40.0, 40.0, 1.0);
        let body_from_shape = DPose3::from_translation(DVec3::new(0.0, 0.0, -1.0));
        self.dynamics.add_collider(Collider {
            shape,
            on: None,
            body_from_shape,
            friction,
            endless: true,
            tag: 0,
            touches: Mask::ALL,
        });
    }

    pub fn add_shape(&mut self, on: LinkId, shape: SharedShape, friction: Friction) -> ColliderId {
        let body_from_shape = DPose3::IDENTITY;
        self.dynamics.add_collider(Collider {
            shape,
            on: Some(on),
            body_from_shape,
            friction,
            endless: false,
            tag: 0,
            touches: Mask::ALL,
        })
    }

    /// Adds a lone box of uniform density.
    pub fn add_box(&mut self, mass_kg: f64, half_m: DVec3, at: DPose3, friction: Friction) -> TreeId {
        let tree = self.add(lone("box", at, Mass::of_box(mass_kg, half_m)));
        let half = half_m.as_vec3();
        self.add_shape(tree.link(0), SharedShape::cuboid(half.x, half.y, half.z), friction);
        tree
    }

    /// Adds a lone solid ball.
    pub fn add_ball(&mut self, mass_kg: f64, radius_m: f64, at_m: DVec3, friction: Friction) -> TreeId {
        let inertia_kg_m2 = DMat3::from_diagonal(DVec3::splat(0.4 * mass_kg * radius_m * radius_m));
        let mass = Mass { mass_kg, com_m: DVec3::ZERO, inertia_kg_m2 };
        let tree = self.add(lone("ball", DPose3::from_translation(at_m), mass));
        self.add_shape(tree.link(0), SharedShape::ball(radius_m as f32), friction);
        tree
    }

    pub fn step(&mut self) {
        self.dynamics.step().expect("a step of finite numbers");
    }

    pub fn run_s(&mut self, time_s: f64) {
        (0..(time_s / DT_S).round() as usize).for_each(|_| self.step());
    }

    pub fn position_m(&self, tree: TreeId) -> DVec3 {
        self.dynamics.tree(tree).world_from_link(0).translation
    }

    /// Returns the kinetic and potential energy of a tree, without armatures.
    pub fn energy_j(&self, tree: TreeId) -> f64 {
        let tree = self.dynamics.tree(tree);
        let gravity = self.dynamics.settings.gravity_m_s2;
        (0..tree.links().len()).map(|link| link_energy_j(tree, link, gravity)).sum()
    }
}

fn link_energy_j(tree: &Tree, link: usize, gravity_m_s2: DVec3) -> f64 {
    let mass = tree.links()[link].mass;
    let pose = tree.world_from_link(link);
    let spin = tree.link_spin_rad_s(link);
    let velocity = tree.link_velocity_m_s(link) + spin.cross(pose.rotation * mass.com_m);
    let local = pose.rotation.inverse() * spin;
    let turning = local.dot(mass.inertia_kg_m2 * local);
    0.5 * (mass.mass_kg * velocity.length_squared() + turning)
        - mass.mass_kg * gravity_m_s2.dot(pose * mass.com_m)
}

/// Returns the momentum of a tree and its angular momentum about the world's origin.
pub fn momentum(tree: &Tree) -> (DVec3, DVec3) {
    let mut sum = (DVec3::ZERO, DVec3::ZERO);
    for (index, link) in tree.links().iter().enumerate() {
        let pose = tree.world_from_link(index);
        let spin = tree.link_spin_rad_s(index);
        let centre = pose * link.mass.com_m;
        let velocity = tree.link_velocity_m_s(index) + spin.cross(pose.rotation * link.mass.com_m);
        let linear = velocity * link.mass.mass_kg;
        let local = pose.rotation.inverse() * spin;
        sum.0 += linear;
        sum.1 += centre.cross(linear) + pose.rotation * (link.mass.inertia_kg_m2 * local);
    }
    sum
}

pub fn lone(name: &str, at: DPose3, mass: Mass) -> Tree {
    let link = Link { name: name.into(), parent: None, parent_from_link: at, joint: Joint::Free, mass };
    Tree::new(name, vec![link]).expect("one free link")
}

/// Builds a link at an offset from its parent, or from the world.
pub fn link(parent: Option<usize>, at_m: DVec3, joint: Joint, mass: Mass) -> Link {
    Link { name: "link".into(), parent, parent_from_link: DPose3::from_translation(at_m), joint, mass }
}

/// Builds a tree of one joint, attached to the world.
pub fn jointed(joint: Joint, mass: Mass) -> Tree {
    Tree::new("jointed", vec![link(None, DVec3::ZERO, joint, mass)]).expect("one moving link")
}

pub fn hinge(direction: DVec3) -> Joint {
    Joint::Hinge(Axis::along(direction))
}

pub fn sliding(slide: f64) -> Friction {
    Friction { directions: Directions::Slide, slide, spin_m: 0.0, roll_m: 0.0, priority: 0, left: 1.0 }
}

/// Pseudo-random numbers in -1..1, the same in every run.
pub struct Random(pub u64);

impl Random {
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }
}

/// Builds a tree of many links with every kind of joint, irregular masses and offsets.
pub fn bush(root: Joint, random: &mut Random) -> Tree {
    let mut links = Vec::new();
    for index in 0..14_usize {
        let half = DVec3::new(0.05, 0.03, 0.08) + random.vector() * 0.02;
        let mut mass = Mass::of_box(1.0 + 0.5 * random.number(), half);
        mass.com_m = random.vector() * 0.05;
        let mut axis = Axis::along(random.vector());
        axis.anchor_m = random.vector() * 0.03;
        axis.armature = 0.01;
        let joint = match index {
            0 => root.clone(),
            4 | 9 => Joint::Slide(axis),
            6 => Joint::Fixed,
            _ => Joint::Hinge(axis),
        };
        let turn = rapier3d::glamx::DQuat::from_scaled_axis(random.vector());
        let parent_from_link = DPose3::from_parts(random.vector() * 0.2, turn);
        let parent = (index > 0).then(|| [index - 1, index / 2, 0][index % 3].min(index - 1));
        links.push(Link { name: format!("link{index}"), parent, parent_from_link, joint, mass });
    }
    Tree::new("bush", links).expect("links with mass")
}

/// Sets random joint positions and velocities.
pub fn stir(tree: &mut Tree, random: &mut Random, fast: f64) {
    for link in 0..tree.links().len() {
        tree.set_joint(link, 0.5 * random.number(), fast * random.number());
    }
    let turn = rapier3d::glamx::DQuat::from_scaled_axis(random.vector());
    let base = DPose3::from_parts(random.vector(), turn);
    tree.set_base(base, random.vector() * fast, random.vector() * fast);
}
