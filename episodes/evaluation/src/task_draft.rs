//! Draft of a task in an existing scene: its movable bodies, places for two robots, and a first phase.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use tandem_sim::mjcf::{AxisJoint, Document, LinkJoint, SceneBody};
use tandem_sim::{
    ObjectFile, ObjectModel, Pose, RobotModel, RobotPlacement, SceneSource, SimError, Vector, World,
    WorldSpec, assets,
};

/// Length of a trial in control steps. It is longer than any fall from a table.
const TRIAL_STEPS: u32 = 100;
/// Duration of a trial of a robot's place, in control steps. Overlapping bodies separate within this time.
const PLACE_STEPS: u32 = 15;
/// Distance within which an object counts as staying in place.
const STAYS_M: f32 = 0.03;
/// Height up to which contacts are those of feet on the floor.
const FEET_M: f32 = 0.08;
/// Maximum mass of a body that a draft asks robots to lift.
const MAX_LIFTED_KG: f32 = 4.0;
/// Distances from a body and number of headings at which a robot's place is tried, and the minimum distance
/// between the robots.
const DISTANCES_M: [f32; 5] = [0.4, 0.5, 0.65, 0.85, 1.1];
const HEADINGS: u16 = 16;
const ROBOTS_APART_M: f32 = 0.6;

/// The draft of a task in a scene.
#[derive(Debug)]
pub struct TaskDraft {
    /// A line for each body that can move.
    pub bodies: Vec<String>,
    /// The task's file.
    pub text: String,
    /// Decisions that the task's author still has to make, a line each.
    pub notes: Vec<String>,
}

#[derive(Debug, thiserror::Error)]
pub enum TaskDraftError {
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error(
        "nothing in the scene {scene} can be moved, by a joint or by hand up to {MAX_LIFTED_KG} kg, without falling by \
         itself; a task in it needs [[objects]] of its own: begin with gateway/examples/tasks/pass_the_parcel.toml{have}"
    )]
    NothingMoves { scene: String, have: String },
}

/// A body of the scene, with the properties that the draft describes.
struct Listed {
    name: String,
    kind: String,
    mass_kg: f32,
    size_m: Vector,
    middle_m: Vector,
    /// Condition of a phase about the body; `None` if the draft does not use it as an object.
    done: Option<String>,
    stays: bool,
}

/// Drafts a task with the id `id` in the scene of a file, to which the task's file refers as `scene_name`.
///
/// # Errors
///
/// Returns an error if the scene cannot be read or simulated, or if it has no movable object.
pub fn draft_task(scene: &Path, scene_name: &str, id: &str) -> Result<TaskDraft, TaskDraftError> {
    let document = Arc::new(Document::read(scene)?);
    let bodies = listed(&document)?;
    let asked = bodies.iter().filter(|body| body.done.is_some() && body.stays);
    let Some(asked) = asked.clone().find(|body| body.kind == FREE).or(asked.clone().next()) else {
        let have = bodies.iter().map(|body| format!("\n  {}", body.line())).collect();
        return Err(TaskDraftError::NothingMoves { scene: scene.display().to_string(), have });
    };
    let places = places(&document, asked.middle_m)?;
    let mut notes = Vec::new();
    if places.len() < 2 {
        notes.push("no free floor for two robots near it: write their position_m yourself".into());
    }
    Ok(TaskDraft {
        text: text(&bodies, asked, &places, scene_name, id),
        bodies: bodies.iter().map(Listed::line).collect(),
        notes,
    })
}

const FREE: &str = "free";

