//! A room with objects and robots, stepped in control steps of 20 ms.

mod contacts;
mod disturb;
#[cfg(test)]
mod foot_tests;
mod ground;
mod lights;
mod objects;
mod snapshot;
mod step;
mod watch;

#[cfg(test)]
mod knowledge_tests;

use std::ops::Range;
use std::sync::Arc;

pub use contacts::RobotPress;
pub use disturb::PlannedPush;
pub use lights::{CarriedLight, SceneLights};
pub use objects::{ObjectFile, ObjectModel, ObjectPart, ObjectPlacement, ObjectState, Opening, OpeningKind};
pub use snapshot::Snapshot;
pub use step::{BodyTouch, HandContacts, ObjectStep, RobotStep, Step, Touch};
pub use watch::{
    DEEP_M, Extremes, FARTHEST_BEYOND_RAD, FASTEST_M_S, Greatest, LONGEST_DEEP_S, MAX_ENERGY_SHARE,
    MIN_SCALE_J, WINDOW_S, Watch,
};

use rapier3d::math::Pose;

use crate::body::{MotorSetpoints, RobotModel};
use crate::dynamics::{DVec3, Diverged, Dynamics, LinkId, Settings};
use crate::mechanism::{Machinery, precise};
use crate::mjcf::{Document, MjcfCamera, Texture};
use crate::robot::{Robot, RobotCommand, RobotPlacement, Sensing};
use crate::{CONTROL_HZ, GRAVITY_M_S2, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, SimError, assets};
use disturb::Push;
use lights::scene_lights;
use objects::{Furniture, Object};

/// Specification of a world.
#[derive(Clone, Debug)]
pub struct WorldSpec {
    pub scene: SceneSource,
    pub robots: Vec<RobotPlacement>,
    pub objects: Vec<ObjectPlacement>,
}

/// Source of a world's scene.
#[derive(Clone, Debug)]
pub enum SceneSource {
    /// A scene embedded in the binary, by name.
    Embedded(String),
    /// A parsed scene, and the pose of its origin.
    Read { document: Arc<Document>, world_from_scene: Pose },
}

impl From<&str> for SceneSource {
    fn from(name: &str) -> SceneSource {
        SceneSource::Embedded(name.into())
    }
}

/// Returns the gravity of a scene in the world frame.
fn gravity_m_s2(scene: &Document, world_from_scene: &Pose) -> DVec3 {
    let stated = scene.gravity_m_s2();
    if stated == USUAL_GRAVITY_M_S2 {
        return DVec3::new(0.0, 0.0, -f64::from(GRAVITY_M_S2));
    }
    precise(world_from_scene).rotation * DVec3::from_array(stated)
}

/// Default gravity of MJCF.
const USUAL_GRAVITY_M_S2: [f64; 3] = [0.0, 0.0, -9.81];

/// A simulated room. One thread owns it.
pub struct World {
    dynamics: Dynamics,
    robots: Vec<Robot>,
    objects: Vec<Object>,
    /// Drives the joints of the scene.
    machinery: Machinery,
    /// Geoms of the scene that do not move, world frame.
    fixed: Vec<crate::mjcf::Geom>,
    cameras: Vec<MjcfCamera>,
    lights: Option<SceneLights>,
    sky: Option<Arc<Texture>>,
    control_steps: u64,
    /// Pose of each robot's camera before the last control step; empty if that is not known.
    cameras_before: Vec<Pose>,
    /// Pushes of the next control step.
    pushes: Vec<Push>,
    /// Pushes of later control steps, each with its steps.
    planned_pushes: Vec<(Range<u64>, Push)>,
}

impl World {
    /// Builds the world at rest, before its first step, with the embedded robot model.
    ///
    /// # Errors
    ///
    /// Returns an error if a file of the specification cannot be used.
    pub fn new(spec: &WorldSpec) -> Result<World, SimError> {
        let model = RobotModel::parse("robot.xml", assets::robot(assets::DEFAULT_ROBOT)?)?;
        World::with_robot(spec, Arc::new(model))
    }

