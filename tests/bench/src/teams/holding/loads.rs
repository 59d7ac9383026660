//! Shared loads of the bench, and the grasps of the teams that hold them.

use std::f32::consts::PI;

use tandem_episodes::{
    A, B, C,
    players::{
        InProcess, PlayerError,
        experts::skills::{
            CarryTeam, Commander, FREE, HandGrasp, Hold, ObjectPath, grasp_compliantly, grasp_reached,
        },
    },
    tasks::{self, Task},
};
use tandem_sim::{Pose, Vector};

use crate::teams::carrying;

/// An object held by a team, which grasps it at the start of the task that contains the object.
pub(in crate::teams) struct SharedLoad {
    pub name: &'static str,
    pub object: &'static str,
    /// Each robot, its two grasp points on the object, and its heading in the object's frame.
    holders: &'static [(usize, [&'static str; 2], f32)],
    hold: &'static Hold,
    /// True if hands reach out while their robots walk to the object, for example to the legs of a table.
    reaching: bool,
    /// Height of the pelvis above the floor while the object is grasped, and while it is held. `None` keeps
    /// the current height.
    pelvis_m: Option<[f32; 2]>,
    lift_m: f32,
    /// Displacement of the object when it is carried: x and y in the world frame.
    pub way_m: [f32; 2],
}

const TWO_THIRDS_RAD: f32 = 2.0 * PI / 3.0;

pub(in crate::teams) const TABLE: SharedLoad = SharedLoad {
    name: "shared_table",
    object: "office_table",
    holders: &[(A, ["a_left", "a_right"], 0.0), (B, ["b_left", "b_right"], PI)],
    hold: &Hold::EDGE,
    reaching: false,
    pelvis_m: Some([0.75, 0.75]),
    lift_m: 0.07,
    way_m: [0.0, -0.3],
};

pub(in crate::teams) const ROUND_TABLE: SharedLoad = SharedLoad {
    name: "shared_round_table",
    object: "round_table",
    holders: &[
        (A, ["a_left", "a_right"], 0.0),
        (B, ["b_left", "b_right"], TWO_THIRDS_RAD),
        (C, ["c_left", "c_right"], -TWO_THIRDS_RAD),
    ],
    hold: &Hold::ROUND_EDGE,
    reaching: false,
    pelvis_m: Some([0.75, 0.75]),
    lift_m: 0.07,
    way_m: [0.3, 0.0],
};

pub(in crate::teams) const LEGS: SharedLoad = SharedLoad {
    name: "shared_legs",
    object: "console_table",
    holders: &[(B, ["b_left", "b_right"], PI), (C, ["c_left", "c_right"], 0.0)],
    hold: &Hold::LEG,
    reaching: true,
    pelvis_m: Some([0.64, 0.70]),
    lift_m: 0.07,
    way_m: [0.3, 0.0],
};

pub(in crate::teams) const BASKET: SharedLoad = SharedLoad {
    name: "shared_basket",
    object: "basket",
    holders: &[(A, ["a_left", "a_right"], 0.0), (B, ["b_left", "b_right"], PI)],
    hold: &Hold::RIM,
    reaching: false,
    pelvis_m: None,
    lift_m: 0.09,
    way_m: [0.0, -0.3],
};

pub(in crate::teams) const BAR: SharedLoad = SharedLoad {
    name: "shared_bar",
    object: "bar",
    holders: &[(A, ["a_left", "a_right"], 0.0), (B, ["b_left", "b_right"], 0.0)],
    hold: &Hold::BAR,
    reaching: false,
    pelvis_m: None,
    lift_m: 0.1,
    way_m: [-0.3, 0.0],
};

const PACE_M_S: f32 = 0.2;

impl SharedLoad {
    /// Returns the task in which the object is carried.
    pub(in crate::teams) fn task(&self) -> &Task {
        let has_it = |task: &&Task| task.objects.iter().any(|spot| spot.name == self.object);
        tasks::cohub().iter().find(has_it).unwrap_or(&carrying::TASK)
    }

    /// Returns the number of robots that hold the object.
    pub(in crate::teams) fn team_size(&self) -> usize {
        self.holders.len()
    }

    /// Returns the robots that hold the object.
    pub(in crate::teams) fn team(&self) -> impl Iterator<Item = usize> {
        self.holders.iter().map(|(robot, ..)| *robot)
    }

    /// Grasps the object and lifts it. With `carried`, the robots then walk a short distance with the object.
    pub(in crate::teams) fn take(&self, episode: &mut InProcess, carried: bool) -> Result<(), PlayerError> {
        self.with_team(episode, |commander, team| {
            if !carried {
                return Ok(());
            }
            let from = team.object(commander)?;
            let [ahead_m, left_m] = self.way_m;
            let way_m = Vector::new(ahead_m, left_m, 0.0);
            let length_m = way_m.length();
            let at =
                |gone_m: f32| Pose::from_parts(from.translation + way_m * (gone_m / length_m), from.rotation);
            team.carry(commander, &ObjectPath { at: &at, length_m, pace_m_s: PACE_M_S, free_m: &FREE })
        })
    }

    /// Grasps the object, lifts it, and calls `then`.
    pub(in crate::teams) fn with_team(
        &self,
        episode: &mut InProcess,
        then: impl FnOnce(&mut Commander, &mut CarryTeam) -> Result<(), PlayerError>,
    ) -> Result<(), PlayerError> {
        let commander = &mut Commander::new(self.task(), episode)?;
        let grasps: Vec<HandGrasp> = self
            .holders
            .iter()
            .flat_map(|(robot, places, heading_rad)| {
                HandGrasp::with_both_hands(*robot, self.object, *places, *heading_rad, self.hold)
            })
            .collect();
        let mut team = CarryTeam::new(commander, &grasps)?;
        self.set_heights(commander, 0);
        if self.reaching {
            team.gather_reaching(commander)?;
            grasp_reached(commander, &grasps)?;
            team.give_way(commander, true);
        } else {
            team.gather(commander)?;
            grasp_compliantly(commander, &grasps)?;
        }
        team.lift(commander, self.lift_m)?;
        self.set_heights(commander, 1);
        then(commander, &mut team)
    }

    fn set_heights(&self, commander: &mut Commander, which: usize) {
        for robot in self.team() {
            if let Some(pelvis_m) = self.pelvis_m {
                commander.set_height(robot, pelvis_m[which]);
            }
        }
    }
}