/// Returns the movable bodies of a scene. A trial determines whether each stays in place.
fn listed(document: &Arc<Document>) -> Result<Vec<Listed>, SimError> {
    let mut world = World::new(&spec(document, Vec::new()))?;
    let start = world.present();
    let mut end = start.clone();
    for _ in 0..TRIAL_STEPS {
        end = world.control_step(&[])?;
    }
    let stays = |name: &str| {
        let place_m =
            |step: &tandem_sim::Step| step.object(name).map(|state| state.world_from_object.translation);
        place_m(&start).zip(place_m(&end)).is_none_or(|(start, end)| (end - start).length() < STAYS_M)
    };
    let mut found = Vec::new();
    for body in document.scene_bodies()? {
        let name = body.link.name.clone();
        let file = ObjectFile::OfScene { scene: document.clone(), body: name.clone() };
        // A body without a name cannot be selected.
        let Ok(parts) = ObjectModel::parts(&file, &name) else { continue };
        let Some(part) = parts.first() else { continue };
        let reach_m = |direction| part.model.reach_m(&body.scene_from_body, direction);
        let high_m = Vector::new(reach_m(Vector::X), reach_m(Vector::Y), reach_m(Vector::Z));
        let low_m = -Vector::new(reach_m(Vector::NEG_X), reach_m(Vector::NEG_Y), reach_m(Vector::NEG_Z));
        let has_shape = (high_m - low_m).is_finite();
        let mass_kg = part.model.mass_kg;
        found.push(Listed {
            kind: kind(&body),
            done: part.model.opening.as_ref().and_then(|_| opened(&body)).or_else(|| lifted(&body, mass_kg)),
            stays: stays(&name),
            mass_kg,
            size_m: if has_shape { high_m - low_m } else { Vector::ZERO },
            middle_m: if has_shape { (high_m + low_m) * 0.5 } else { body.scene_from_body.translation },
            name,
        });
    }
    Ok(found)
}

fn kind(body: &SceneBody) -> String {
    let on = body.carrier.as_ref().map(|carrier| format!(" on {carrier}")).unwrap_or_default();
    match &body.link.joint {
        LinkJoint::Fixed => "fixed, carries others".into(),
        LinkJoint::Free { .. } => FREE.into(),
        LinkJoint::Hinge(joint) => {
            let range = joint.axis.range.map(|range| range.map(f64::to_degrees));
            let range = range.map(|[low, high]| format!(", {low:.0} to {high:.0} degrees"));
            format!("hinge{on}{}", range.unwrap_or_default())
        }
        LinkJoint::Slide(joint) => {
            let range = joint.axis.range.map(|[low, high]| format!(", {low:.2} to {high:.2} m"));
            format!("slide{on}{}", range.unwrap_or_default())
        }
    }
}

/// Returns the condition that a door or a drawer is open by half of its range.
fn opened(body: &SceneBody) -> Option<String> {
    let name = &body.link.name;
    let half = |joint: &AxisJoint| {
        let [low, high] = joint.axis.range?;
        Some(low.abs().max(high.abs()) / 2.0)
    };
    match &body.link.joint {
        LinkJoint::Hinge(joint) => {
            Some(format!("opened_deg(\"{name}\") >= {:.0}", half(joint).unwrap_or(1.0).to_degrees()))
        }
        LinkJoint::Slide(joint) => Some(format!("opened_m(\"{name}\") >= {:.3}", half(joint).unwrap_or(0.1))),
        LinkJoint::Fixed | LinkJoint::Free { .. } => None,
    }
}

fn lifted(body: &SceneBody, mass_kg: f32) -> Option<String> {
    let is_free = matches!(body.link.joint, LinkJoint::Free { .. });
    (is_free && mass_kg <= MAX_LIFTED_KG).then(|| format!("lift_m(\"{}\") >= 0.05", body.link.name))
}

impl Listed {
    fn line(&self) -> String {
        let [x_m, y_m, z_m] = self.middle_m.to_array();
        let [long_m, wide_m, high_m] = self.size_m.to_array();
        let stays = if self.stays { "" } else { "; does not stay there by itself" };
        format!(
            "{}: {}, {:.2} kg, {long_m:.2} x {wide_m:.2} x {high_m:.2} m around ({x_m:.2}, {y_m:.2}, {z_m:.2}){stays}",
            self.name, self.kind, self.mass_kg
        )
    }
}

fn spec(document: &Arc<Document>, robots: Vec<RobotPlacement>) -> WorldSpec {
    let scene = SceneSource::Read { document: document.clone(), world_from_scene: Pose::IDENTITY };
    WorldSpec { scene, robots, objects: Vec::new() }
}

