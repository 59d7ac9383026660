//! A command that runs until a condition holds, split into commands of a tenth of a second.

use nalgebra::Isometry3;
use tandem_sim::{HAND_JOINTS, Side, Sides};
use tandem_tools_spec::{ActCall, MoveWrists, PoseFrame, SpecError, Wait, Walk, WristMove};

use crate::EpisodeError;
use crate::commands::{self, Command, columns, wrist_targets};
use crate::session::Session;

/// Number of control steps of a piece. The conditions are checked after each piece.
const PIECE_STEPS: u32 = 5;
/// Additional control steps in which wrists reach the ends of their paths.
const ARRIVING_STEPS: u32 = 25;

/// A command in pieces.
#[derive(Debug)]
pub struct Pieces {
    /// Control steps of the command's own motion.
    steps: u32,
    done: u32,
    kind: PieceKind,
}

#[derive(Debug)]
enum PieceKind {
    Wait,
    Walk(Walk),
    Wrists(Vec<WristWay>),
}

/// Trajectory of one robot's wrists and fingers, split into the pieces.
#[derive(Debug)]
struct WristWay {
    /// The original move, with poses in `frame`.
    entry: WristMove,
    /// Start and end of each wrist with a target.
    wrists: Sides<Option<[Isometry3<f64>; 2]>>,
    fingers_rad: Sides<Option<[[f64; HAND_JOINTS]; 2]>>,
}

impl Pieces {
    /// Reads the command.
    ///
    /// # Errors
    ///
    /// If a piece cannot be executed.
    pub fn new(call: &ActCall, session: &Session) -> Result<Pieces, EpisodeError> {
        let kind = match call {
            ActCall::Wait(_) => PieceKind::Wait,
            ActCall::Walk(walk) => PieceKind::Walk(walk.clone()),
            ActCall::MoveWrists(wrists) => {
                let ways = wrists.robots.iter().map(|entry| WristWay::new(entry, session));
                PieceKind::Wrists(ways.collect::<Result<_, _>>()?)
            }
            ActCall::SendJointChunk(_) | ActCall::SendJointDrives(_) => {
                let reason = "its rows are what it does; leave `until` out".into();
                return Err(SpecError::Invalid { tool: call.name(), reason }.into());
            }
        };
        let mut pieces = Pieces { steps: call.steps(), done: 0, kind };
        if let Some(first) = pieces.next_piece() {
            Command::read(&first, &session.rules, &session.motions)?;
        }
        Ok(Pieces { done: 0, ..pieces })
    }

    /// Returns the next piece; `None` once the command's steps are done.
    pub fn next_piece(&mut self) -> Option<ActCall> {
        let arriving_steps = if let PieceKind::Wrists(_) = self.kind { ARRIVING_STEPS } else { 0 };
        let is_way_done = self.done >= self.steps;
        let end = if is_way_done { self.steps + arriving_steps } else { self.steps };
        let steps = (end - self.done).min(PIECE_STEPS);
        if steps == 0 {
            return None;
        }
        self.done += steps;
        let share = f64::from(self.done) / f64::from(self.steps);
        Some(match &self.kind {
            PieceKind::Wait => ActCall::Wait(Wait { steps }),
            PieceKind::Walk(walk) => ActCall::Walk(Walk { steps, ..walk.clone() }),
            PieceKind::Wrists(ways) => {
                let robots =
                    ways.iter().map(|way| if is_way_done { way.arriving() } else { way.until(share) });
                let robots = robots.collect();
                ActCall::MoveWrists(MoveWrists { steps, robots })
            }
        })
    }

    /// Returns true once wrists have their last targets. A wrist that reaches its target earlier has only
    /// reached an intermediate target.
    pub fn is_way_done(&self) -> bool {
        self.done >= self.steps || !matches!(self.kind, PieceKind::Wrists(_))
    }

    /// Returns true once fingers have their last targets, or if the command moves none.
    pub fn are_fingers_done(&self) -> bool {
        let PieceKind::Wrists(ways) = &self.kind else { return true };
        self.done >= self.steps
            || ways.iter().all(|way| way.fingers_rad.left.is_none() && way.fingers_rad.right.is_none())
    }

    /// Returns true if this wrist has a target that it has not received yet.
    pub fn is_under_way(&self, robot: &str, side: Side) -> bool {
        let PieceKind::Wrists(ways) = &self.kind else { return false };
        self.done < self.steps
            && ways.iter().any(|way| way.entry.robot == robot && way.wrists[side].is_some())
    }
}

impl WristWay {
    fn new(entry: &WristMove, session: &Session) -> Result<WristWay, EpisodeError> {
        let motion = &session.motions[commands::find(&entry.robot, &session.motions)?];
        // Carried hands move with the pelvis; others stay in the room.
        let frame = match (entry.carried, entry.frame) {
            (Some(true), _) => PoseFrame::Pelvis,
            (_, Some(PoseFrame::Room)) => PoseFrame::Room,
            _ => PoseFrame::Start,
        };
        let halves = Sides {
            left: (entry.left_position_m, entry.left_quaternion_wxyz),
            right: (entry.right_position_m, entry.right_quaternion_wxyz),
        };
        let frame_from_pelvis = motion.pelvis_from(frame).inverse();
        let targets = wrist_targets(halves, entry.frame.unwrap_or_default(), motion);
        let from = motion.wrists();
        let wrists = Sides::from_fn(|side| {
            targets[side].map(|target| [frame_from_pelvis * from[side].target, frame_from_pelvis * target])
        });
        let present_rad = |side: Side| {
            let hand = &motion.upper_rad()[columns::hand(side)];
            std::array::from_fn(|finger| hand[finger])
        };
        let fingers_rad = Sides {
            left: entry.left_fingers_rad.map(|to| [present_rad(Side::Left), to]),
            right: entry.right_fingers_rad.map(|to| [present_rad(Side::Right), to]),
        };
        Ok(WristWay { entry: WristMove { frame: Some(frame), ..entry.clone() }, wrists, fingers_rad })
    }

    /// Returns the move that keeps the last targets, while the base stands.
    fn arriving(&self) -> WristMove {
        WristMove { vx_m_s: None, vy_m_s: None, yaw_rate_rad_s: None, ..self.until(1.0) }
    }

    /// Returns the move to this fraction of the trajectory.
    fn until(&self, share: f64) -> WristMove {
        let wrist = |side: Side| {
            self.wrists[side].map(|[from, to]| from.try_lerp_slerp(&to, share, 1e-9).unwrap_or(to))
        };
        let position_m = |side: Side| wrist(side).map(|wrist| wrist.translation.vector.into());
        let quaternion_wxyz = |side: Side| {
            wrist(side).map(|Isometry3 { rotation, .. }| [rotation.w, rotation.i, rotation.j, rotation.k])
        };
        let fingers_rad = |side: Side| {
            self.fingers_rad[side].map(|[from, to]| {
                std::array::from_fn(|finger| from[finger] + share * (to[finger] - from[finger]))
            })
        };
        WristMove {
            left_position_m: position_m(Side::Left),
            left_quaternion_wxyz: quaternion_wxyz(Side::Left),
            right_position_m: position_m(Side::Right),
            right_quaternion_wxyz: quaternion_wxyz(Side::Right),
            left_fingers_rad: fingers_rad(Side::Left),
            right_fingers_rad: fingers_rad(Side::Right),
            ..self.entry.clone()
        }
    }
}
