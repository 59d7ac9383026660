//! Requests to a policy: images, states and text under the keys of its map.

mod history;
mod observation;
mod picture;

pub use history::ObservationHistory;
pub use observation::{PolicyObservation, withheld};

use tandem_episodes::{
    Picture,
    tasks::{Task, TaskWords},
};

use crate::{
    map::{CameraName, HistoryForm, ImageKey, PolicyMap, PromptForm, ROBOT, Scope, Words},
    named_columns::joined,
    values::{Array, Elements, RequestValue},
};

/// The instructions of a task, in the form for requests.
#[derive(Clone, Debug)]
pub struct TaskInstructions {
    /// The task's id.
    pub task: String,
    /// Names of the robots, in the task's order.
    pub robots: Vec<String>,
    /// Instruction of each robot.
    pub per_robot: Vec<String>,
    /// Joint instruction of all robots.
    pub joint: String,
}

impl TaskInstructions {
    /// Collects the instructions of `task`, worded as `words`.
    pub fn of(task: &Task, words: TaskWords) -> TaskInstructions {
        TaskInstructions {
            task: task.id.clone(),
            robots: task.robot_names().map(String::from).collect(),
            per_robot: words.robots,
            joint: words.joint,
        }
    }
}

/// Builds the request for the robot with the index `robot`, or for all robots if it is `None`. The
/// observations `shown` are in order, oldest first.
pub fn request(
    map: &PolicyMap,
    instructions: &TaskInstructions,
    shown: &[&PolicyObservation],
    robot: Option<usize>,
) -> RequestValue {
    let mut request = RequestValue::Map(Vec::new());
    for (key, image) in &map.images {
        match image.camera {
            CameraName::Egocentric => {
                for (key, index) in of_robots(key, map, instructions, robot) {
                    let seen = shown.iter().map(|moment| &*moment.robots[index].picture);
                    request.put(&key, over_time(seen.map(|picture| pixels(picture, image)).collect(), map));
                }
            }
            CameraName::ThirdPerson => {
                let seen: Vec<&Picture> =
                    shown.iter().filter_map(|moment| moment.third_person.as_deref()).collect();
                // Otherwise, no image was taken.
                if !seen.is_empty() {
                    let seen = seen.into_iter().map(|picture| pixels(picture, image));
                    request.put(key, over_time(seen.collect(), map));
                }
            }
        }
    }
    for (key, names) in &map.state {
        let columns = joined(names);
        for (key, index) in of_robots(key, map, instructions, robot) {
            let sensed = shown.iter().map(|moment| floats(&moment.robots[index].state_values, &columns));
            request.put(&key, over_time(sensed.collect(), map));
        }
    }
    let words = match (map.instruction, robot) {
        (Words::Robot, Some(robot)) => &instructions.per_robot[robot],
        (Words::Joint, _) | (Words::Robot, None) => &instructions.joint,
    };
    for (key, form) in &map.prompt {
        let words = RequestValue::Text(words.clone());
        match form {
            PromptForm::Text => request.put(key, words),
            PromptForm::List => request.put(key, RequestValue::List(vec![words])),
        }
    }
    request
}

/// Returns concrete keys, with the robots whose inputs they contain: the robot named in the key, or else the
/// robot of the request.
fn of_robots(
    key: &str,
    map: &PolicyMap,
    instructions: &TaskInstructions,
    robot: Option<usize>,
) -> Vec<(String, usize)> {
    let named = |index: usize| (key.replace(ROBOT, &instructions.robots[index]), index);
    match (map.scope, key.contains(ROBOT)) {
        (Scope::Global, true) => (0..instructions.robots.len()).map(named).collect(),
        (Scope::Global, false) | (Scope::Local, _) => robot.map(named).into_iter().collect(),
    }
}

fn pixels(picture: &Picture, image: &ImageKey) -> Array {
    let size_px = image.size.unwrap_or([picture.width, picture.height]);
    picture::array(picture, size_px, image.fit, image.layout)
}

fn floats(state_values: &[f64], columns: &[usize]) -> Array {
    let floats = columns.iter().map(|column| state_values[*column] as f32).collect();
    Array { shape: vec![columns.len()], elements: Elements::Floats(floats) }
}

