//! Validation of a map. Errors advise on correct values.

use std::collections::BTreeSet;

use tandem_episodes::{rows::velocities, tasks};

use super::{AnswerScope, CameraName, HistorySpan, PolicyMap, ROBOT, Scope, WristFrame};
use crate::{
    columns::{
        WRISTS, action_name, is_of_arm_or_waist, motor_blocks, motors, wrist_named, wrist_position,
        wrist_rotation,
    },
    named_columns::NamedColumns,
    poses::RotationForm,
    values::path,
};

/// Maximum side of an image for a policy.
const LONGEST_SIDE_PX: u32 = 4096;
/// Range of row rates. A row of wrist poses is one command, which has at most 25 control steps (half a
/// second).
const RATES_HZ: [f64; 2] = [2.0, 1000.0];
const LONGEST_HISTORY: usize = 32;
/// Maximum number of rows in an answer: more than three minutes at 50 rows per second.
const MAX_ROWS: usize = 10_000;
const MAX_LEADING_AXES: usize = 8;
/// Maximum time to wait for a policy, in seconds: one day.
const LONGEST_S: f64 = 86400.0;
const SHORTEST_REPLY_S: f64 = 0.001;

impl PolicyMap {
    /// Checks that the map can be used.
    pub(super) fn check(&self) -> Result<(), String> {
        let state = self.state.iter().map(|(key, names)| ("state", key, names.is_empty()));
        let action = self.action.iter().map(|(key, names)| ("action", key, names.is_empty()));
        if let Some((table, key, _)) = state.chain(action).find(|(_, _, is_empty)| *is_empty) {
            return Err(format!("[{table}] has no column under {key:?}; name some, or leave the key out"));
        }
        let told = self.check_action()?;
        self.check_wrists(&told)?;
        self.check_motors(&told)?;
        self.check_delta(&told)?;
        let wrong = |size: &[u32; 2]| !size.iter().all(|side| (1..=LONGEST_SIDE_PX).contains(side));
        if let Some((key, _)) = self.images.iter().find(|(_, image)| image.size.as_ref().is_some_and(wrong)) {
            return Err(format!("the size of {key:?}: give two numbers from 1 to {LONGEST_SIDE_PX}"));
        }
        for (name, value_s, least_s) in
            [("connect_s", self.connect_s, 0.0), ("reply_s", self.reply_s, SHORTEST_REPLY_S)]
        {
            if !(least_s..=LONGEST_S).contains(&value_s) {
                return Err(format!("{name} is {value_s}; give seconds, from {least_s} to {LONGEST_S}"));
            }
        }
        if self.leading_axes > MAX_LEADING_AXES {
            let given = self.leading_axes;
            return Err(format!("leading_axes is {given}; give {MAX_LEADING_AXES} at most"));
        }
        self.check_chunk()?;
        self.history.as_ref().map_or(Ok(()), check_history)?;
        self.check_keys()?;
        let sent = self.images.keys().chain(self.state.keys()).chain(self.prompt.keys());
        check_paths(&sent.collect::<Vec<_>>())?;
        check_paths(&self.action.keys().collect::<Vec<_>>())
    }

    /// Returns the columns that the policy commands. Returns an error if a column has two keys.
    fn check_action(&self) -> Result<Vec<usize>, String> {
        let told = self.told_columns();
        if told.is_empty() {
            return Err("[action] tells no column".into());
        }
        match (0..told.len()).find(|index| told[..*index].contains(&told[*index])) {
            None => Ok(told),
            Some(index) => Err(format!("{:?} is told twice", action_name(told[index]))),
        }
    }

    /// Returns an error if arms or waist are commanded together with wrist poses, because inverse kinematics
    /// then controls them. Also rejects two forms of a wrist's rotation.
    fn check_wrists(&self, told: &[usize]) -> Result<(), String> {
        for (side, wrist) in WRISTS.iter().enumerate() {
            let forms = RotationForm::ALL.into_iter().map(|form| wrist_rotation(side, form).start);
            if forms.filter(|start| told.contains(start)).count() > 1 {
                return Err(format!("the rotation of {wrist} is told twice; give one form of it"));
            }
        }
        let wrists = self.told_wrists(told);
        let frame = self.chunk.wrist_frame;
        match wrists.first() {
            None if frame != WristFrame::Pelvis => {
                Err("[chunk] wrist_frame is for poses of wrists, and [action] has none".into())
            }
            None => Ok(()),
            Some(wrist) => match told.iter().find(|column| is_of_arm_or_waist(**column)) {
                Some(column) => Err(format!(
                    "[action] tells {wrist:?} and {:?}; arms and waist follow the wrists by inverse kinematics, so give \
                     one or the other",
                    action_name(*column)
                )),
                None => Ok(()),
            },
        }
    }

