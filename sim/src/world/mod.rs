//! A room with objects and robots, stepped in control steps of 20 ms.

mod contacts;
mod disturb;
mod objects;
mod snapshot;
mod step;

use std::sync::Arc;

use rapier3d::math::Vector;
use rapier3d::prelude::*;

pub use objects::{ObjectModel, ObjectPlacement, ObjectState};
pub use snapshot::Snapshot;
pub use step::{HandContacts, ObjectStep, RobotStep, Step, Touch};

use crate::body::RobotModel;
use crate::mjcf::{Document, MjcfCamera};
use crate::robot::{Robot, RobotCommand, RobotPlacement};
use crate::{GRAVITY_M_S2, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, SimError, assets};
use contacts::SelfCollision;
use objects::Object;

/// Everything a world is made of.
#[derive(Clone, Debug)]
pub struct WorldSpec {
    /// Name of an embedded scene file.
    pub scene: String,
    pub robots: Vec<RobotPlacement>,
    pub objects: Vec<ObjectPlacement>,
}

/// A simulated room. One thread owns it.
pub struct World {
    pub(crate) physics: PhysicsWorld,
    hooks: SelfCollision,
    robots: Vec<Robot>,
    objects: Vec<Object>,
    /// Geoms of the scene that do not move, world frame.
    fixed: Vec<crate::mjcf::Geom>,
    cameras: Vec<MjcfCamera>,
    control_steps: u64,
    /// Forces of [`World::push`] are set.
    pushed: bool,
}

impl World {
    /// Builds the world at rest, of embedded robots; nothing has been stepped yet.
    pub fn new(spec: &WorldSpec) -> Result<World, SimError> {
        let model = RobotModel::parse("robot.xml", assets::robot(assets::DEFAULT_ROBOT)?)?;
        World::with_robot(spec, Arc::new(model))
    }

    /// As [`World::new`], of robots of another file.
    pub fn with_robot(spec: &WorldSpec, model: Arc<RobotModel>) -> Result<World, SimError> {
        let scene = Document::parse(&spec.scene, assets::scene(&spec.scene)?)?;
        let mut physics =
            PhysicsWorld { gravity: Vector::new(0.0, 0.0, -GRAVITY_M_S2), ..PhysicsWorld::new() };
        configure(&mut physics.integration_parameters);
        let (fixed, mut objects) = objects::insert_scene(&mut physics, &scene)?;
        for placement in &spec.objects {
            objects.push(objects::insert_object(&mut physics, placement)?);
        }
        let mut robots = Vec::with_capacity(spec.robots.len());
        for (index, placement) in spec.robots.iter().enumerate() {
            robots.push(Robot::spawn(&mut physics, &model, placement, index)?);
        }
        let hooks = SelfCollision::new(model);
        Ok(World {
            physics,
            hooks,
            robots,
            objects,
            fixed,
            cameras: scene.cameras,
            pushed: false,
            control_steps: 0,
        })
    }

    /// Advances by one control step, and says what it left behind. One command per robot, in the order of
    /// [`World::robots`].
    pub fn control_step(&mut self, commands: &[RobotCommand]) -> Step {
        assert_eq!(commands.len(), self.robots.len(), "one command per robot");
        for substep in 0..PHYSICS_STEPS_PER_CONTROL {
            for (robot, command) in self.robots.iter_mut().zip(commands) {
                robot.drive(&mut self.physics, command, substep);
            }
            for object in &self.objects {
                object.resist_rolling(&mut self.physics);
            }
            self.physics.step_with_events(&self.hooks, &());
        }
        self.end_pushes();
        self.control_steps += 1;
        self.present()
    }

    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// The command under which a robot stays as it was put into the world.
    pub fn rest_command(&self, robot: usize) -> RobotCommand {
        self.robots[robot].rest_command(&self.physics)
    }

    /// Geoms of the scene that do not move, world frame.
    pub fn room(&self) -> &[crate::mjcf::Geom] {
        &self.fixed
    }

    /// Cameras of the scene's file, world frame.
    pub fn cameras(&self) -> &[MjcfCamera] {
        &self.cameras
    }

    /// Every object's name and what its file says of it.
    pub fn object_models(&self) -> impl Iterator<Item = (&str, &ObjectModel)> {
        self.objects.iter().map(|object| (object.name.as_str(), &object.model))
    }
}

/// Settings measured for grasping and standing; see README's notes on physics.
fn configure(parameters: &mut IntegrationParameters) {
    parameters.dt = PHYSICS_DT_S;
    parameters.num_solver_iterations = 1;
    parameters.num_internal_pgs_iterations = 4;
    parameters.num_internal_stabilization_iterations = 1;
    parameters.contact_softness = SpringCoefficients::new(60.0, 5.0);
    parameters.static_contact_softness = SpringCoefficients::new(120.0, 5.0);
    // Recycled contacts keep stale distances: a grasp slips 1.5 mm instead of 0.07 mm.
    parameters.contact_recycling = false;
    parameters.max_ccd_substeps = 0;
    parameters.friction_model = FrictionModel::Coulomb;
}
