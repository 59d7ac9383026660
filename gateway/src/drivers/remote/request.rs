//! What a policy is asked: pictures, states and words under the keys of its map.

use std::sync::Arc;

use tandem_episodes::{
    Picture,
    players::{LocalEpisode, PlayerError},
};
use tandem_tools_spec::Observe;

use super::{
    columns::{self, state_columns},
    map::{CameraName, ImageKey, PolicyMap, PromptForm, ROBOT, Scope, Words},
    picture,
    values::{Array, Elements, RequestValue},
};

/// The instructions of a task, as policies are given them.
#[derive(Clone, Debug)]
pub struct TaskInstructions {
    /// Names of the robots, in the task's order.
    pub robots: Vec<String>,
    /// What each robot has to do.
    pub per_robot: Vec<String>,
    /// What they have to do together.
    pub joint: String,
}

/// What a policy may be shown of one moment.
pub struct PolicyObservation {
    /// One for each robot, in the task's order.
    pub robots: Vec<RobotInputs>,
    /// The room, where the policy is shown it.
    pub third_person: Option<Arc<Picture>>,
}

/// What one robot sees and senses.
pub struct RobotInputs {
    pub picture: Arc<Picture>,
    /// Numbers in the order of [`columns::state_values`].
    pub state_values: Vec<f64>,
}

/// Size of pictures that nobody has taken.
const WIDTH_PX: u32 = 320;
const HEIGHT_PX: u32 = 240;

impl PolicyObservation {
    /// Looks through all robots, and at the room where that is wanted.
    pub fn take(
        episode: &mut dyn LocalEpisode,
        third_person: bool,
    ) -> Result<PolicyObservation, PlayerError> {
        let seen = episode.observe(&Observe { robots: None, short: Some(true) })?;
        let inputs = seen.robots.iter().map(|robot| RobotInputs {
            picture: robot.view.picture.clone(),
            state_values: columns::state_values(&robot.state),
        });
        let third_person = third_person.then(|| episode.third_person().into());
        Ok(PolicyObservation { robots: inputs.collect(), third_person })
    }

    /// Black pictures and zeros, of the right sizes, to try a policy with before an episode begins.
    pub fn blank(robots: usize) -> PolicyObservation {
        let black = vec![0; (3 * WIDTH_PX * HEIGHT_PX) as usize];
        let picture = Arc::new(Picture::new(WIDTH_PX, HEIGHT_PX, black));
        let inputs = || RobotInputs { picture: picture.clone(), state_values: columns::blank_state_values() };
        PolicyObservation {
            robots: (0..robots).map(|_| inputs()).collect(),
            third_person: Some(picture.clone()),
        }
    }
}

/// The request for robot number `robot`, or for all of them.
pub fn request(
    map: &PolicyMap,
    instructions: &TaskInstructions,
    observation: &PolicyObservation,
    robot: Option<usize>,
) -> RequestValue {
    let mut request = RequestValue::Map(Vec::new());
    for (key, image) in &map.images {
        match (image.camera, &observation.third_person) {
            (CameraName::Egocentric, _) => {
                for (key, seen) in of_robots(key, map, instructions, observation, robot) {
                    request.put(&key, pixels(&seen.picture, image, map));
                }
            }
            (CameraName::ThirdPerson, Some(picture)) => request.put(key, pixels(picture, image, map)),
            // No picture was taken.
            (CameraName::ThirdPerson, None) => {}
        }
    }
    for (key, names) in &map.state {
        // The map was checked when it was read.
        let columns = state_columns(names).unwrap_or_default();
        for (key, seen) in of_robots(key, map, instructions, observation, robot) {
            let floats = columns.iter().map(|column| seen.state_values[*column] as f32).collect();
            let state = Array { shape: vec![columns.len()], elements: Elements::Floats(floats) };
            request.put(&key, RequestValue::Array(with_leading_axes(state, map)));
        }
    }
    let words = match (map.instruction, robot) {
        (Words::Robot, Some(robot)) => &instructions.per_robot[robot],
        (Words::Joint, _) | (Words::Robot, None) => &instructions.joint,
    };
    for (key, form) in &map.prompt {
        match form {
            PromptForm::Text => request.put(key, RequestValue::Text(words.clone())),
            PromptForm::List => request.put(key, RequestValue::Texts(vec![words.clone()])),
        }
    }
    request
}

