//! Keys of a file: each is a state, with the actuators' controls and a time.

use super::{Document, LinkJoint};
use crate::SimError;

/// MJCF's `<key>`. Parts that the file leaves out are empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    pub name: String,
    pub time_s: f64,
    /// The coordinates of all joints, in the order of [`Document::trees`]; see [`LinkJoint::coordinates`].
    pub positions: Vec<f64>,
    /// One number per degree of freedom. A free joint has its velocity in world axes and its angular velocity
    /// in body axes.
    pub velocities: Vec<f64>,
    /// Controls of the actuators, in the order of [`Document::actuators`].
    pub controls: Vec<f64>,
}

impl Document {
    pub fn keys(&self) -> Result<Vec<Key>, SimError> {
        let joints = (0..self.model.bodies.len()).map(|body| self.joint(body));
        let joints = joints.collect::<Result<Vec<_>, _>>()?;
        let coordinates: usize = joints.iter().map(LinkJoint::coordinates).sum();
        let freedoms = joints.iter().map(LinkJoint::freedoms).sum();
        let read = |key: &mjcf_rs::extras::Keyframe| {
            let name = key.name.clone().unwrap_or_default();
            let numbers = |what: &str, numbers: &[f64], expected: usize| match numbers.len() {
                0 => Ok(Vec::new()),
                have if have == expected => Ok(numbers.to_vec()),
                have => Err(self
                    .unsupported(format!("key `{name}` has {have} numbers in {what}; it takes {expected}"))),
            };
            // MuJoCo has a quaternion for a ball joint; here it has three angles. A file with ball joints
            // therefore starts with its bodies as placed.
            let has_ball = self.split.ball.is_some();
            let positions = if has_ball { Vec::new() } else { numbers("qpos", &key.qpos, coordinates)? };
            let mut rest = positions.as_slice();
            for joint in joints.iter().filter(|_| !positions.is_empty()) {
                let (own, others) = rest.split_at(joint.coordinates());
                rest = others;
                if own.len() == 7 && own[3..].iter().all(|part| *part == 0.0) {
                    let body = joint.name().unwrap_or_default();
                    let what =
                        format!("key `{name}`: the quaternion of free joint `{body}` is 0 0 0 0 in qpos");
                    return Err(self.unsupported(what));
                }
            }
            let placed_at = joints.iter().flat_map(|joint| match joint {
                LinkJoint::Hinge(axis) | LinkJoint::Slide(axis) => vec![axis.placed_at],
                LinkJoint::Fixed | LinkJoint::Free { .. } => vec![0.0; joint.coordinates()],
            });
            let positions = positions.iter().zip(placed_at).map(|(own, placed_at)| own - placed_at).collect();
            Ok(Key {
                time_s: key.time,
                positions,
                velocities: numbers("qvel", &key.qvel, freedoms)?,
                controls: numbers("ctrl", &key.ctrl, self.model.actuators.len())?,
                name,
            })
        };
        self.model.keyframes.iter().map(read).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(key: &str) -> Result<Vec<Key>, SimError> {
        let xml = format!(
            r#"<mujoco><worldbody>
                <body name="door"><joint name="hinge" type="hinge"/><geom size="0.1"/></body>
                <body name="ball"><freejoint/><geom size="0.1"/></body>
            </worldbody>
            <actuator><motor joint="hinge"/></actuator>
            <keyframe>{key}</keyframe></mujoco>"#
        );
        Document::parse("room.xml", &xml).expect("valid MJCF").keys()
    }

    #[test]
    fn keys_are_read() {
        let found = keys(r#"<key name="start" qpos="0.5  1 2 3 1 0 0 0" ctrl="2"/><key time="0.5"/>"#);
        let start = Key {
            name: "start".into(),
            time_s: 0.0,
            positions: vec![0.5, 1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0],
            velocities: vec![],
            controls: vec![2.0],
        };
        let later =
            Key { name: String::new(), time_s: 0.5, positions: vec![], controls: vec![], ..start.clone() };
        assert_eq!(found.expect("valid keys"), [start, later]);
    }

    #[test]
    fn keys_of_other_bodies_are_refused() {
        for (key, expected) in [
            (r#"<key name="start" qpos="1"/>"#, "key `start` has 1 numbers in qpos; it takes 8"),
            (r#"<key name="start" qvel="1"/>"#, "key `start` has 1 numbers in qvel; it takes 7"),
            (r#"<key name="start" ctrl="1 2"/>"#, "key `start` has 2 numbers in ctrl; it takes 1"),
        ] {
            let error = keys(key).expect_err(key).to_string();
            assert_eq!(error, format!("`room.xml`: {expected}"));
        }
    }
}
