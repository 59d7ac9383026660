//! Joints of bodies and their actuators, as plain data.

use mjcf_rs::Tristate;
use mjcf_rs::body::JointType;
use mjcf_rs::extras::{Actuator as ActuatorElement, ActuatorKind as Kind};
use rapier3d::glamx::DVec3;

use std::collections::BTreeMap;

use super::Document;
use super::text::source::MjcfText;
use super::text::stated::Classes;
use crate::SimError;
use crate::dynamics::Axis;

/// Joint of a body relative to its parent.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkJoint {
    Fixed,
    /// Allowed only on a top-level body.
    Free {
        name: String,
    },
    Hinge(AxisJoint),
    Slide(AxisJoint),
}

/// A joint of one degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisJoint {
    pub name: String,
    /// Axis without an effort limit, which is part of the actuator. The joint position is 0 where the file
    /// places the bodies.
    pub axis: Axis,
    /// Joint position in the file's coordinates where the file places the bodies: its `ref`.
    pub placed_at: f64,
}

/// Actuator of one hinge or slide. Efforts are in N m or N, positions in rad or m.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    pub joint: String,
    pub kind: ActuatorKind,
    /// Range to which commands are clamped.
    pub control_range: Option<[f64; 2]>,
    pub effort_range: Option<[f64; 2]>,
    /// Speed (rad/s or m/s) at which the actuator exerts no effort in the direction of motion.
    pub speed_limit: Option<f64>,
    /// Factor on the commands of a motor (with its gain), and divisor of position commands.
    pub gear: f64,
    /// Joint position in the file's coordinates where the file places the bodies: the `ref` of the joint.
    pub placed_at: f64,
    /// Index among all actuators of the file, some of which have no effect.
    pub index: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ActuatorKind {
    /// Exerts the commanded effort.
    Motor,
    /// Exerts kp (command - q) - kd q'.
    Position { kp: f64, kd: f64 },
}

/// Name of the `<numeric>` with the speed limits of a file's motors, in the order of its actuators. MJCF
/// has no other place for them, and MuJoCo ignores it.
const SPEED_LIMITS: &str = "actuator_speed_limit";

pub(super) fn speed_limits(source: &MjcfText) -> Result<Option<Vec<f64>>, SimError> {
    let xml = source.xml()?;
    let mut numerics = xml.descendants().filter(|node| node.has_tag_name("numeric"));
    let limits = numerics.find(|node| node.attribute("name") == Some(SPEED_LIMITS));
    // The support table has accepted only numbers.
    let words = |node: roxmltree::Node| {
        let words = node.attribute("data").unwrap_or_default().split_ascii_whitespace();
        words.filter_map(|word| word.parse().ok()).collect()
    };
    Ok(limits.map(words))
}

/// Ranges that `mjcf-rs` does not read, by joint name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct UnreadRanges {
    /// `actuatorfrcrange` of a joint: the limits of the total effort of all actuators on it.
    effort: BTreeMap<String, [f64; 2]>,
    /// `inheritrange` of a position actuator: the width of its `ctrlrange` as a multiple of the joint's
    /// range.
    inherited_share: BTreeMap<String, f64>,
}

impl UnreadRanges {
    pub fn of(source: &MjcfText) -> Result<UnreadRanges, SimError> {
        let xml = source.xml()?;
        let classes = Classes::of(&xml);
        let mut found = UnreadRanges::default();
        let acts = |node: &roxmltree::Node| {
            node.ancestors().any(|one| one.has_tag_name("worldbody") || one.has_tag_name("actuator"))
        };
        for node in xml.descendants().filter(acts) {
            // The support table has accepted only numbers.
            let numbers = |attribute: &str| -> Vec<f64> {
                let words = classes.stated(&node, attribute).unwrap_or_default().split_ascii_whitespace();
                words.filter_map(|word| word.parse().ok()).collect()
            };
            if node.has_tag_name("joint")
                && let Some(name) = node.attribute("name")
                && let [low, high] = numbers("actuatorfrcrange")[..]
                && classes.stated(&node, "actuatorfrclimited") != Some("false")
            {
                found.effort.insert(name.into(), [low, high]);
            }
            if node.has_tag_name("position")
                && let Some(joint) = node.attribute("joint")
                && let [share] = numbers("inheritrange")[..]
                && share > 0.0
            {
                found.inherited_share.insert(joint.into(), share);
            }
        }
        Ok(found)
    }
}

/// Effort of an actuator as a function of its command, without its gear.
enum Law {
    Motor { gain: f64 },
    Position { kp: f64, kd: f64 },
}

/// Returns the law of an actuator. Returns `None` for an unsupported actuator, which has no effect.
fn law(element: &ActuatorElement) -> Option<Law> {
    match element.kind {
        Kind::Motor => Some(Law::Motor { gain: 1.0 }),
        Kind::Position => {
            Some(Law::Position { kp: element.kp.unwrap_or(1.0), kd: element.kv.unwrap_or(0.0) })
        }
        Kind::General => general_law(element),
        Kind::Velocity | Kind::IntVelocity | Kind::Damper | Kind::Other => None,
    }
}

