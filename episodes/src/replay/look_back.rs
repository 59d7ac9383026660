//! A finished episode for display in a page: its scene, its events in time, and its steps for a scrubber.
//! Nothing is simulated.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use tandem_sim::Step;
use tandem_sim::render::PictureError;

use super::ReplayError;
use crate::commands::Motion;
use crate::convert::isometry_from_sim;
use crate::live::{LiveScene, LiveStep, LiveTexture, told_transcript};
use crate::recording::{Recording, TranscriptEntry};
use crate::session::build_world;
use crate::spec::EpisodeSpec;

/// Control steps per displayed step: ten are shown a second, and the page interpolates between them.
const STEPS_PER_FRAME: usize = 5;

/// A recording for display.
pub struct RecordedEpisode {
    spec: EpisodeSpec,
    scene: LiveScene,
    steps: Vec<Step>,
    /// Steps whose images a policy was shown.
    looked: Vec<Step>,
    message: Arc<[u8]>,
}

impl RecordedEpisode {
    /// Reads the recording at `path`.
    ///
    /// # Errors
    ///
    /// If it cannot be read or its world cannot be built.
    pub fn read(path: &Path) -> Result<RecordedEpisode, ReplayError> {
        let recording = Recording::read(path)?;
        let built = build_world(&recording.spec)?;
        let links = built.motions[0].robot.model.links.len();
        let transcript = recording.transcript()?;
        let looks: BTreeSet<u64> = transcript.iter().filter_map(looked_at).collect();
        let (mut steps, mut looked, mut last) = (Vec::new(), Vec::new(), None);
        for (index, step) in recording.steps().enumerate() {
            let step = step?;
            recording.check_fit(&step, links)?;
            if looks.contains(&step.control_step) {
                looked.push(step.clone());
            }
            match index % STEPS_PER_FRAME {
                0 => {
                    steps.push(step);
                    last = None;
                }
                _ => last = Some(step),
            }
        }
        steps.extend(last);
        let told = json!({
            "recorded": true, "story": told_transcript(&transcript), "reached": recording.phases()?,
            "result": recording.result, "frames": steps.len(),
        });
        let scene = LiveScene::of(&recording.spec, &built.world, &built.motions);
        let frames: Vec<u8> =
            steps.iter().flat_map(|step| scene.frame(&shown(&built.motions, step))).collect();
        let message = scene.message(told, &frames).into();
        Ok(RecordedEpisode { spec: recording.spec, scene, steps, looked, message })
    }

    /// Returns the spec of the episode.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.spec
    }

    /// Returns the message from which a page draws the episode. Its head has the scene, the calls, the
    /// phases and the result; the steps follow at its end.
    pub fn message(&self) -> Arc<[u8]> {
        self.message.clone()
    }

    /// Returns the images on surfaces, for which the page asks by their hashes.
    pub fn textures(&self) -> &[Arc<LiveTexture>] {
        self.scene.textures()
    }

    /// Returns the image of robot `name` as a PNG file, in the step nearest to `time_s`. Candidates are the
    /// displayed steps, and those whose images a policy was shown. Returns `None` if there is no such robot
    /// or step.
    pub fn picture(&self, time_s: f64, name: &str) -> Option<Result<Vec<u8>, PictureError>> {
        let away = |step: &&Step| (step.time_s - time_s).abs();
        let step =
            self.looked.iter().chain(&self.steps).min_by(|one, other| away(one).total_cmp(&away(other)))?;
        self.scene.picture(step, name)
    }

    /// Returns the names of the robots.
    pub fn robots(&self) -> impl Iterator<Item = &str> {
        self.scene.robots()
    }
}

fn shown(motions: &[Motion], step: &Step) -> LiveStep {
    let states = motions.iter().zip(&step.robots).map(|(motion, robot)| {
        motion.state_after(&robot.command, isometry_from_sim(&robot.estimate.world_from_pelvis))
    });
    LiveStep::new(step.clone().into(), states.collect(), None)
}

/// Returns the step whose images a policy was shown.
fn looked_at(entry: &TranscriptEntry) -> Option<u64> {
    match entry {
        TranscriptEntry::Call { call, .. } => (!call.pictures.is_empty()).then_some(call.control_step),
        TranscriptEntry::Note { .. } => None,
    }
}
