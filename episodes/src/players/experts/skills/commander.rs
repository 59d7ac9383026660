//! The base of every expert: hands that move along straight lines in the world, several at once.

use tandem_sim::{BaseVelocity, CONTROL_DT_S, Pose, Side, Sides, Vector};
use tandem_tools_spec::{MoveWrists, StopReason, Tool as _, ToolReply, WristMove};

use super::variety::{COME_BACK_S, Variety};
use crate::players::{PlayerError, PrivilegedEpisode};
use crate::scoring::{Facts, Grip};
use crate::tasks::Task;

/// Control steps of one command: short enough to start and stop smoothly.
const STEPS_PER_COMMAND: u32 = 10;
/// Control steps of one command of a walking robot. Hands that are fixed in the world fall behind a robot
/// that does not command them anew often enough.
pub const WALK_STEPS: u32 = 5;
/// Control steps of every command while several scripts run at the same time.
pub const BEAT_STEPS: u32 = WALK_STEPS;

/// Targets of both wrists.
#[derive(Clone, Copy, Debug)]
pub enum WristTargets {
    /// Poses in the world frame, where the wrists stay.
    InWorld(Sides<Pose>),
    /// Poses in the pelvis frame; the wrists move along with the pelvis.
    InPelvis(Sides<Pose>),
}

/// Motion of one robot during one command; its fingers stay.
#[derive(Clone, Copy, Debug)]
pub struct RobotMove {
    pub robot: usize,
    pub base: BaseVelocity,
    pub wrists: WristTargets,
}

/// Motion of one hand. A part that is `None` does not change.
#[derive(Clone, Copy, Debug)]
pub struct HandMove {
    pub robot: usize,
    pub side: Side,
    /// Target pose of the wrist, world frame.
    pub world_from_wrist: Option<Pose>,
    /// Target finger angles, rad, in the order of `move_wrists`.
    pub fingers_rad: Option<[f32; 7]>,
}

impl HandMove {
    pub fn reach(robot: usize, side: Side, world_from_wrist: Pose) -> HandMove {
        HandMove { robot, side, world_from_wrist: Some(world_from_wrist), fingers_rad: None }
    }

    pub fn shape(robot: usize, side: Side, fingers_rad: [f32; 7]) -> HandMove {
        HandMove { robot, side, world_from_wrist: None, fingers_rad: Some(fingers_rad) }
    }

    /// Returns a move in which the hand stays at its last target.
    pub fn still(robot: usize, side: Side) -> HandMove {
        HandMove { robot, side, world_from_wrist: None, fingers_rad: None }
    }

    pub fn shaped(self, fingers_rad: [f32; 7]) -> HandMove {
        HandMove { fingers_rad: Some(fingers_rad), ..self }
    }
}

/// Last commanded target of a hand.
#[derive(Clone, Copy)]
struct HandTarget {
    world_from_wrist: Pose,
    /// `None` until fingers are commanded. Until then they stay as at the episode's start, for example around
    /// an object.
    fingers_rad: Option<[f32; 7]>,
}

/// Last commanded targets of a robot.
#[derive(Clone)]
pub struct CommandedTargets {
    hands: Sides<HandTarget>,
    /// Commanded height of its pelvis; `None` until it is commanded.
    height_m: Option<f32>,
    /// Compliance of its hands towards partners; `None` for stiff hands.
    compliance_n_s_m: Option<f64>,
}

/// Commander of an episode's robots, with their last commanded targets.
pub struct Commander<'a> {
    task: &'a Task,
    episode: &'a mut dyn PrivilegedEpisode,
    /// Last commanded targets of each robot.
    targets: Vec<CommandedTargets>,
    /// True while other scripts play at the same time, so that all commands are equally long.
    in_step: bool,
    /// Variation of the demonstration; `None` for the plain one.
    variety: Option<Variety>,
}

