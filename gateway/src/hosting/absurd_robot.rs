//! A robot that makes the simulator fail, for tests.

use std::path::Path;

use tandem_episodes::{DEFAULT_ROBOT, embedded_robot};

/// Writes the embedded robot with one absurd joint to `path`. The joint has no effect while the robot stands
/// still. Moving it takes a torque beyond the range of single precision.
pub fn write_absurd_robot(path: &Path) {
    let sound = embedded_robot(DEFAULT_ROBOT).unwrap();
    let elbow = sound.lines().find(|line| line.contains(r#"<position name="right_elbow_joint""#)).unwrap();
    let absurd = r#"<position name="right_elbow_joint" joint="right_elbow_joint" kp="1e38" kv="1e38" forcerange="-1e38 1e38"/>"#;
    std::fs::write(path, sound.replace(elbow, absurd)).unwrap();
}
