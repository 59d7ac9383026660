//! Legs, waist, arms and head of a tree, and the published names of their joints.

use std::collections::BTreeMap;

use rapier3d::math::{Pose, Vector};

use crate::body::layout::joint_names;
use crate::mjcf::{BodyLink, BodyTree, LinkJoint, pose};
use crate::{Side, Sides};

/// Minimum lateral component of the axis of a joint that bends a leg.
const MIN_LATERAL: f32 = 0.7;
/// Minimum distance from the middle at which a limb belongs to a side.
const MIN_ASIDE_M: f32 = 0.01;
/// Maximum distance of a head from the middle.
const MAX_HEAD_ASIDE_M: f32 = 0.05;
/// Maximum number of joints of an arm.
const MAX_ARM: usize = 7;
/// Parts of names of joints that move fingers.
const FINGERS: [&str; 3] = ["finger", "thumb", "grip"];

/// A tree with all joints at 0.
pub(super) struct Limbs<'a> {
    tree: &'a BodyTree,
    root_from_link: Vec<Pose>,
    /// Links by the published names of the joints that carry them.
    pub joints: BTreeMap<String, usize>,
    /// Links of each arm, from the shoulder; empty without an arm.
    pub arms: Sides<Vec<usize>>,
    /// Link that carries the arms.
    pub trunk: usize,
    /// Link of the head, if there is one above the trunk.
    pub head: Option<usize>,
    pub notes: Vec<String>,
}

/// Rotation of a joint, by its axis.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    Pitch,
    Roll,
    Yaw,
}

impl Turn {
    fn direction(self) -> Vector {
        match self {
            Turn::Pitch => Vector::Y,
            Turn::Roll => Vector::X,
            Turn::Yaw => Vector::Z,
        }
    }

    /// Returns parts of the names of joints with this rotation, each with its weight against an axis.
    fn hints(self) -> &'static [(&'static str, f32)] {
        match self {
            Turn::Pitch => &[("pitch", 2.0)],
            Turn::Roll => &[("roll", 2.0), ("aa", 0.1)],
            Turn::Yaw => &[("yaw", 2.0)],
        }
    }
}