    /// Builds the world as [`World::new`] does, with robots of another file.
    ///
    /// # Errors
    ///
    /// Returns an error if a file of the specification cannot be used.
    pub fn with_robot(spec: &WorldSpec, model: Arc<RobotModel>) -> Result<World, SimError> {
        let mut world = match &spec.scene {
            SceneSource::Embedded(name) => {
                let document = Document::parse(name, assets::scene(name)?)?;
                World::furnished(&document, &Pose::IDENTITY, false)?
            }
            SceneSource::Read { document, world_from_scene } => {
                World::furnished(document, world_from_scene, true)?
            }
        };
        world.lay_ground();
        let dynamics = &mut world.dynamics;
        for placement in &spec.objects {
            objects::insert_object(dynamics, placement, &mut world.objects)?;
        }
        for (index, placement) in spec.robots.iter().enumerate() {
            world.robots.push(Robot::spawn(dynamics, &model, placement, index)?);
        }
        Ok(world)
    }

    /// Builds a scene with only the content of its own file. The scene begins in its key `start`. Its
    /// actuators follow the controls of that key, and the controls of each later key from that key's time on.
    ///
    /// # Errors
    ///
    /// Returns an error if the scene contains an unsupported element.
    pub fn of_scene(scene: Document) -> Result<World, SimError> {
        World::furnished(&scene, &Pose::IDENTITY, true)
    }

    /// Builds the world like [`World::of_scene`], with the scene's own origin at `world_from_scene`. If
    /// `may_sleep` is true, free bodies sleep while they rest far from all other bodies.
    fn furnished(scene: &Document, world_from_scene: &Pose, may_sleep: bool) -> Result<World, SimError> {
        let gravity_m_s2 = gravity_m_s2(scene, world_from_scene);
        let mut dynamics = Dynamics::new(Settings::new(f64::from(PHYSICS_DT_S), gravity_m_s2));
        let Furniture { fixed, objects, machinery } =
            objects::insert_scene(&mut dynamics, scene, world_from_scene, may_sleep)?;
        Ok(World {
            dynamics,
            robots: Vec::new(),
            objects,
            machinery,
            fixed,
            cameras: scene.cameras.iter().map(|camera| camera.moved(world_from_scene)).collect(),
            lights: scene_lights(scene, world_from_scene)?,
            sky: scene.sky().cloned(),
            pushes: Vec::new(),
            planned_pushes: Vec::new(),
            control_steps: 0,
            cameras_before: Vec::new(),
        })
    }

    /// Advances by one control step and returns the resulting state. There must be one command per
    /// robot, in the order of [`World::robots`].
    ///
    /// # Errors
    ///
    /// Returns [`Diverged`] if physics diverged. The world is then in the state after its last valid
    /// physics step, and cannot go on.
    ///
    /// # Panics
    ///
    /// Panics if the number of commands differs from the number of robots.
    pub fn control_step(&mut self, commands: &[RobotCommand]) -> Result<Step, Diverged> {
        self.step_by(commands, World::advance)
    }

    /// Runs one control step, in which `advance` makes each physics step.
    fn step_by(
        &mut self,
        commands: &[RobotCommand],
        mut advance: impl FnMut(&mut World) -> Result<(), Diverged>,
    ) -> Result<Step, Diverged> {
        assert_eq!(commands.len(), self.robots.len(), "one command per robot");
        self.cameras_before =
            self.robots.iter().map(|robot| robot.world_from_camera(&self.dynamics)).collect();
        for substep in 0..PHYSICS_STEPS_PER_CONTROL {
            self.drive(commands, substep);
            advance(self)?;
            self.sense();
        }
        self.pushes.clear();
        self.robots.iter_mut().for_each(Robot::end_step);
        self.control_steps += 1;
        Ok(self.present())
    }