/// Returns the law of a `<general>` that is a motor or a position actuator. MuJoCo's force is gain * control
/// + bias, with a bias of b0 + b1 q + b2 q' if it is affine.
fn general_law(element: &ActuatorElement) -> Option<Law> {
    let is = |stated: &Option<String>, usual: &str| stated.as_deref().unwrap_or(usual) == usual;
    if !is(&element.gain_type, "fixed") || !is(&element.dyn_type, "none") {
        return None;
    }
    let number = |numbers: &[f64], at: usize, usual: f64| numbers.get(at).copied().unwrap_or(usual);
    let gain = number(&element.gainprm, 0, 1.0);
    let [b0, b1, b2] = [0, 1, 2].map(|at| number(&element.biasprm, at, 0.0));
    match element.bias_type.as_deref() {
        None | Some("none") => Some(Law::Motor { gain }),
        Some("affine") if b0 == 0.0 && b1 == -gain && gain > 0.0 && b2 <= 0.0 => {
            Some(Law::Position { kp: gain, kd: -b2 })
        }
        Some(_) => None,
    }
}

impl Document {
    /// Returns true if the file has a `<general>` without effect.
    pub(super) fn has_idle_actuators(&self) -> bool {
        let idle = |element: &ActuatorElement| element.kind == Kind::General && law(element).is_none();
        self.model.actuators.iter().any(idle)
    }
}

impl LinkJoint {
    pub fn name(&self) -> Option<&str> {
        match self {
            LinkJoint::Fixed => None,
            LinkJoint::Free { name } => Some(name),
            LinkJoint::Hinge(joint) | LinkJoint::Slide(joint) => Some(&joint.name),
        }
    }

    pub fn axis(&self) -> Option<&Axis> {
        match self {
            LinkJoint::Fixed | LinkJoint::Free { .. } => None,
            LinkJoint::Hinge(joint) | LinkJoint::Slide(joint) => Some(&joint.axis),
        }
    }

    /// Returns the number of elements in MuJoCo's `qvel`.
    pub fn freedoms(&self) -> usize {
        match self {
            LinkJoint::Fixed => 0,
            LinkJoint::Free { .. } => 6,
            LinkJoint::Hinge(_) | LinkJoint::Slide(_) => 1,
        }
    }

    /// Returns the number of elements in MuJoCo's `qpos`: a free joint has a position and a quaternion.
    pub fn coordinates(&self) -> usize {
        match self {
            LinkJoint::Fixed => 0,
            LinkJoint::Free { .. } => 7,
            LinkJoint::Hinge(_) | LinkJoint::Slide(_) => 1,
        }
    }
}

impl Document {
    pub fn actuators(&self) -> Result<Vec<Actuator>, SimError> {
        let elements = &self.model.actuators;
        let limits = &self.speed_limit_values;
        if let Some(limits) = limits.as_ref().filter(|limits| limits.len() != elements.len()) {
            let (have, takes) = (limits.len(), elements.len());
            let what = format!(
                "numeric `{SPEED_LIMITS}` has {have} numbers; it takes {takes}, one for each actuator"
            );
            return Err(self.unsupported(what));
        }
        let limit = |index: usize| limits.as_ref().map(|limits| limits[index]);
        let acts = |element: &ActuatorElement| {
            law(element).is_some() && element.joint.is_some() && element.gear[0] != 0.0
        };
        let acting = elements.iter().enumerate().filter(|(_, element)| acts(element));
        acting.map(|(index, element)| self.actuator(index, element, limit(index))).collect()
    }

    /// Reads an actuator. Gains and efforts are converted to those of the joint: a gear g multiplies efforts
    /// by g and position gains by g^2.
    fn actuator(
        &self,
        index: usize,
        element: &ActuatorElement,
        speed_limit: Option<f64>,
    ) -> Result<Actuator, SimError> {
        let joint = element.joint.clone().unwrap_or_default();
        self.axis_joint(&joint)?;
        let gear = element.gear[0];
        let (kind, gain) = match law(element) {
            Some(Law::Position { kp, kd }) => {
                (ActuatorKind::Position { kp: gear * gear * kp, kd: gear * gear * kd }, 1.0)
            }
            Some(Law::Motor { gain }) => (ActuatorKind::Motor, gain),
            None => (ActuatorKind::Motor, 0.0),
        };
        let limits = |what: &str, limited, range| {
            let limits = self.limits(what, limited, range);
            limits.map_err(|what| self.unsupported(format!("actuator of joint `{joint}`: {what}")))
        };
        let effort_range = limits("force", element.force_limited, element.force_range)?.map(|[low, high]| {
            let (low, high) = (low * gear, high * gear);
            [low.min(high), low.max(high)]
        });
        if let Some(limit) = speed_limit.filter(|limit| *limit <= 0.0 || effort_range.is_none()) {
            let what = format!(
                "actuator of joint `{joint}`: a speed limit of {limit}; it has to be above 0, and needs a forcerange"
            );
            return Err(self.unsupported(what));
        }
        let own_range = limits("ctrl", element.ctrl_limited, element.ctrl_range)?;
        Ok(Actuator {
            control_range: own_range.or(self.inherited_range(&joint)?),
            effort_range: self.effort_range(&joint, effort_range),
            speed_limit,
            kind,
            gear: gear * gain,
            placed_at: self.axis_joint(&joint)?.ref_,
            index,
            joint,
        })
    }

