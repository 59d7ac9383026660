//! A finished episode for who looks at it in a page: its scene, what happened when, and its steps as a scrubber shows them. Nothing is
//! simulated.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use tandem_sim::Step;
use tandem_sim::render::PictureError;

use super::ReplayError;
use crate::commands::Motion;
use crate::convert::isometry_from_sim;
use crate::live::{LiveScene, LiveStep, told_transcript};
use crate::recording::{Recording, TranscriptEntry};
use crate::session::build;
use crate::spec::EpisodeSpec;

/// Every how many control steps one is shown: ten a second, between which a page draws what lies between.
const STEPS_PER_FRAME: usize = 5;

/// A recording that is looked at.
pub struct RecordedEpisode {
    spec: EpisodeSpec,
    scene: LiveScene,
    steps: Vec<Step>,
    /// Those that a policy was shown pictures of.
    looked: Vec<Step>,
    message: Arc<[u8]>,
}

impl RecordedEpisode {
    /// Reads the recording at `path`.
    pub fn read(path: &Path) -> Result<RecordedEpisode, ReplayError> {
        let recording = Recording::read(path)?;
        let built = build(&recording.spec)?;
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

    /// What was played.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.spec
    }

    /// The message that a page draws all of it from: that of the scene with the calls, the phases and the result in its head, and every
    /// step's at its end.
    pub fn message(&self) -> Arc<[u8]> {
        self.message.clone()
    }

    /// What robot `name` saw in the step that is nearest to `time_s`, of those that are shown and those that a policy was shown pictures
    /// of, as a PNG file; `None` if there is no such robot or step.
    pub fn picture(&self, time_s: f64, name: &str) -> Option<Result<Vec<u8>, PictureError>> {
        let away = |step: &&Step| (step.time_s - time_s).abs();
        let step =
            self.looked.iter().chain(&self.steps).min_by(|one, other| away(one).total_cmp(&away(other)))?;
        self.scene.picture(step, name)
    }

    /// The names of the robots.
    pub fn robots(&self) -> impl Iterator<Item = &str> {
        self.scene.robots()
    }
}

fn shown(motions: &[Motion], step: &Step) -> LiveStep {
    let told = motions.iter().zip(&step.robots).map(|(motion, robot)| {
        motion.told(&robot.command, isometry_from_sim(&robot.estimate.world_from_pelvis))
    });
    LiveStep::new(step.clone().into(), told.collect(), None)
}

/// The step of which a policy was shown pictures.
fn looked_at(entry: &TranscriptEntry) -> Option<u64> {
    match entry {
        TranscriptEntry::Call { call, .. } => (!call.pictures.is_empty()).then_some(call.control_step),
        TranscriptEntry::Note { .. } => None,
    }
}