    /// Drives every joint of a robot by `setpoints` in the next control step: one for each physics step, or
    /// one for all of them. The robot's command is then only recorded. The base controller is reset, no
    /// torque is added against gravity, and a fallen robot is driven, too.
    ///
    /// # Panics
    ///
    /// Panics if there is no such robot, or if the number of setpoints is neither 1 nor the number of physics
    /// steps in a control step.
    pub fn drive_motors(&mut self, robot: usize, setpoints: &[MotorSetpoints]) {
        self.robots[robot].set_motors(setpoints);
    }

    /// Sets the drives and forces on the robots and the scene's joints for physics step `substep` of a
    /// control step. A [`World::control_step`] repeats this, [`World::advance`] and [`World::sense`].
    pub fn drive(&mut self, commands: &[RobotCommand], substep: u32) {
        for (robot, command) in self.robots.iter_mut().zip(commands) {
            robot.drive(&mut self.dynamics, command, substep);
        }
        self.machinery.drive(&mut self.dynamics, self.control_steps as f64 / CONTROL_HZ);
        let planned = self.planned_pushes.iter().filter(|(steps, _)| steps.contains(&self.control_steps));
        let pushes = self.pushes.iter().chain(planned.map(|(_, push)| push));
        pushes.for_each(|push| push.apply(&mut self.dynamics));
    }

    /// Runs one physics step.
    ///
    /// # Errors
    ///
    /// Returns an error if physics diverges.
    pub fn advance(&mut self) -> Result<(), Diverged> {
        self.dynamics.step()
    }

    /// Reads the sensors of all robots.
    pub fn sense(&mut self) {
        self.robots.iter_mut().for_each(|robot| robot.sense(&self.dynamics));
    }

    /// Replaces the sensors of all robots, whose noise `seed` determines, and their state estimates. The
    /// estimates assume that the robots have stood still until now.
    pub fn set_sensing(&mut self, sensing: Sensing, seed: u32) {
        for (index, robot) in self.robots.iter_mut().enumerate() {
            let told = robot.truth(&self.dynamics).world_from_pelvis();
            robot.set_sensing(&self.dynamics, &told, sensing, u64::from(seed) << 32 | index as u64);
        }
    }

    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// Returns the command that keeps a robot in its present state, by its own readings.
    pub fn rest_command(&self, robot: usize) -> RobotCommand {
        self.robots[robot].rest_command()
    }

    /// Returns the geoms of the scene that do not move, world frame.
    pub fn room(&self) -> &[crate::mjcf::Geom] {
        &self.fixed
    }

    /// Returns the cameras of the scene's file, world frame.
    pub fn cameras(&self) -> &[MjcfCamera] {
        &self.cameras
    }

    /// Returns the lights of the scene's file; `None` if it states none.
    pub fn lights(&self) -> Option<&SceneLights> {
        self.lights.as_ref()
    }

    /// Returns the sky of the scene's file: a single image, or the six of a cube around the camera.
    pub fn sky(&self) -> Option<&Arc<Texture>> {
        self.sky.as_ref()
    }

    /// Returns the position of an object's hinge (rad) or slide (m), by the joint's name in the file. The
    /// first joint of that name counts. Returns `None` if there is none.
    pub fn joint_position(&self, joint: &str) -> Option<f64> {
        let link = self.link_of(|object| object.joint.as_deref() == Some(joint))?;
        Some(self.dynamics.tree(link.tree).joint_position(link.link))
    }

    /// Returns the link of the first object that satisfies the predicate. Returns `None` if there is
    /// none or it does not move.
    fn link_of(&self, is: impl Fn(&Object) -> bool) -> Option<LinkId> {
        self.objects.iter().find(|object| is(object))?.link
    }

    /// Returns every object's name and the model from its file.
    pub fn object_models(&self) -> impl Iterator<Item = (&str, &ObjectModel)> {
        self.objects.iter().map(|object| (object.name.as_str(), &object.model))
    }
}
