//! A room with objects and robots, stepped in control steps of 20 ms.

mod contacts;
mod disturb;
mod objects;
mod snapshot;
mod step;

use std::sync::Arc;

use rapier3d::prelude::PhysicsWorld;

pub use objects::{ObjectModel, ObjectPlacement, ObjectState};
pub use snapshot::Snapshot;
pub use step::{HandContacts, ObjectStep, RobotStep, Step, Touch};

use crate::body::RobotModel;
use crate::dynamics::{DVec3, Diverged, Dynamics, Settings};
use crate::mjcf::{Document, MjcfCamera};
use crate::robot::{Robot, RobotCommand, RobotPlacement};
use crate::{GRAVITY_M_S2, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, SimError, assets};
use contacts::SelfCollision;
use disturb::Push;
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
    /// Collision detection; its bodies are where [`World::dynamics`] puts them.
    physics: PhysicsWorld,
    dynamics: Dynamics,
    hooks: SelfCollision,
    robots: Vec<Robot>,
    objects: Vec<Object>,
    /// Geoms of the scene that do not move, world frame.
    fixed: Vec<crate::mjcf::Geom>,
    cameras: Vec<MjcfCamera>,
    control_steps: u64,
    /// For the next control step.
    pushes: Vec<Push>,
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
        let gravity_m_s2 = DVec3::new(0.0, 0.0, -f64::from(GRAVITY_M_S2));
        let mut dynamics = Dynamics::new(Settings::new(f64::from(PHYSICS_DT_S), gravity_m_s2));
        let mut physics = PhysicsWorld::new();
        let (fixed, mut objects) = objects::insert_scene(&mut dynamics, &mut physics, &scene)?;
        for placement in &spec.objects {
            objects::insert_object(&mut dynamics, &mut physics, placement, &mut objects)?;
        }
        let mut robots = Vec::with_capacity(spec.robots.len());
        for (index, placement) in spec.robots.iter().enumerate() {
            robots.push(Robot::spawn(&mut dynamics, &mut physics, &model, placement, index)?);
        }
        let hooks = SelfCollision::new(model);
        Ok(World {
            physics,
            dynamics,
            hooks,
            robots,
            objects,
            fixed,
            cameras: scene.cameras,
            pushes: Vec::new(),
            control_steps: 0,
        })
    }

    /// Advances by one control step, and says what it left behind. One command per robot, in the order of
    /// [`World::robots`]. After an error the world stands where its last physics step left it, and cannot go on.
    pub fn control_step(&mut self, commands: &[RobotCommand]) -> Result<Step, Diverged> {
        assert_eq!(commands.len(), self.robots.len(), "one command per robot");
        for substep in 0..PHYSICS_STEPS_PER_CONTROL {
            self.drive(commands, substep);
            self.advance()?;
        }
        self.pushes.clear();
        self.control_steps += 1;
        Ok(self.present())
    }

    /// Sets what acts on the robots in the next physics step.
    pub(crate) fn drive(&mut self, commands: &[RobotCommand], substep: u32) {
        for (robot, command) in self.robots.iter_mut().zip(commands) {
            robot.drive(&mut self.dynamics, command, substep);
        }
        self.pushes.iter().for_each(|push| push.apply(&mut self.dynamics));
    }

    /// One physics step.
    pub(crate) fn advance(&mut self) -> Result<(), Diverged> {
        self.dynamics.step(&mut self.physics, &self.hooks)
    }

    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// The command under which a robot stays as it was put into the world.
    pub fn rest_command(&self, robot: usize) -> RobotCommand {
        self.robots[robot].rest_command(&self.dynamics)
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
