//! What a policy is asked: pictures, states and words under the keys of its map.

use super::{
    columns::state_columns,
    map::{CameraName, ImageKey, PolicyMap, PromptForm, ROBOT, Scope, Words},
    picture,
    sight::{Seen, Sight},
    values::{Array, Elements, Sent},
};

/// What is known of the task and its robots.
#[derive(Clone, Debug)]
pub struct Cast {
    pub names: Vec<String>,
    /// What each robot has to do.
    pub instructions: Vec<String>,
    /// What they have to do together.
    pub joint_instruction: String,
}

/// The request for robot number `robot`, or for all of them.
pub fn request(map: &PolicyMap, cast: &Cast, sight: &Sight, robot: Option<usize>) -> Sent {
    let mut sent = Sent::Map(Vec::new());
    for (key, image) in &map.images {
        match (image.camera, &sight.third_person) {
            (CameraName::Egocentric, _) => {
                for (key, seen) in of_robots(key, map, cast, sight, robot) {
                    sent.put(&key, pixels(&seen.picture, image, map));
                }
            }
            (CameraName::ThirdPerson, Some(picture)) => sent.put(key, pixels(picture, image, map)),
            // Nobody looked.
            (CameraName::ThirdPerson, None) => {}
        }
    }
    for (key, names) in &map.state {
        // The map was checked when it was read.
        let columns = state_columns(names).unwrap_or_default();
        for (key, seen) in of_robots(key, map, cast, sight, robot) {
            let floats = columns.iter().map(|column| seen.felt_values[*column] as f32).collect();
            let state = Array { shape: vec![columns.len()], elements: Elements::Floats(floats) };
            sent.put(&key, Sent::Array(with_leading_axes(state, map)));
        }
    }
    let words = match (map.instruction, robot) {
        (Words::Robot, Some(robot)) => &cast.instructions[robot],
        (Words::Joint, _) | (Words::Robot, None) => &cast.joint_instruction,
    };
    for (key, form) in &map.prompt {
        match form {
            PromptForm::Text => sent.put(key, Sent::Text(words.clone())),
            PromptForm::List => sent.put(key, Sent::Texts(vec![words.clone()])),
        }
    }
    sent
}

/// What stands under `key` and of whom: under a key with a robot's name in it of that robot, else of the one that is asked for.
fn of_robots<'a>(
    key: &str,
    map: &PolicyMap,
    cast: &Cast,
    sight: &'a Sight,
    robot: Option<usize>,
) -> Vec<(String, &'a Seen)> {
    let named = |index: usize| (key.replace(ROBOT, &cast.names[index]), &sight.robots[index]);
    match (map.scope, key.contains(ROBOT)) {
        (Scope::Global, true) => (0..cast.names.len()).map(named).collect(),
        (Scope::Global, false) | (Scope::Local, _) => robot.map(named).into_iter().collect(),
    }
}

fn pixels(picture: &image::RgbImage, image: &ImageKey, map: &PolicyMap) -> Sent {
    let size_px = image.size.unwrap_or([picture.width(), picture.height()]);
    let fitted = picture::fitted(picture, size_px, image.fit);
    Sent::Array(with_leading_axes(picture::array(&fitted, image.layout), map))
}

fn with_leading_axes(array: Array, map: &PolicyMap) -> Array {
    let leading = std::iter::repeat_n(1, map.leading_axes);
    Array { shape: leading.chain(array.shape).collect(), ..array }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cast() -> Cast {
        let both = |texts: [&str; 2]| texts.map(String::from).to_vec();
        Cast {
            names: both(["A", "B"]),
            instructions: both(["give", "take"]),
            joint_instruction: "pass it on".into(),
        }
    }

    /// Keys with shapes, or texts, maps flattened.
    fn outline(sent: &Sent) -> Vec<String> {
        match sent {
            Sent::Map(entries) => entries
                .iter()
                .flat_map(|(key, sent)| outline(sent).into_iter().map(move |text| format!("{key} {text}")))
                .collect(),
            Sent::Array(array) => vec![format!("{} {:?}", array.dtype(), array.shape)],
            Sent::Text(text) => vec![text.clone()],
            Sent::Texts(texts) => vec![format!("{texts:?}")],
        }
    }

    #[test]
    fn presets_ask_as_their_servers_expect() {
        let asked = |preset: &str| {
            let map = PolicyMap::find(preset).unwrap();
            outline(&request(&map, &cast(), &Sight::blank(2), Some(1)))
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
            [state]\n\"state_{robot}\" = [\"waist\", \"pelvis_height\"]\n";
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let map = PolicyMap::find(&file.path().display().to_string()).unwrap();
        assert_eq!(map.extra_information(), ["third_person"]);
        let mut sight = Sight::blank(2);
        sight.robots[1].felt_values[63] = 0.7;
        let sent = request(&map, &cast(), &sight, None);
        let expected = [
            "images room |u1 [6, 8, 3]",
            "images A |u1 [3, 6, 8]",
            "images B |u1 [3, 6, 8]",
            "state_A <f4 [4]",
            "state_B <f4 [4]",
            "prompt pass it on",
        ];
        assert_eq!(outline(&sent), expected);
        let Sent::Map(entries) = sent else { panic!("no map") };
        let heights_m = entries.iter().filter_map(|(_, sent)| match sent {
            Sent::Array(Array { elements: Elements::Floats(values), .. }) => values.last().copied(),
            _ => None,
        });
        assert_eq!(heights_m.collect::<Vec<_>>(), [0.0, 0.7]);
    }
}