impl<'a> Commander<'a> {
    pub fn new(task: &'a Task, episode: &'a mut dyn PrivilegedEpisode) -> Result<Commander<'a>, PlayerError> {
        let facts = episode.facts()?;
        let targets = |robot: usize| CommandedTargets {
            hands: Sides::from_fn(|side| HandTarget {
                world_from_wrist: world_from_wrist(&facts, robot, side),
                fingers_rad: None,
            }),
            height_m: None,
            compliance_n_s_m: None,
        };
        let targets = (0..facts.robots.len()).map(targets).collect();
        Ok(Commander { task, episode, targets, in_step: false, variety: None })
    }

    /// Returns the commander with the motions of `variety`.
    pub fn varied(self, variety: Option<Variety>) -> Commander<'a> {
        Commander { variety, ..self }
    }

    /// Returns the demonstration's variation, for the commanders of scripts.
    pub fn variety(&self) -> Option<&Variety> {
        self.variety.as_ref()
    }

    /// Returns the share of its usual pace at which a robot walks.
    pub fn walking(&self) -> f32 {
        self.variety.as_ref().map_or(1.0, Variety::walking)
    }

    /// Creates the commander of one of several scripts that run at the same time, with the robots' earlier
    /// targets.
    pub fn in_step(
        task: &'a Task,
        targets: Vec<CommandedTargets>,
        episode: &'a mut dyn PrivilegedEpisode,
    ) -> Commander<'a> {
        Commander { task, episode, targets, in_step: true, variety: None }
    }

    pub fn task(&self) -> &'a Task {
        self.task
    }

    /// Returns the last commanded targets of all robots.
    pub fn targets(&self) -> &[CommandedTargets] {
        &self.targets
    }

    /// Takes over these robots' targets from another commander.
    pub fn take_over(&mut self, robots: &[usize], targets: &[CommandedTargets]) {
        for robot in robots {
            self.targets[*robot] = targets[*robot].clone();
        }
    }

    pub fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts()
    }

    /// Sets the height of a robot's pelvis from its next command on.
    pub fn set_height(&mut self, robot: usize, height_m: f32) {
        self.targets[robot].height_m = Some(height_m);
    }

    /// Sets the compliance of a robot's hands from its next command on.
    pub fn set_compliance(&mut self, robot: usize, compliance_n_s_m: Option<f64>) {
        self.targets[robot].compliance_n_s_m = compliance_n_s_m;
    }

    /// Sets the finger angles of a hand from its next command on, if the move gives them.
    pub fn set_fingers(&mut self, hand: &HandMove) {
        let target = &mut self.targets[hand.robot].hands[hand.side];
        target.fingers_rad = hand.fingers_rad.or(target.fingers_rad);
    }

    /// Moves hands along straight lines for `duration_s`, from rest to rest. Robots that are not named hold
    /// still.
    pub fn perform(&mut self, duration_s: f32, moves: &[HandMove]) -> Result<(), PlayerError> {
        let Some(mut variety) = self.variety.take() else {
            return self.travel(duration_s, moves, smooth, Vector::ZERO);
        };
        let outcome = self.perform_varied(&mut variety, duration_s, moves);
        self.variety = Some(variety);
        outcome
    }

    /// Performs moves as [`Commander::perform`] does, with the pauses, detours and misses of this
    /// demonstration.
    fn perform_varied(
        &mut self,
        variety: &mut Variety,
        duration_s: f32,
        moves: &[HandMove],
    ) -> Result<(), PlayerError> {
        let way_m = |hand: &HandMove| {
            let from = self.targets[hand.robot].hands[hand.side].world_from_wrist;
            hand.world_from_wrist.map_or(0.0, |to| (to.translation - from.translation).length())
        };
        let way_m = moves.iter().map(way_m).fold(0.0, f32::max);
        let (pause_s, duration_s) = (variety.pause_s(), variety.duration_s(duration_s));
        let (stray_m, miss_m) = (variety.stray_m(way_m), variety.miss_m(way_m));
        if pause_s > 0.0 {
            let still: Vec<HandMove> =
                moves.iter().map(|hand| HandMove::still(hand.robot, hand.side)).collect();
            self.travel(pause_s, &still, smooth, Vector::ZERO)?;
        }
        let facts = self.episode.facts()?;
        let is_free = |hand: &HandMove| {
            facts.objects.iter().all(|object| object.hands[hand.robot][hand.side] == Grip::Off)
        };
        match miss_m.filter(|_| moves.iter().all(is_free)) {
            None => self.travel(duration_s, moves, smooth, stray_m),
            Some(off_m) => {
                let missed = moves.iter().map(|hand| HandMove {
                    world_from_wrist: hand
                        .world_from_wrist
                        .map(|to| Pose::from_parts(to.translation + off_m, to.rotation)),
                    ..*hand
                });
                self.travel(duration_s, &missed.collect::<Vec<_>>(), smooth, stray_m)?;
                self.travel(COME_BACK_S, moves, smooth, Vector::ZERO)
            }
        }
    }

    /// Performs moves as [`Commander::perform`] does, but at constant speed: one leg of a longer path.
    pub fn glide(&mut self, duration_s: f32, moves: &[HandMove]) -> Result<(), PlayerError> {
        self.travel(duration_s, moves, |part| part, Vector::ZERO)
    }

    /// Moves hands along their lines at `pace`. Half way, all hands are `stray_m` off their straight lines.
    fn travel(
        &mut self,
        duration_s: f32,
        moves: &[HandMove],
        pace: fn(f32) -> f32,
        stray_m: Vector,
    ) -> Result<(), PlayerError> {
        let from = self.targets.clone();
        let beat = if self.in_step { BEAT_STEPS } else { 1 };
        let most = if self.in_step { BEAT_STEPS } else { STEPS_PER_COMMAND };
        let total = ((duration_s / CONTROL_DT_S).round().max(1.0) as u32).next_multiple_of(beat);
        let mut done = 0;
        while done < total {
            let steps = most.min(total - done);
            let part = pace((done + steps) as f32 / total as f32);
            let aside_m = stray_m * (4.0 * part * (1.0 - part)).powi(2);
            for hand in moves {
                let start = from[hand.robot].hands[hand.side];
                let target = &mut self.targets[hand.robot].hands[hand.side];
                if let Some(end) = hand.world_from_wrist {
                    target.world_from_wrist = start.world_from_wrist.lerp(&end, part);
                    if aside_m != Vector::ZERO {
                        target.world_from_wrist.translation += aside_m;
                    }
                }
                if let Some(end_rad) = hand.fingers_rad {
                    let start_rad = start.fingers_rad.unwrap_or([0.0; 7]);
                    let between = |i: usize| start_rad[i] + (end_rad[i] - start_rad[i]) * part;
                    target.fingers_rad = Some(std::array::from_fn(between));
                }
            }
            self.command(steps, moves)?;
            done += steps;
        }
        Ok(())
    }

    /// Keeps a robot's targets for one short command.
    pub fn hold(&mut self, robot: usize) -> Result<(), PlayerError> {
        let facts = self.episode.facts()?;
        let robots = vec![self.wrist_move(&facts, robot)];
        self.call(BEAT_STEPS, robots)
    }

    /// Makes one command in which robots walk or stand; those that `moves` does not name hold still.
    pub fn advance(&mut self, steps: u32, moves: &[RobotMove]) -> Result<(), PlayerError> {
        let facts = self.episode.facts()?;
        let mut robots = Vec::with_capacity(moves.len());
        for part in moves {
            let world_from_pelvis = facts.robots[part.robot].pelvis_in_world;
            let (world_from_wrist, carried) = match part.wrists {
                WristTargets::InWorld(wrists) => (wrists, false),
                WristTargets::InPelvis(wrists) => (wrists.map(|wrist| world_from_pelvis * wrist), true),
            };
            for side in Side::BOTH {
                self.targets[part.robot].hands[side].world_from_wrist = world_from_wrist[side];
            }
            robots.push(WristMove {
                carried: Some(carried),
                vx_m_s: Some(part.base.vx_m_s.into()),
                vy_m_s: Some(part.base.vy_m_s.into()),
                yaw_rate_rad_s: Some(part.base.yaw_rate_rad_s.into()),
                ..self.wrist_move(&facts, part.robot)
            });
        }
        self.call(steps, robots)?;
        let after = self.episode.facts()?;
        for part in moves {
            if let WristTargets::InPelvis(wrists) = part.wrists {
                let world_from_pelvis = after.robots[part.robot].pelvis_in_world;
                for side in Side::BOTH {
                    self.targets[part.robot].hands[side].world_from_wrist = world_from_pelvis * wrists[side];
                }
            }
        }
        Ok(())
    }

    /// Makes one `move_wrists` with the present goals of all robots that `moves` name.
    fn command(&mut self, steps: u32, moves: &[HandMove]) -> Result<(), PlayerError> {
        let facts = self.episode.facts()?;
        let named = (0..self.targets.len()).filter(|robot| moves.iter().any(|hand| hand.robot == *robot));
        let robots = named.map(|robot| self.wrist_move(&facts, robot)).collect();
        self.call(steps, robots)
    }

    fn call(&mut self, steps: u32, robots: Vec<WristMove>) -> Result<(), PlayerError> {
        match self.pass_on(MoveWrists { steps, robots })? {
            ToolReply::Act(reply) if reply.stop_reason == StopReason::StepsDone => Ok(()),
            ToolReply::Act(_) => Err(PlayerError::EpisodeOver),
            other @ (ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(_) | ToolReply::Talk(_)) => {
                Err(PlayerError::Call {
                    tool: MoveWrists::NAME,
                    reason: format!("unexpected reply {other:?}"),
                })
            }
        }
    }

    /// Executes a command merged from those of other commanders.
    pub fn pass_on(&mut self, command: MoveWrists) -> Result<ToolReply, PlayerError> {
        self.episode.call(command.into())
    }

    fn wrist_move(&self, facts: &Facts, robot: usize) -> WristMove {
        let targets = &self.targets[robot];
        let pelvis_from_world = facts.robots[robot].pelvis_in_world.inverse();
        let target = |side: Side| targets.hands[side];
        let pose = |side: Side| pelvis_from_world * target(side).world_from_wrist;
        let position = |side: Side| Some(pose(side).translation.to_array().map(f64::from));
        let quaternion = |side: Side| {
            let q = pose(side).rotation;
            Some([q.w, q.x, q.y, q.z].map(f64::from))
        };
        let fingers = |side: Side| Some(target(side).fingers_rad?.map(f64::from));
        WristMove {
            left_position_m: position(Side::Left),
            left_quaternion_wxyz: quaternion(Side::Left),
            right_position_m: position(Side::Right),
            right_quaternion_wxyz: quaternion(Side::Right),
            left_fingers_rad: fingers(Side::Left),
            right_fingers_rad: fingers(Side::Right),
            pelvis_height_m: targets.height_m.map(f64::from),
            compliance_n_s_m: targets.compliance_n_s_m,
            ..WristMove::hold(self.task.robots[robot].name)
        }
    }

    /// Returns the present pose of a hand's wrist, world frame.
    pub fn world_from_wrist(&mut self, robot: usize, side: Side) -> Result<Pose, PlayerError> {
        Ok(world_from_wrist(&self.facts()?, robot, side))
    }
}

fn world_from_wrist(facts: &Facts, robot: usize, side: Side) -> Pose {
    let robot = &facts.robots[robot];
    robot.pelvis_in_world * robot.wrist_in_pelvis[side]
}

/// Eases `share` from 0 to 1, with zero speed at both ends.
pub fn smooth(share: f32) -> f32 {
    share * share * (3.0 - 2.0 * share)
}
