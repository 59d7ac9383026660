//! Prints the poses of all named frames of a robot for each line of joint coordinates on standard input.
//!
//! `link_poses ROBOT.xml` first prints the joints' names, in the order of the expected coordinates. Each
//! input line is a JSON list of coordinates (rad or m). Each output line maps names to
//! `[x, y, z, qw, qx, qy, qz]` in the root's frame, and `center_of_mass` to `[x, y, z]`. Other programs
//! use it to check their kinematics against this crate.

use std::{env, error::Error, fs, io};

use serde_json::{Map, json};
use tandem_ik::{Configuration, Model};

fn main() -> Result<(), Box<dyn Error>> {
    let robot = env::args().nth(1).ok_or("one argument expected: ROBOT.xml")?;
    let model = Model::from_mjcf(&fs::read_to_string(robot)?)?;
    println!("{}", json!(model.joints().iter().map(|joint| &joint.name).collect::<Vec<_>>()));
    for line in io::stdin().lines() {
        let q: Vec<f64> = serde_json::from_str(&line?)?;
        let configuration = Configuration::new(&model, &q)?;
        let mut poses = Map::new();
        for frame in model.frames().iter().filter(|frame| !frame.name.is_empty()) {
            let pose = configuration.root_from_frame(model.frame(&frame.name)?);
            let (p, r) = (pose.translation.vector, pose.rotation);
            poses.insert(frame.name.clone(), json!([p.x, p.y, p.z, r.w, r.i, r.j, r.k]));
        }
        poses.insert("center_of_mass".into(), json!(configuration.center_of_mass().as_slice()));
        println!("{}", json!(poses));
    }
    Ok(())
}
