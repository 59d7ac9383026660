//! Files in an episode's folder: `episode.mcap`, `result.json`, `strip.png`, `report.html`. A failed
//! write does not end the episode: the result names the failure.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

use tandem_sim::render::{CameraView, Frame, PictureError, encode_png};
use tandem_sim::{CONTROL_HZ, Step};
use tandem_tools_spec::{Budget, PhaseReached, ResultReply};

use super::failure::FAILED_STEP_FILE;
use super::{Session, this_build};
use crate::EpisodeError;
use crate::commands::Executed;
use crate::observation::Observer;
use crate::output::{OutputError, create_private_folder, write_whole};
use crate::pages::{
    CELL_HEIGHT, CELL_WIDTH, CallCounts, EpisodePage, KeyMoment, LabelledPicture, PAGE_FILE, STRIP_FILE,
    SaidWords, strip,
};
use crate::protocol::Rules;
use crate::recording::{
    LiveViewer, NoteMessage, Recorder, RecorderThread, RecordingHeader, ToolCallRecord, Visibility,
};
use crate::result_file::write_result;
use crate::scoring::Facts;
use crate::tasks::Task;

/// Destination of an episode's files.
#[derive(Clone, Debug)]
pub struct RunFolder {
    pub path: PathBuf,
    pub visibility: Visibility,
    /// True to make a strip of images and a page, for people.
    pub pages: bool,
    /// Viewer that shows the recording live.
    pub live: Option<Arc<dyn LiveViewer>>,
}

impl From<&Path> for RunFolder {
    fn from(path: &Path) -> RunFolder {
        RunFolder { path: path.into(), visibility: Visibility::default(), pages: true, live: None }
    }
}

/// The files of an episode.
pub struct RunFiles {
    folder: PathBuf,
    pages: bool,
    /// Recorder; `None` if the recording could not start.
    recorder: Option<RecorderThread>,
    /// First failure, except the recorder's.
    failed: Option<String>,
    /// Moments of the strip. Their images are rendered when it is written.
    moments: Vec<StripMoment>,
    /// Joint instruction of the robots.
    instruction: String,
    begin_s: f64,
    calls: CallCounts,
    said: Vec<SaidWords>,
    rules: Rules,
    budget_left: Option<Budget>,
}

impl RunFiles {
    /// Makes the folder and starts the recording in the current state of `session`. The episode continues
    /// even if this fails.
    pub(super) fn create(folder: RunFolder, session: &Session) -> RunFiles {
        let begun = begin(&folder, session);
        let failed = begun.as_ref().err().map(EpisodeError::to_string);
        RunFiles {
            folder: folder.path,
            pages: folder.pages,
            recorder: begun.ok(),
            failed,
            moments: Vec::new(),
            instruction: session.spec().task_words().joint,
            begin_s: session.steps_before as f64 / CONTROL_HZ,
            calls: CallCounts::default(),
            said: Vec::new(),
            rules: session.rules,
            budget_left: None,
        }
    }

    pub(super) fn step(
        &mut self,
        step: Arc<Step>,
        executed: Executed,
        state_hash: u64,
        facts: Facts,
        budget: Budget,
    ) {
        self.budget_left = Some(budget);
        if let Some(recorder) = &self.recorder {
            recorder.append_step(move |recorder| recorder.step(&step, &executed, state_hash, &facts, budget));
        }
    }

    pub(super) fn checkpoint(&mut self, name: &str, time_s: f64, bytes: Result<Vec<u8>, EpisodeError>) {
        let name = name.to_owned();
        match (bytes, &self.recorder) {
            (Ok(bytes), Some(recorder)) => {
                recorder.append(move |recorder| recorder.checkpoint(&name, time_s, &bytes));
            }
            (Ok(_), None) => {}
            (Err(error), _) => self.note(Err(error)),
        }
    }

    /// Saves the last good step before the one in which the simulator failed.
    pub(super) fn failed_step(&mut self, checkpoint: Result<Vec<u8>, EpisodeError>) {
        let path = self.folder.join(FAILED_STEP_FILE);
        self.note(checkpoint.and_then(|bytes| Ok(write_whole(&path, &bytes)?)));
    }

    pub(super) fn phase(&mut self, phase: &PhaseReached) {
        let phase = phase.clone();
        if let Some(recorder) = &self.recorder {
            recorder.append(move |recorder| recorder.phase(&phase));
        }
    }

    /// Counts a call of this tool and its success.
    pub(super) fn count_call(&mut self, name: &'static str, ok: bool) {
        self.calls.count(name, ok);
    }

    /// Stores an operator's message, for the page.
    pub(super) fn keep_words(&mut self, words: SaidWords) {
        self.said.push(words);
    }

    pub(super) fn keep_note(&mut self, time_s: f64, note: NoteMessage) {
        if let Some(recorder) = &self.recorder {
            recorder.append(move |recorder| recorder.note(time_s, note));
        }
    }

    pub(super) fn tool_call(&mut self, record: Result<ToolCallRecord, OutputError>) {
        let Some(recorder) = &self.recorder else { return };
        let pictures = record.as_ref().map_or(0, |record| record.pictures.len());
        recorder.append_pictures(pictures, move |recorder| recorder.tool_call(record?));
    }