/// Keys with the inputs that stand under them: those of a robot whose name is in its key, else those of the robot that the request is
/// for.
fn of_robots<'a>(
    key: &str,
    map: &PolicyMap,
    instructions: &TaskInstructions,
    observation: &'a PolicyObservation,
    robot: Option<usize>,
) -> Vec<(String, &'a RobotInputs)> {
    let named = |index: usize| (key.replace(ROBOT, &instructions.robots[index]), &observation.robots[index]);
    match (map.scope, key.contains(ROBOT)) {
        (Scope::Global, true) => (0..instructions.robots.len()).map(named).collect(),
        (Scope::Global, false) | (Scope::Local, _) => robot.map(named).into_iter().collect(),
    }
}

fn pixels(picture: &Picture, image: &ImageKey, map: &PolicyMap) -> RequestValue {
    let size_px = image.size.unwrap_or([picture.width, picture.height]);
    RequestValue::Array(with_leading_axes(picture::array(picture, size_px, image.fit, image.layout), map))
}

fn with_leading_axes(array: Array, map: &PolicyMap) -> Array {
    let leading = std::iter::repeat_n(1, map.leading_axes);
    Array { shape: leading.chain(array.shape).collect(), ..array }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instructions() -> TaskInstructions {
        let both = |texts: [&str; 2]| texts.map(String::from).to_vec();
        TaskInstructions {
            robots: both(["A", "B"]),
            per_robot: both(["give", "take"]),
            joint: "pass it on".into(),
        }
    }

    /// Keys with shapes, or texts, maps flattened.
    fn outline(request: &RequestValue) -> Vec<String> {
        match request {
            RequestValue::Map(entries) => entries
                .iter()
                .flat_map(|(key, request)| {
                    outline(request).into_iter().map(move |text| format!("{key} {text}"))
                })
                .collect(),
            RequestValue::Array(array) => vec![format!("{} {:?}", array.dtype(), array.shape)],
            RequestValue::Text(text) => vec![text.clone()],
            RequestValue::Texts(texts) => vec![format!("{texts:?}")],
        }
    }

    #[test]
    fn presets_ask_as_their_servers_expect() {
        let asked = |preset: &str| {
            let map = PolicyMap::find(preset).unwrap();
            outline(&request(&map, &instructions(), &PolicyObservation::blank(2), Some(1)))
        };
        assert_eq!(
            asked("openpi"),
            ["observation/image |u1 [224, 224, 3]", "observation/state <f4 [43]", "prompt take"]
        );
        let gr00t = asked("gr00t_n17_g1");
        assert_eq!(gr00t[0], "video.ego_view |u1 [1, 1, 240, 320, 3]");
        assert!(gr00t.contains(&"state.left_leg <f4 [1, 1, 6]".into()), "{gr00t:?}");
        assert_eq!(gr00t.last().map(String::as_str), Some("annotation.human.task_description [\"take\"]"));
    }

    #[test]
    fn a_global_policy_is_shown_every_robot() {
        let text = "preset = \"openpi\"\nscope = \"global\"\nanswer = \"all\"\n[images]\n\
            \"images > {robot}\" = { camera = \"egocentric\", size = [8, 6], layout = \"chw\" }\n\
            \"images > room\" = { camera = \"third_person\", size = [8, 6] }\n\
            [state]\n\"state_{robot}\" = [\"waist\", \"pelvis_height_m\"]\n";
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let map = PolicyMap::find(&file.path().display().to_string()).unwrap();
        assert_eq!(map.extra_information(), ["third_person"]);
        let mut observation = PolicyObservation::blank(2);
        observation.robots[1].state_values[63] = 0.7;
        let request = request(&map, &instructions(), &observation, None);
        let expected = [
            "images room |u1 [6, 8, 3]",
            "images A |u1 [3, 6, 8]",
            "images B |u1 [3, 6, 8]",
            "state_A <f4 [4]",
            "state_B <f4 [4]",
            "prompt pass it on",
        ];
        assert_eq!(outline(&request), expected);
        let RequestValue::Map(entries) = request else { panic!("no map") };
        let heights_m = entries.iter().filter_map(|(_, request)| match request {
            RequestValue::Array(Array { elements: Elements::Floats(values), .. }) => values.last().copied(),
            _ => None,
        });
        assert_eq!(heights_m.collect::<Vec<_>>(), [0.0, 0.7]);
    }
}
