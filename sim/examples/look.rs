//! Draws the start state of a scene without robots into a PNG file, and prints the median duration of an
//! image: `look FILE RENDERER WIDTH HEIGHT FIELD_OF_VIEW_RAD EYE_X EYE_Y EYE_Z AT_X AT_Y AT_Z OUT`, in
//! metres. `tests/peers/worlds/looks.py` compares it with MuJoCo.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use tandem_sim::mjcf::Document;
use tandem_sim::render::{Camera, RendererKind, Scenery, encode_png};
use tandem_sim::{Pose, Vector, World};

/// Number of drawn images whose durations are measured.
const MEASURED: usize = 9;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, renderer, width, height, numbers @ .., out] = words.as_slice() else {
        return Err("look FILE RENDERER WIDTH HEIGHT FIELD_OF_VIEW_RAD EYE AT OUT".into());
    };
    let numbers: Vec<f32> = numbers.iter().map(|word| word.parse()).collect::<Result<_, _>>()?;
    let [vertical_fov_rad, eye_x, eye_y, eye_z, at_x, at_y, at_z] = numbers[..] else {
        return Err("field of view, eye and target are seven numbers".into());
    };
    let camera = Camera {
        world_from_camera: Pose::look_at_rh(
            Vector::new(eye_x, eye_y, eye_z),
            Vector::new(at_x, at_y, at_z),
            Vector::Z,
        )
        .inverse(),
        vertical_fov_rad,
        width: width.parse()?,
        height: height.parse()?,
        blur_px: 0.0,
    };
    let world = World::of_scene(Document::read(Path::new(file))?)?;
    let step = world.present();
    let kind = RendererKind::ALL.into_iter().find(|kind| kind.name() == renderer);
    let mut renderer = kind.ok_or("there is no such renderer")?.renderer(Scenery::of(&world));
    let frame = renderer.render(&step, &camera);
    let mut durations_ms: Vec<f64> = (0..MEASURED)
        .map(|_| {
            let began = Instant::now();
            renderer.render(&step, &camera);
            began.elapsed().as_secs_f64() * 1000.0
        })
        .collect();
    durations_ms.sort_by(f64::total_cmp);
    std::fs::write(out, encode_png(frame.width, frame.height, &frame.rgb)?)?;
    println!("{:.2}", durations_ms[MEASURED / 2]);
    Ok(())
}