/// Returns places for two robots that face a point, or fewer if there is not enough floor.
fn places(document: &Arc<Document>, around_m: Vector) -> Result<Vec<RobotPlacement>, SimError> {
    let model = Arc::new(RobotModel::parse("robot.xml", assets::robot(assets::DEFAULT_ROBOT)?)?);
    let mut found: Vec<RobotPlacement> = Vec::new();
    for name in ["A", "B"] {
        let apart = |[x_m, y_m]: [f32; 2]| {
            let near = |other: &RobotPlacement| {
                (other.position_m[0] - x_m).hypot(other.position_m[1] - y_m) < ROBOTS_APART_M
            };
            !found.iter().any(near)
        };
        let tried: Vec<RobotPlacement> =
            tried(name, around_m).filter(|place| apart(place.position_m)).collect();
        for place in tried {
            let robots: Vec<RobotPlacement> = found.iter().cloned().chain([place.clone()]).collect();
            if stands(document, &model, robots)? {
                found.push(place);
                break;
            }
        }
    }
    Ok(found)
}

/// Yields the places to try for a robot, the nearest first.
fn tried(name: &'static str, around_m: Vector) -> impl Iterator<Item = RobotPlacement> {
    DISTANCES_M.into_iter().flat_map(move |distance_m| {
        (0..HEADINGS).map(move |heading| {
            let heading_rad = std::f32::consts::TAU * f32::from(heading) / f32::from(HEADINGS);
            let rounded = |value_m: f32| (value_m * 100.0).round() / 100.0;
            let position_m = [
                rounded(around_m.x - distance_m * heading_rad.cos()),
                rounded(around_m.y - distance_m * heading_rad.sin()),
            ];
            let yaw_rad = tandem_sim::wrapped_rad(heading_rad);
            RobotPlacement { name: name.into(), position_m, yaw_rad }
        })
    })
}

/// Returns `true` if the last of these robots stands and only its feet touch anything.
fn stands(
    document: &Arc<Document>,
    model: &Arc<RobotModel>,
    robots: Vec<RobotPlacement>,
) -> Result<bool, SimError> {
    let last = robots.len() - 1;
    let mut world = World::with_robot(&spec(document, robots), model.clone())?;
    let commands: Vec<_> = (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect();
    for _ in 0..PLACE_STEPS {
        let Ok(step) = world.control_step(&commands) else { return Ok(false) };
        let presses = world.presses_of(last).into_iter().any(|press| press.at_m.z > FEET_M);
        if presses || step.robots[last].truth.fallen {
            return Ok(false);
        }
    }
    Ok(true)
}

fn text(bodies: &[Listed], asked: &Listed, places: &[RobotPlacement], scene_name: &str, id: &str) -> String {
    // Writing to a string cannot fail.
    let mut text = String::new();
    let verb = if asked.kind == FREE { "lifts" } else { "opens" };
    let goal = format!("A robot {verb} {}.", asked.name.replace('_', " "));
    let _ = write!(
        text,
        "# A draft of `tandem tasks new`: change instructions, places and phases, then `tandem tasks check` it.\n\
         id = \"{id}\"\ninstruction = \"{goal}\"\nscene = {scene_name:?}\n"
    );
    for (index, name) in ["A", "B"].into_iter().enumerate() {
        let [x_m, y_m] = places.get(index).map_or([-1.0 - index as f32, 0.0], |place| place.position_m);
        let yaw_deg = places.get(index).map_or(0.0, |place| place.yaw_rad.to_degrees());
        let _ = write!(
            text,
            "\n[[robots]]\nname = \"{name}\"\nposition_m = [{x_m:.2}, {y_m:.2}]\nyaw_deg = {yaw_deg:.1}\n\
             instruction = \"{goal}\"\n"
        );
    }
    for body in bodies {
        let line = body.line();
        let _ = match body.done.is_some() && body.stays {
            true => write!(text, "\n# {line}\n[[objects]]\nname = \"{}\"\nin_scene = true\n", body.name),
            false => write!(text, "\n# Scenery: {line}\n"),
        };
    }
    let done = asked.done.as_deref().unwrap_or_default();
    let _ = write!(text, "\n[[phases]]\nid = \"first\"\ndescription = \"{goal}\"\ndone = '{done}'\n");
    text
}
