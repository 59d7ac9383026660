//! Simulates one second of a scene without robots and prints the result as JSON: `settle FILE`.
//! `tests/peers/worlds/worlds.py` compares it with MuJoCo.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use serde_json::{Value, json};
use tandem_sim::mjcf::Document;
use tandem_sim::render::{Cameras, RendererKind, Scenery};
use tandem_sim::{CONTROL_HZ, Pose, SimError, World};

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("settle FILE: give an MJCF file");
        return ExitCode::FAILURE;
    };
    match settle(Path::new(&path)) {
        Ok(found) => {
            println!("{found}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn settle(path: &Path) -> Result<Value, SimError> {
    let began = Instant::now();
    let document = Document::read(path)?;
    let notes = document.approximations().to_vec();
    let mut world = World::of_scene(document)?;
    let loaded_s = began.elapsed().as_secs_f64();
    let (scenery, step) = (Scenery::of(&world), world.present());
    let triangles: usize = scenery.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    let camera = Cameras::of(&world).third_person();
    RendererKind::Cpu.renderer(scenery).render(&step, &camera);
    let drawn_s = began.elapsed().as_secs_f64() - loaded_s;
    let objects: Vec<(String, f32)> =
        world.object_models().map(|(name, model)| (name.to_string(), model.mass_kg)).collect();
    let mut last = step.clone();
    for _ in 0..CONTROL_HZ as u32 {
        last = world.control_step(&[])?;
    }
    let stepped_s = began.elapsed().as_secs_f64() - loaded_s - drawn_s;
    let rows = objects.iter().zip(step.objects.iter().zip(&last.objects));
    let rows = rows.map(|((name, mass_kg), (begin, end))| {
        let [begin, end] = [begin, end].map(|object| row(&object.state.world_from_object));
        json!({ "name": name, "mass_kg": mass_kg, "begin": begin, "end": end })
    });
    Ok(json!({
        "objects": rows.collect::<Vec<_>>(), "room": world.room().len(), "notes": notes, "triangles": triangles,
        "loaded_s": loaded_s, "drawn_s": drawn_s, "stepped_s": stepped_s,
    }))
}

/// Returns position (m) and quaternion, w first.
fn row(pose: &Pose) -> [f32; 7] {
    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, w, i, j, k]
}