/// Combines the arrays of all times under one key, as the map specifies.
fn over_time(moments: Vec<Array>, map: &PolicyMap) -> RequestValue {
    let with_leading_axes = |array: Array| {
        let leading = std::iter::repeat_n(1, map.leading_axes);
        RequestValue::Array(Array { shape: leading.chain(array.shape).collect(), ..array })
    };
    match map.history.map(|history| history.form) {
        Some(HistoryForm::List) => RequestValue::List(moments.into_iter().map(with_leading_axes).collect()),
        Some(HistoryForm::Stack) => with_leading_axes(Array::stack(moments)),
        // The policy gets only the present observation.
        None => moments.into_iter().next_back().map_or(RequestValue::List(Vec::new()), with_leading_axes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instructions() -> TaskInstructions {
        let both = |texts: [&str; 2]| texts.map(String::from).to_vec();
        TaskInstructions {
            task: "handover".into(),
            robots: both(["A", "B"]),
            per_robot: both(["give", "take"]),
            joint: "pass it on".into(),
        }
    }

    /// Lists keys with shapes or texts. Maps are flattened.
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
            RequestValue::List(items) => {
                vec![format!("[{}]", items.iter().flat_map(outline).collect::<Vec<_>>().join(", "))]
            }
        }
    }

    #[test]
    fn presets_ask_as_their_servers_expect() {
        let asked = |preset: &str| {
            let map = PolicyMap::find(preset).unwrap();
            outline(&request(&map, &instructions(), &[&PolicyObservation::blank(2)], Some(1)))
        };
        assert_eq!(
            asked("openpi"),
            ["observation/image |u1 [224, 224, 3]", "observation/state <f4 [43]", "prompt take"]
        );
        let xpolicylab = asked("xpolicylab");
        assert_eq!(xpolicylab[0], "vision cam_head color |u1 [240, 320, 3]");
        assert!(xpolicylab.contains(&"state left_ee_joint_state <f4 [7]".into()), "{xpolicylab:?}");
        assert_eq!(xpolicylab.last().map(String::as_str), Some("instruction take"));
        let gr00t = asked("gr00t_n17_g1");
        assert_eq!(gr00t[0], "video.ego_view |u1 [1, 1, 240, 320, 3]");
        assert!(gr00t.contains(&"state.left_leg <f4 [1, 1, 6]".into()), "{gr00t:?}");
        assert_eq!(gr00t.last().map(String::as_str), Some("annotation.human.task_description [take]"));
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
        *observation.robots[1].state_values.last_mut().unwrap() = 0.7;
        let request = request(&map, &instructions(), &[&observation], None);
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

    #[test]
    fn several_moments_are_stacked_or_listed() {
        let asked = |text: &str| {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), format!("preset = \"openpi\"\n{text}")).unwrap();
            let map = PolicyMap::find(&file.path().display().to_string()).unwrap();
            let [mut earlier, mut later] = [PolicyObservation::blank(2), PolicyObservation::blank(2)];
            (earlier.robots[0].state_values[0], later.robots[0].state_values[0]) = (0.25, 0.5);
            request(&map, &instructions(), &[&earlier, &later], Some(0))
        };
        let stacked = asked("leading_axes = 1\n[history]\nlength = 2\n");
        let expected =
            ["observation/image |u1 [1, 2, 224, 224, 3]", "observation/state <f4 [1, 2, 43]", "prompt give"];
        assert_eq!(outline(&stacked), expected);
        let RequestValue::Map(entries) = &stacked else { panic!("no map") };
        let RequestValue::Array(Array { elements: Elements::Floats(floats), .. }) = &entries[1].1 else {
            panic!("no floats")
        };
        assert_eq!((floats[0], floats[43]), (0.25, 0.5), "the oldest first");
        let listed = asked("[history]\nlength = 2\nform = \"list\"\n");
        assert_eq!(outline(&listed)[1], "observation/state [<f4 [43], <f4 [43]]");
        assert_eq!(outline(&listed)[2], "prompt give", "words have no history");
    }
}