    /// Returns the range of efforts on a joint. Both the joint and an actuator may limit it.
    pub fn effort_range(&self, joint: &str, of_actuator: Option<[f64; 2]>) -> Option<[f64; 2]> {
        match (self.unread.effort.get(joint), of_actuator) {
            (Some([low, high]), Some([least, most])) => Some([low.max(least), high.min(most)]),
            (own, of_actuator) => own.copied().or(of_actuator),
        }
    }

    /// Returns the range of commands that a position actuator inherits from its joint.
    fn inherited_range(&self, joint: &str) -> Result<Option<[f64; 2]>, SimError> {
        let Some(share) = self.unread.inherited_share.get(joint) else { return Ok(None) };
        let [low, high] = self.axis_joint(joint)?.range.ok_or_else(|| {
            self.unsupported(format!("actuator of joint `{joint}` inherits a range that the joint has not"))
        })?;
        let (middle, half) = (0.5 * (low + high), 0.5 * share * (high - low));
        Ok(Some([middle - half, middle + half]))
    }

    /// Finds a hinge or slide by name.
    pub(super) fn axis_joint(&self, name: &str) -> Result<&mjcf_rs::body::Joint, SimError> {
        let axes = || {
            let joints = self.model.bodies.iter().flat_map(|entry| &entry.body.joints);
            joints.filter(|joint| matches!(joint.type_, JointType::Hinge | JointType::Slide))
        };
        axes().find(|joint| joint.name.as_deref() == Some(name)).ok_or_else(|| {
            let have = axes().filter_map(|joint| joint.name.as_deref()).collect::<Vec<_>>().join(", ");
            self.unsupported(format!("no hinge or slide `{name}`; have: {have}"))
        })
    }
}

impl Document {
    /// Returns the joint of a body.
    pub(super) fn joint(&self, body: usize) -> Result<LinkJoint, SimError> {
        let entry = &self.model.bodies[body];
        let joint = match entry.body.joints.as_slice() {
            [] => return Ok(LinkJoint::Fixed),
            [joint] => joint,
            _ => return Err(self.refuse_body(body, "a free body has no other joint")),
        };
        let refuse = |what: &str| self.source.refuse_at(self.checked.bodies[body].joints[0], what);
        let name = joint.name.clone().unwrap_or_default();
        match joint.type_ {
            JointType::Free if entry.parent != Some(0) => {
                Err(refuse("a free body lies in another; move it to the top level"))
            }
            JointType::Free => Ok(LinkJoint::Free { name }),
            JointType::Slide => Ok(LinkJoint::Slide(self.axis(name, joint).map_err(|what| refuse(&what))?)),
            // Ball joints have been split into hinges.
            JointType::Hinge | JointType::Ball => {
                Ok(LinkJoint::Hinge(self.axis(name, joint).map_err(|what| refuse(&what))?))
            }
        }
    }

    fn axis(&self, name: String, joint: &mjcf_rs::body::Joint) -> Result<AxisJoint, String> {
        let axis = Axis {
            anchor_m: DVec3::from_array(joint.pos),
            armature: joint.armature,
            friction_loss: joint.frictionloss,
            damping: joint.damping,
            stiffness: joint.stiffness,
            spring_rest: joint.springref - joint.ref_,
            range: self.limits("", joint.limited, joint.range)?.map(|ends| ends.map(|end| end - joint.ref_)),
            ..Axis::along(DVec3::from_array(joint.axis))
        };
        Ok(AxisJoint { name, axis, placed_at: joint.ref_ })
    }

    /// Returns a range if it is in effect; `what` is the name of the limited quantity.
    fn limits(
        &self,
        what: &str,
        limited: Tristate,
        range: Option<[f64; 2]>,
    ) -> Result<Option<[f64; 2]>, String> {
        let autolimits = self.model.compiler.autolimits;
        match (limited, range) {
            (Tristate::True, None) => Err(format!("{what}limited=\"true\" needs a {what}range")),
            (Tristate::Auto, Some(_)) if !autolimits => {
                Err(format!("it has a {what}range; state {what}limited, or autolimits=\"true\""))
            }
            (_, Some([low, high])) if low >= high && limited.resolve(autolimits, true) => Err(format!(
                "{what}range=\"{low} {high}\" has its smaller number second, or one number twice"
            )),
            (limited, range) => Ok(range.filter(|_| limited.resolve(autolimits, true))),
        }
    }
}