    /// Returns an error if motor setpoints lack gains, or are combined with commands for the robot's
    /// controller.
    fn check_motors(&self, told: &[usize]) -> Result<(), String> {
        let Some(other) = told.iter().find(|column| !motors().contains(column)) else {
            let needed = ["motor_position", "motor_kp", "motor_kd"];
            let lacking = motor_blocks().find(|(name, columns)| {
                needed.contains(&name.as_str()) && columns.clone().any(|column| !told.contains(&column))
            });
            return match lacking {
                Some((name, _)) => Err(format!(
                    "[action] drives motors and does not tell {name:?}; give motors, or every block"
                )),
                None if !self.chunk.delta.is_empty() => {
                    Err("[chunk] delta: setpoints of motors are told as they are to be; leave delta out"
                        .into())
                }
                None => Ok(()),
            };
        };
        match told.iter().find(|column| motors().contains(column)) {
            Some(motor) => Err(format!(
                "[action] tells {:?} and {:?}; who drives motors drives all of them, so give one or the other",
                action_name(*motor),
                action_name(*other)
            )),
            None => Ok(()),
        }
    }

    fn told_wrists(&self, told: &[usize]) -> Vec<&'static str> {
        let is_told = |side: usize| {
            let rotations = RotationForm::ALL.into_iter().map(|form| wrist_rotation(side, form).start);
            rotations.chain([wrist_position(side).start]).any(|start| told.contains(&start))
        };
        WRISTS.into_iter().enumerate().filter(|(side, _)| is_told(*side)).map(|(_, wrist)| wrist).collect()
    }

    /// Checks that differences are used only for positions that the policy commands.
    fn check_delta(&self, told: &[usize]) -> Result<(), String> {
        let wrists = self.told_wrists(told);
        for NamedColumns { name, columns, .. } in &self.chunk.delta {
            if let Some(wrist) = wrist_named(name).map(|side| WRISTS[side]) {
                match (name == wrist, wrists.contains(&wrist)) {
                    (false, _) => {
                        return Err(format!("[chunk] delta: {name:?}; give the whole pose, {wrist:?}"));
                    }
                    (true, false) => return Err(format!("[chunk] delta: [action] does not tell {name:?}")),
                    (true, true) => continue,
                }
            }
            for column in columns.clone() {
                let column_name = action_name(column);
                if velocities().contains(&column) {
                    return Err(format!(
                        "[chunk] delta: {column_name:?} is a velocity, which is always told as it is to be; give joints, \
                         pelvis_height_m or wrists"
                    ));
                }
                if !told.contains(&column) {
                    return Err(format!("[chunk] delta: [action] does not tell {column_name:?}"));
                }
            }
        }
        let delta = self.delta();
        let whole = |(side, wrist): (usize, &&str)| !wrists.contains(wrist) || delta.wrists[side];
        match self.chunk.wrist_frame == WristFrame::Wrist && !WRISTS.iter().enumerate().all(whole) {
            true => Err(format!(
                "[chunk] wrist_frame = \"wrist\" tells where a wrist goes from where it was observed; give delta = {wrists:?} \
                 as well, or another frame"
            )),
            false => Ok(()),
        }
    }

    fn check_chunk(&self) -> Result<(), String> {
        let chunk = &self.chunk;
        for (name, count) in [("rows", chunk.rows), ("execute", chunk.execute)] {
            match count {
                Some(0) => return Err(format!("[chunk] {name} is 0; a chunk has at least one row")),
                Some(count) if count > MAX_ROWS => {
                    return Err(format!("[chunk] {name} is {count}; give {MAX_ROWS} at most"));
                }
                _ => {}
            }
        }
        if let (Some(rows), Some(execute)) = (chunk.rows, chunk.execute)
            && execute > rows
        {
            return Err(format!(
                "[chunk] execute is {execute} and rows is {rows}; no more rows can be executed than there are: give execute at \
                 most {rows}, or leave it out for all"
            ));
        }
        let [least_hz, most_hz] = RATES_HZ;
        match chunk.rate_hz {
            Some(rate_hz) if !(least_hz..=most_hz).contains(&rate_hz) => {
                Err(format!("[chunk] rate_hz is {rate_hz}; give rows a second, from {least_hz} to {most_hz}"))
            }
            _ => Ok(()),
        }
    }

    /// Checks that keys name every robot if one answer is for all robots.
    fn check_keys(&self) -> Result<(), String> {
        if self.answer == AnswerScope::One {
            return Ok(());
        }
        let egocentric = self.images.iter().filter(|(_, image)| image.camera == CameraName::Egocentric);
        let mut own = egocentric.map(|(key, _)| key).chain(self.state.keys());
        match (self.scope, own.find(|key| !key.contains(ROBOT))) {
            (Scope::Local, _) => Err("answer = \"all\" needs scope = \"global\"".into()),
            (Scope::Global, Some(key)) => Err(format!(
                "answer = \"all\" asks for no robot in particular; put {ROBOT} into the key {key:?}"
            )),
            (Scope::Global, None) => Ok(()),
        }
    }
}