impl<'a> Limbs<'a> {
    pub fn find(tree: &'a BodyTree) -> Limbs<'a> {
        let mut root_from_link: Vec<Pose> = Vec::new();
        for link in &tree.links {
            let placed = link
                .parent
                .map_or(Pose::IDENTITY, |parent| root_from_link[parent] * pose(&link.parent_from_link));
            root_from_link.push(placed);
        }
        let published = joint_names();
        let hinges = tree.links.iter().enumerate();
        let named = hinges.filter_map(|(link, of)| Some((of.joint.name()?.to_string(), link)));
        let joints = named.filter(|(name, _)| published.contains(name)).collect();
        let mut limbs = Limbs {
            tree,
            root_from_link,
            joints,
            arms: Sides::default(),
            trunk: 0,
            head: None,
            notes: Vec::new(),
        };
        let legs = limbs.find_legs();
        limbs.find_arms(&legs);
        limbs
    }

    pub fn root_from_link(&self, link: usize) -> Pose {
        self.root_from_link[link]
    }

    pub fn link(&self, link: usize) -> &BodyLink {
        &self.tree.links[link]
    }

    /// Returns hinges without a published name.
    pub fn others(&self) -> impl Iterator<Item = &BodyLink> {
        let links = self.tree.links.iter().enumerate().skip(1);
        links.filter(|(link, _)| !self.joints.values().any(|taken| taken == link)).map(|(_, of)| of)
    }

    fn origin_m(&self, link: usize) -> Vector {
        self.root_from_link[link].translation
    }

    fn axis(&self, link: usize) -> Vector {
        match &self.tree.links[link].joint {
            LinkJoint::Hinge(joint) | LinkJoint::Slide(joint) => {
                self.root_from_link[link].rotation * joint.axis.direction.as_vec3().normalize_or(Vector::Z)
            }
            LinkJoint::Fixed | LinkJoint::Free { .. } => Vector::ZERO,
        }
    }

    fn name(&self, link: usize) -> String {
        self.tree.links[link].joint.name().unwrap_or_default().to_lowercase()
    }

    /// Returns the links from the root to a link, without the root.
    fn path(&self, link: usize) -> Vec<usize> {
        let above = std::iter::successors(Some(link), |link| self.tree.links[*link].parent);
        let mut path: Vec<usize> = above.filter(|link| *link != 0).collect();
        path.reverse();
        path
    }

    fn children(&self, link: usize) -> usize {
        self.tree.links.iter().filter(|of| of.parent == Some(link)).count()
    }

    fn leaves(&self) -> impl Iterator<Item = usize> {
        (1..self.tree.links.len()).filter(|link| self.children(*link) == 0)
    }

    /// Returns the paths to the leaf on each side with the largest `size`, and their common part. Returns
    /// `None` if a side has no leaf.
    fn pair(
        &self,
        leaves: &[usize],
        size: impl Fn(Side, Vector) -> f32,
    ) -> Option<(Sides<Vec<usize>>, Vec<usize>)> {
        let end = |side: Side| {
            let on_side =
                leaves.iter().copied().filter(|leaf| self.origin_m(*leaf).y * side.sign() > MIN_ASIDE_M);
            on_side.max_by(|a, b| size(side, self.origin_m(*a)).total_cmp(&size(side, self.origin_m(*b))))
        };
        let paths = Sides { left: self.path(end(Side::Left)?), right: self.path(end(Side::Right)?) };
        let common = paths.left.iter().zip(&paths.right).take_while(|(left, right)| left == right).count();
        let shared = paths.left[..common].to_vec();
        Some((paths.map(|path| path[common..].to_vec()), shared))
    }

    /// Names the joints of the legs, whose feet are the lowest leaves. Returns all links of both legs.
    fn find_legs(&mut self) -> Vec<usize> {
        let leaves: Vec<usize> = self.leaves().collect();
        let Some((legs, _)) = self.pair(&leaves, |_, end_m| -end_m.z) else {
            self.notes.push("two legs were not found".into());
            return Vec::new();
        };
        for (side, leg) in legs.each_ref().by_side() {
            let lateral: Vec<usize> =
                leg.iter().copied().filter(|link| self.axis(*link).y.abs() > MIN_LATERAL).collect();
            let [hip, knee, ankle, ..] = lateral[..] else {
                let side = side.name();
                self.notes.push(format!(
                    "the {side} leg has {} joints that bend it: a hip, a knee and an ankle are needed",
                    lateral.len()
                ));
                continue;
            };
            let others = |part: &dyn Fn(usize) -> bool| -> Vec<usize> {
                let of_part = leg.iter().copied().filter(|link| !lateral.contains(link) && part(*link));
                of_part.collect()
            };
            let (hips, ankles) = (others(&|link| link < knee), others(&|link| link > knee));
            for (part, link) in [("hip_pitch", hip), ("knee", knee), ("ankle_pitch", ankle)] {
                self.give(side, part, link);
            }
            self.give_turns(side, "hip", &hips, &[Turn::Roll, Turn::Yaw]);
            self.give_turns(side, "ankle", &ankles, &[Turn::Roll]);
        }
        legs.left.into_iter().chain(legs.right).collect()
    }

    /// Names the joints of the waist and the arms, whose hands are the outermost leaves except for the feet.
    fn find_arms(&mut self, legs: &[usize]) {
        let leaves: Vec<usize> = self.leaves().filter(|leaf| !legs.contains(leaf)).collect();
        let is_middle = |leaf: &usize| self.origin_m(*leaf).y.abs() < MAX_HEAD_ASIDE_M;
        let highest = leaves.iter().copied().filter(is_middle);
        let highest = highest.max_by(|a, b| self.origin_m(*a).z.total_cmp(&self.origin_m(*b).z));
        self.head = highest.filter(|head| self.origin_m(*head).z > 0.0);
        let Some((arms, waist)) = self.pair(&leaves, |side, end_m| end_m.y * side.sign()) else {
            self.notes.push("two arms were not found".into());
            return;
        };
        self.trunk = waist.last().copied().unwrap_or_default();
        let waist: Vec<usize> = waist.into_iter().filter(|link| !legs.contains(link)).collect();
        for (turn, link) in self.turns(&waist, &[Turn::Yaw, Turn::Roll, Turn::Pitch]) {
            self.give_name(format!("waist_{}_joint", word(turn)), link);
        }
        for (side, arm) in arms.by_side() {
            let arm = self.without_fingers(arm);
            self.name_arm(side, &arm);
            self.arms[side] = arm;
        }
    }

    /// Returns the links of an arm up to the hand: where the arm branches, or names of fingers begin.
    fn without_fingers(&self, arm: Vec<usize>) -> Vec<usize> {
        let is_finger = |link: &usize| FINGERS.iter().any(|finger| self.name(*link).contains(finger));
        let branch = arm.iter().position(|link| self.children(*link) > 1).map_or(arm.len(), |at| at + 1);
        let finger = arm.iter().position(is_finger).unwrap_or(arm.len());
        arm[..branch.min(finger).min(MAX_ARM)].to_vec()
    }

    fn name_arm(&mut self, side: Side, arm: &[usize]) {
        let shoulders = match arm.len() {
            0..=2 => arm.len(),
            3 => 2,
            _ => 3,
        };
        self.give_turns(side, "shoulder", &arm[..shoulders], &[Turn::Pitch, Turn::Roll, Turn::Yaw]);
        if let Some(elbow) = arm.get(shoulders) {
            self.give(side, "elbow", *elbow);
            self.give_turns(side, "wrist", &arm[shoulders + 1..], &[Turn::Roll, Turn::Pitch, Turn::Yaw]);
        }
    }

    fn give_turns(&mut self, side: Side, part: &str, links: &[usize], turns: &[Turn]) {
        for (turn, link) in self.turns(links, turns) {
            self.give(side, &format!("{part}_{}", word(turn)), link);
        }
    }

    fn give(&mut self, side: Side, part: &str, link: usize) {
        self.give_name(format!("{}_{part}_joint", side.name()), link);
    }

    /// Gives a joint a published name, unless it already has one or another joint has this name.
    fn give_name(&mut self, name: String, link: usize) {
        if !self.joints.values().any(|taken| *taken == link) {
            self.joints.entry(name).or_insert(link);
        }
    }

    /// Returns the turns that fit the first links best, by axes and names; at equal fits in the order of
    /// `turns`.
    fn turns(&self, links: &[usize], turns: &[Turn]) -> Vec<(Turn, usize)> {
        let count = links.len().min(turns.len());
        let mut best: (f32, Vec<(Turn, usize)>) = (f32::NEG_INFINITY, Vec::new());
        for choice in choices(count, turns.len()) {
            let given: Vec<(Turn, usize)> =
                choice.into_iter().zip(links).map(|(turn, link)| (turns[turn], *link)).collect();
            let fit = given.iter().map(|(turn, link)| self.fit(*link, *turn)).sum::<f32>();
            // Rounding of axes does not count.
            if fit > best.0 + 1e-3 {
                best = (fit, given);
            }
        }
        best.1
    }

    fn fit(&self, link: usize, turn: Turn) -> f32 {
        let name = self.name(link);
        let hints = turn.hints().iter().filter(|(part, _)| name.contains(part)).map(|(_, weight)| *weight);
        self.axis(link).dot(turn.direction()).abs() + hints.sum::<f32>()
    }
}

/// Returns all ways to choose `count` different numbers below `of`, in their order.
fn choices(count: usize, of: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..count {
        let longer = |choice: Vec<usize>| {
            let free: Vec<usize> = (0..of).filter(|number| !choice.contains(number)).collect();
            free.into_iter().map(move |number| [choice.clone(), vec![number]].concat())
        };
        all = all.into_iter().flat_map(longer).collect();
    }
    all
}

fn word(turn: Turn) -> &'static str {
    match turn {
        Turn::Pitch => "pitch",
        Turn::Roll => "roll",
        Turn::Yaw => "yaw",
    }
}
