//! Limits that a bench checks in every physics step: speeds, spurious energy, overlaps, joints beyond
//! their ranges.

use std::collections::{BTreeMap, VecDeque};

use serde::{Deserialize, Serialize};

use super::{Step, World};
use crate::PHYSICS_DT_S;
use crate::dynamics::{ColliderId, Diverged, Dynamics, EnergyBalance, TreeId};
use crate::robot::RobotCommand;

/// Maximum speed of a link: a fall from the ceiling ends at 7 m/s, and the fastest joints whip a hand to
/// 20 m/s.
pub const FASTEST_M_S: f64 = 25.0;
/// Maximum share of spurious energy in any [`WINDOW_S`], relative to the energy present plus the energy
/// put in.
pub const MAX_ENERGY_SHARE: f64 = 0.05;
pub const WINDOW_S: f64 = 0.2;
/// Minimum energy for computing the share: the energy that a robot of 35 kg gains in a fall of 30 cm. Pushing
/// overlapping bodies apart lifts such a robot out of the tolerated depth with less than 5 % of this energy.
pub const MIN_SCALE_J: f64 = 100.0;
/// Maximum overlap, and the maximum time for which it may be exceeded.
pub const DEEP_M: f64 = 0.02;
pub const LONGEST_DEEP_S: f64 = 0.1;
/// Maximum distance of a joint beyond its range.
pub const FARTHEST_BEYOND_RAD: f64 = 0.1;

/// The greatest value of a quantity, and the place where it occurred.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Greatest {
    pub value: f64,
    pub at: String,
}

/// The greatest values of all watched quantities, in m/s, J, shares, m, s and rad (m for slides).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extremes {
    /// Speed of a link's centre of mass.
    pub speed_m_s: Greatest,
    /// Spurious kinetic energy in a window, and its share of the energy present plus the energy put in.
    pub made_j: Greatest,
    pub made_share: Greatest,
    /// Overlap of two colliders at any time, and the time for which a pair overlapped by more than
    /// [`DEEP_M`].
    pub depth_m: Greatest,
    pub deep_s: Greatest,
    pub beyond_rad: Greatest,
    /// Speed of a joint, as a share of the speed at which its motor can push no further.
    pub joint_speed_share: Greatest,
}

/// Monitor of a world, called for every physics step.
#[derive(Default)]
pub struct Watch {
    pub extremes: Extremes,
    window: VecDeque<EnergyBalance>,
    /// Pairs that overlap by more than [`DEEP_M`], and the number of physics steps since they began to.
    deep: BTreeMap<[ColliderId; 2], u32>,
}

impl World {
    /// Runs [`World::control_step`] while `watch` checks every physics step.
    ///
    /// # Errors
    ///
    /// Returns [`Diverged`] if physics diverged.
    pub fn watched_step(&mut self, commands: &[RobotCommand], watch: &mut Watch) -> Result<Step, Diverged> {
        self.step_by(commands, |world| {
            let before = world.dynamics.energy_before();
            world.advance()?;
            watch.look(&world.dynamics, world.dynamics.energy_balance(&before));
            Ok(())
        })
    }
}

impl Greatest {
    fn see(&mut self, value: f64, at: impl FnOnce() -> String) {
        // NaN counts as greater than any number.
        if value > self.value || value.is_nan() {
            *self = Greatest { value, at: at() };
        }
    }

    /// Keeps the greater of the two values.
    pub fn join(&mut self, other: &Greatest, at: impl FnOnce(&str) -> String) {
        self.see(other.value, || at(&other.at));
    }
}

impl Extremes {
    /// Keeps the greater value of each quantity; `at` converts the places in `other`.
    pub fn join(&mut self, other: &Extremes, at: impl Fn(&str) -> String) {
        let pairs = [
            (&mut self.speed_m_s, &other.speed_m_s),
            (&mut self.made_j, &other.made_j),
            (&mut self.made_share, &other.made_share),
            (&mut self.depth_m, &other.depth_m),
            (&mut self.deep_s, &other.deep_s),
            (&mut self.beyond_rad, &other.beyond_rad),
            (&mut self.joint_speed_share, &other.joint_speed_share),
        ];
        for (mine, others) in pairs {
            mine.join(others, &at);
        }
    }