    /// Lets the episode run ahead of the recorder, or makes it wait again.
    pub(super) fn catch_up(&mut self, catches_up: bool) {
        if let Some(recorder) = &mut self.recorder {
            recorder.catch_up(catches_up);
        }
    }

    /// Waits until all recorded data are on their way to the disk, or a write has failed.
    pub(super) fn flush(&mut self) {
        if let Some(recorder) = &self.recorder {
            recorder.flush();
        }
    }

    /// Stores a moment for the strip, if there will be one.
    pub(super) fn keep(&mut self, caption: &str, step: &Arc<Step>) {
        if self.pages {
            self.moments.push(StripMoment { caption: caption.into(), step: step.clone() });
        }
    }

    /// Returns the reason why the recording is incomplete, if it is.
    pub(super) fn failed(&self) -> Option<&str> {
        self.failed.as_deref().or_else(|| self.recorder.as_ref()?.failed())
    }

    /// Closes the recording and writes the other files. `result` then names any failure. The observer renders
    /// the moments of the strip.
    pub(super) fn finish(&mut self, result: &mut ResultReply, task: &Task, observer: &mut Observer) {
        let recorder = self.recorder.as_mut().and_then(RecorderThread::stop);
        result.recording_failed = self.failed().map(str::to_owned);
        if let Some(recorder) = recorder {
            self.note(recorder.finish(result).map(drop));
        }
        if self.pages {
            let reported = self.report(result, task, observer);
            self.note(reported);
        }
        result.recording_failed = self.failed().map(str::to_owned);
        self.note(write_result(result, &self.folder).map(drop));
        result.recording_failed = self.failed().map(str::to_owned);
        // Removes the folder if no file could be written there. A folder with files stays.
        let _ = fs::remove_dir(&self.folder);
    }

    fn report(&self, result: &ResultReply, task: &Task, observer: &mut Observer) -> Result<(), EpisodeError> {
        let moments = self.moments.iter().map(|moment| moment.render(task, observer));
        let moments = moments.collect::<Result<Vec<_>, _>>()?;
        write_whole(&self.folder.join(STRIP_FILE), &strip::png(&moments)?)?;
        let page = EpisodePage {
            task,
            instruction: &self.instruction,
            result,
            calls: &self.calls,
            said: &self.said,
            begin_s: self.begin_s,
            rules: self.rules,
            budget_left: self.budget_left,
            moments: &moments,
        };
        Ok(write_whole(&self.folder.join(PAGE_FILE), page.html().as_bytes())?)
    }

    fn note(&mut self, outcome: Result<(), impl Display>) {
        if let Err(error) = outcome
            && self.failed().is_none()
        {
            self.failed = Some(error.to_string());
        }
    }
}

/// Starts the recording, so that write errors are known from the beginning.
fn begin(folder: &RunFolder, session: &Session) -> Result<RecorderThread, EpisodeError> {
    let RunFolder { path, visibility, live, .. } = folder;
    let failed = |source| OutputError::Io { path: path.clone(), source };
    create_private_folder(path).map_err(failed)?;
    match fs::remove_file(path.join(FAILED_STEP_FILE)) {
        // The file of an earlier episode in this folder is removed.
        Err(source) if source.kind() != io::ErrorKind::NotFound => return Err(failed(source).into()),
        _ => {}
    }
    let header = RecordingHeader {
        spec: session.spec().clone(),
        locomotion: session.origin.locomotion.clone(),
        renderer: session.observer.renderer().into(),
        build: this_build()?.into(),
        robots: session.motions.iter().map(|motion| motion.robot.clone()).collect(),
        scores: session.scores.memory(),
        executes_otherwise: session.execution.is_some(),
    };
    let mut recorder = Recorder::create(
        path,
        *visibility,
        live.as_deref(),
        header,
        &session.present,
        session.world.state_hash(),
    )?;
    recorder.draw("world", session.world.room())?;
    for (name, model) in session.world.object_models() {
        recorder.draw(name, &model.geoms)?;
    }
    recorder.flush()?;
    Ok(RecorderThread::start(recorder).map_err(failed)?)
}

/// Moment for the strip.
struct StripMoment {
    caption: String,
    step: Arc<Step>,
}

impl StripMoment {
    /// Renders the views of the third-person camera and of the robots of `task`.
    fn render(&self, task: &Task, observer: &mut Observer) -> Result<KeyMoment, PictureError> {
        let StripMoment { caption, step } = self;
        let (mut labels, mut views) = (vec!["the room".into()], vec![observer.cameras.third_person().into()]);
        for (robot, name) in task.robot_names().enumerate() {
            labels.push(format!("what {name} sees"));
            views.push(observer.cameras.eye(step, robot));
        }
        for CameraView { camera, .. } in &mut views {
            (camera.width, camera.height) = (CELL_WIDTH as u32, CELL_HEIGHT as u32);
        }
        let frames = observer.render_all(step, &views).into_iter();
        let view = |(label, Frame { width, height, rgb, .. }): (String, Frame)| {
            Ok(LabelledPicture { label, file: encode_png(width, height, &rgb)? })
        };
        let views = labels.into_iter().zip(frames).map(view).collect::<Result<_, PictureError>>()?;
        Ok(KeyMoment { caption: [caption.clone(), format!("{:.1} s", step.time_s)], views })
    }
}
