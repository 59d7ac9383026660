//! A moment for the picture strip, as the third-person camera and the robots see it.

use tandem_sim::Step;
use tandem_sim::render::Camera;

use super::eyes::Eyes;
use crate::reports::episode::{CELL_HEIGHT, CELL_WIDTH, KeyMoment, LabelledFrame};

/// What there is to see after `step`, of robots called `names`.
pub fn capture<'a>(
    caption: &str,
    step: &Step,
    names: impl Iterator<Item = &'a str>,
    eyes: &mut Eyes,
) -> KeyMoment {
    let mut sights = vec![("the room".into(), eyes.cameras.third_person())];
    for (robot, name) in names.enumerate() {
        sights.push((format!("what {name} sees"), eyes.cameras.egocentric(step, robot)));
    }
    let see = |(label, camera): (String, Camera)| {
        let camera = Camera { width: CELL_WIDTH as u32, height: CELL_HEIGHT as u32, ..camera };
        LabelledFrame { label, frame: eyes.render(step, &camera) }
    };
    let views = sights.into_iter().map(see).collect();
    KeyMoment { caption: [caption.into(), format!("{:.1} s", step.time_s)], views }
}