    /// Returns true for each broken limit: speed, energy, depth, range.
    pub fn broken(&self) -> [bool; 4] {
        [
            (&self.speed_m_s, FASTEST_M_S),
            (&self.made_share, MAX_ENERGY_SHARE),
            (&self.deep_s, LONGEST_DEEP_S),
            (&self.beyond_rad, FARTHEST_BEYOND_RAD),
        ]
        .map(|(greatest, limit)| greatest.value > limit || greatest.value.is_nan())
    }
}

impl Watch {
    /// Checks the result of a physics step.
    fn look(&mut self, dynamics: &Dynamics, balance: EnergyBalance) {
        for id in dynamics.tree_ids() {
            let tree = dynamics.tree(id);
            for (index, link) in tree.links().iter().enumerate() {
                let at = || format!("{}/{}", tree.name, link.name);
                self.extremes.speed_m_s.see(tree.com_velocity_m_s(index).length(), at);
                self.extremes.beyond_rad.see(tree.beyond_range(index), at);
                if let Some(share) = tree.motor_speed_share(index) {
                    self.extremes.joint_speed_share.see(share, at);
                }
            }
        }
        self.look_at_energy(dynamics, balance);
        self.look_at_overlaps(dynamics);
    }

    fn look_at_energy(&mut self, dynamics: &Dynamics, balance: EnergyBalance) {
        if self.window.len() >= (WINDOW_S / f64::from(PHYSICS_DT_S)).round() as usize {
            self.window.pop_front();
        }
        self.window.push_back(balance);
        let sum = |of: fn(&EnergyBalance) -> f64| self.window.iter().map(of).sum::<f64>();
        let made_j = sum(|step| step.made.iter().sum()) + sum(|step| step.taken).max(0.0);
        let put_in_j = self.window.front().map_or(0.0, |step| step.kinetic) + sum(|step| step.put_in);
        let most = || {
            let of_tree = |tree: &TreeId| {
                self.window.iter().filter_map(|step| step.made.get(tree.index())).sum::<f64>()
            };
            let most = dynamics.tree_ids().max_by(|a, b| of_tree(a).total_cmp(&of_tree(b)));
            let name = most.map_or("", |tree| dynamics.tree(tree).name.as_str());
            format!("{name}, of {put_in_j:.0} J")
        };
        self.extremes.made_j.see(made_j, most);
        self.extremes.made_share.see(made_j / put_in_j.max(MIN_SCALE_J), most);
    }

    fn look_at_overlaps(&mut self, dynamics: &Dynamics) {
        let mut deepest: BTreeMap<[ColliderId; 2], f64> = BTreeMap::new();
        for touch in dynamics.touches() {
            let depth_m = deepest.entry(touch.colliders).or_default();
            *depth_m = depth_m.max(-touch.gap_m);
        }
        self.deep.retain(|pair, _| deepest.get(pair).is_some_and(|depth_m| *depth_m > DEEP_M));
        for (pair, depth_m) in deepest {
            let at = || pair.map(|id| body_name(dynamics, id)).join(" in ");
            self.extremes.depth_m.see(depth_m, at);
            if depth_m > DEEP_M {
                let steps = self.deep.entry(pair).or_default();
                *steps += 1;
                self.extremes.deep_s.see(f64::from(*steps) * f64::from(PHYSICS_DT_S), at);
            }
        }
    }
}

fn body_name(dynamics: &Dynamics, id: ColliderId) -> String {
    match dynamics.collider(id).on {
        None => "the room".into(),
        Some(on) => {
            let tree = dynamics.tree(on.tree);
            format!("{}/{}", tree.name, tree.links()[on.link].name)
        }
    }
}
