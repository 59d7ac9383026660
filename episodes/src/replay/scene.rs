//! What there is to see in a recorded episode, drawn from its steps: nothing is simulated.

use tandem_sim::Step;
use tandem_sim::render::{Camera, Frame};

use crate::EpisodeError;
use crate::session::{Eyes, build};
use crate::spec::EpisodeSpec;
use crate::tasks::Task;

/// One of an episode's cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    ThirdPerson,
    /// In the head of robot number so-and-so.
    Egocentric(usize),
}

/// Width and height of a picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

impl View {
    /// Every camera of the task's episodes.
    pub fn all(task: &Task) -> Vec<View> {
        let heads = (0..task.robots.len()).map(View::Egocentric);
        std::iter::once(View::ThirdPerson).chain(heads).collect()
    }

    /// `third_person`, or the robot's name.
    pub fn name(self, task: &Task) -> &'static str {
        match self {
            View::ThirdPerson => "third_person",
            View::Egocentric(robot) => task.robots[robot].name,
        }
    }

    /// The camera called `name`; its error says which there are.
    pub fn find(name: &str, task: &Task) -> Result<View, String> {
        let all = View::all(task);
        let have: Vec<&str> = all.iter().map(|view| view.name(task)).collect();
        let found = have.iter().position(|known| *known == name);
        found.map(|index| all[index]).ok_or_else(|| {
            format!("no camera {name:?} in an episode of {}; have: {}", task.id, have.join(", "))
        })
    }
}

/// Draws the steps of one episode.
pub struct Scene {
    eyes: Eyes,
}

impl Scene {
    /// Of the episode `spec`, at rest.
    pub fn of(spec: &EpisodeSpec) -> Result<Scene, EpisodeError> {
        Ok(Scene { eyes: Eyes::new(spec.renderer, &build(spec)?.world) })
    }

    /// The camera after `step`, with pictures of another size if one is given: as high an angle, more or less wide.
    pub fn camera(&self, view: View, step: &Step, size: Option<Size>) -> Camera {
        let camera = match view {
            View::ThirdPerson => self.eyes.cameras.third_person(),
            View::Egocentric(robot) => self.eyes.cameras.egocentric(step, robot),
        };
        match size {
            Some(Size { width, height }) => Camera { width, height, ..camera },
            None => camera,
        }
    }

    /// What `camera` sees after `step`.
    pub fn draw(&mut self, step: &Step, camera: &Camera) -> Frame {
        self.eyes.render(step, camera)
    }
}