/// Checks that, for every robot, no key leads to the same place as another key or through it.
fn check_paths(keys: &[&String]) -> Result<(), String> {
    let robots: BTreeSet<&str> =
        tasks::cohub().iter().flat_map(|task| &task.robots).map(|robot| robot.name).collect();
    let paths = |key: &str| -> Vec<Vec<String>> {
        let path = |key: &str| path(key).map(String::from).collect();
        robots.iter().map(|robot| path(&key.replace(ROBOT, robot))).collect()
    };
    for (place, key) in keys.iter().enumerate() {
        let own = paths(key);
        for other in &keys[place + 1..] {
            let meet = |others: &Vec<String>| {
                own.iter().any(|own| own.starts_with(others) || others.starts_with(own))
            };
            if paths(other).iter().any(meet) {
                return Err(format!(
                    "the keys {key:?} and {other:?}: one leads to the other, or both to the same place; give each a place of its own"
                ));
            }
        }
    }
    Ok(())
}

fn check_history(history: &HistorySpan) -> Result<(), String> {
    match (history.length, history.stride) {
        (2..=LONGEST_HISTORY, 1..=MAX_ROWS) => Ok(()),
        (_, stride) if stride > MAX_ROWS => {
            Err(format!("[history] stride is {stride}; give {MAX_ROWS} at most"))
        }
        (_, 0) => {
            Err("[history] stride is 0; give how many rows are executed between two observations".into())
        }
        (length, _) => Err(format!(
            "[history] length is {length}; give 2 to {LONGEST_HISTORY}, or leave [history] out for the present alone"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::tests::read;

    fn check(text: &str, says: &str) {
        let told = read(&format!("preset = \"openpi\"\n{text}")).unwrap_err().to_string();
        assert!(told.contains(says), "{told}");
    }

    #[test]
    fn what_is_wrong_with_a_map_is_said() {
        check("[state]\n\"s\" = [\"left_foot\"]", "no column \"left_foot\"; have: left_leg");
        check(
            "[action]\n\"a\" = [\"waist\"]\n\"b\" = [\"waist_yaw_joint\"]",
            "\"waist_yaw_joint\" is told twice",
        );
        check("[action]", "tells no column");
        check("[action]\n\"a\" = [\"row\"]\n\"b\" = []", "[action] has no column under \"b\"");
        check("[state]\n\"s\" = []", "[state] has no column under \"s\"");
        check("[chunk]\nrows = 0", "rows is 0");
        check(
            "[chunk]\nrows = 50\nexecute = 60",
            "execute is 60 and rows is 50; no more rows can be executed",
        );
        check("reply_s = nan", "reply_s is NaN");
        check("reply_s = 0", "reply_s is 0; give seconds, from 0.001 to 86400");
        check("connect_s = -1", "connect_s is -1; give seconds, from 0 to 86400");
        check("[chunk]\nrows = 9223372036854775807", "rows is 9223372036854775807; give 10000 at most");
        check("[chunk]\nexecute = 10001", "execute is 10001; give 10000 at most");
        check("leading_axes = 9223372036854775807", "leading_axes is 9223372036854775807; give 8 at most");
        check("answer = \"all\"", "needs scope = \"global\"");
        check("answer = \"all\"\nscope = \"global\"", "put {robot} into the key \"observation/image\"");
        check("scop = \"global\"", "unknown field `scop`");
        check("[images]\n\"i\" = { camera = \"egocentric\", size = [0, 9] }", "from 1 to 4096");
        assert!(
            read("preset = \"opempi\"")
                .unwrap_err()
                .to_string()
                .contains("have: openpi, xpolicylab, gr00t_n17_g1")
        );
        let text = PolicyMap::find("opempi").unwrap_err().to_string();
        assert!(
            text.starts_with("no policy map \"opempi\"") && text.contains("openpi, xpolicylab, gr00t_n17_g1"),
            "{text}"
        );
    }

    #[test]
    fn keys_that_meet_are_refused() {
        let state =
            |keys: [&str; 2]| format!("[state]\n{:?} = [\"waist\"]\n{:?} = [\"left_arm\"]", keys[0], keys[1]);
        check(&state(["obs", "obs > left"]), "the keys \"obs\" and \"obs > left\": one leads to the other");
        check(&state(["obs > left", "obs>left"]), "or both to the same place");
        check(&state(["prompt > left", "obs"]), "the keys \"prompt > left\" and \"prompt\"");
        check(&format!("scope = \"global\"\n{}", state(["B > s", "{robot}"])), "\"B > s\" and \"{robot}\"");
        check("[action]\n\"\" = [\"waist\"]\n\"a\" = [\"left_arm\"]", "the keys \"\" and \"a\"");
        read(&format!("preset = \"openpi\"\n{}", state(["obs > left", "obs > leftmost"]))).unwrap();
    }

    #[test]
    fn what_is_wrong_with_rates_and_histories_is_said() {
        check("[chunk]\nrate_hz = 0.5", "rate_hz is 0.5; give rows a second, from 2 to 1000");
        check("[chunk]\nrate_hz = nan", "rate_hz is NaN");
        check("[chunk]\nbetween = \"jump\"", "unknown variant `jump`, expected `interpolate` or `hold`");
        check("[history]\nlength = 1", "length is 1; give 2 to 32");
        check("[history]\nlength = 2\nstride = 0", "stride is 0");
        check(
            "[history]\nlength = 32\nstride = 9223372036854775807",
            "stride is 9223372036854775807; give 10000",
        );
        let map = read("preset = \"openpi\"\n[history]\nlength = 2\n[chunk]\nrate_hz = 15").unwrap();
        assert_eq!((map.rate_hz(), map.history.unwrap().stride), (15.0, 1));
    }

    #[test]
    fn what_is_wrong_with_wrists_and_deltas_is_said() {
        let wrists = "[action]\n\"a\" = [\"left_wrist_position\", \"left_wrist_rows_6d\", \"right_wrist\", \"vx_m_s\"]\n[chunk]\n";
        let says = |chunk: &str, says: &str| check(&format!("{wrists}{chunk}"), says);
        says("delta = [\"right_wrist_position\"]", "give the whole pose, \"right_wrist\"");
        says("delta = [\"vx_m_s\"]", "\"vx_m_s\" is a velocity");
        says("delta = [\"left_hand\"]", "does not tell \"left_hand_thumb_0_joint\"");
        says("delta = [\"left_foot\"]", "no column \"left_foot\"");
        says("wrist_frame = \"wrist\"", "give delta = [\"left_wrist\", \"right_wrist\"] as well");
        says("wrist_frame = \"wrist\"\ndelta = [\"left_wrist\"]", "as well");
        says("wrist_frame = \"world\"", "expected one of `pelvis`, `start`, `wrist`");
        check("[chunk]\nwrist_frame = \"start\"", "wrist_frame is for poses of wrists");
        check("[chunk]\ndelta = [\"left_wrist\"]", "[action] does not tell \"left_wrist\"");
        check(
            "[action]\n\"a\" = [\"left_wrist\", \"waist\"]",
            "tells \"left_wrist\" and \"waist_yaw_joint\"; arms and waist follow the wrists",
        );
        check(
            "[action]\n\"a\" = [\"left_wrist\", \"left_wrist_rows_6d\"]",
            "the rotation of left_wrist is told twice",
        );
        let joint =
            "[action]\n\"a\" = [\"left_wrist_yaw_joint\"]\n[chunk]\ndelta = [\"left_wrist_yaw_joint\"]";
        let map = read(&format!("preset = \"openpi\"\n{joint}")).unwrap();
        assert_eq!((map.delta().wrists, map.delta().row_columns), ([false, false], vec![6]));
        let map = read(&format!("preset = \"openpi\"\n{wrists}delta = [\"left_wrist\"]\n")).unwrap();
        assert_eq!((map.delta().wrists, map.delta().row_columns), ([true, false], vec![]));
    }
}
