//! Prints the measurements of [`tandem_ik::bench`] as JSON: `bench ROBOT.urdf|ROBOT.xml TARGETS.json`.

use std::{env, error::Error, fs};

use tandem_ik::{Model, bench};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [robot, targets] = arguments.as_slice() else {
        return Err("two arguments expected: ROBOT.urdf|ROBOT.xml TARGETS.json".into());
    };
    let text = fs::read_to_string(robot)?;
    let model = if robot.ends_with(".urdf") { Model::from_urdf(&text)? } else { Model::from_mjcf(&text)? };
    let set = bench::TargetSet::from_json(&fs::read_to_string(targets)?)?;
    println!("{}", serde_json::to_string(&bench::run(&model, &set)?)?);
    Ok(())
}
