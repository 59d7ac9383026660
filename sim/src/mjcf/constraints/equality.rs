//! Constraints of a file on pairs of joints or bodies: couplings, welds, pins, and bodies that never touch.

use mjcf_rs::equality::Equality as Element;
use rapier3d::glamx::{DPose3, DVec3};

use crate::SimError;
use crate::mjcf::Document;

#[derive(Clone, Debug, PartialEq)]
pub struct EqualityConstraint {
    /// Name in the file; empty if there is none.
    pub name: String,
    /// True if the constraint holds from the beginning.
    pub active: bool,
    pub kind: EqualityKind,
}

#[derive(Clone, Debug, PartialEq)]
pub enum EqualityKind {
    /// q = a_0 + a_1 p + a_2 p^2 + a_3 p^3 + a_4 p^4 with q of `joint` and p of `other`; without
    /// `other`, p is 0.
    Coupling { joint: String, other: Option<String>, coefficients: [f64; 5] },
    /// `body` keeps its pose in `other`, or in the world.
    Weld {
        body: String,
        other: Option<String>,
        /// Pose of `other` in `body`; `None` for the poses in the file.
        body_from_other: Option<DPose3>,
    },
    /// A point of `body` keeps its place in `other`, or in the world.
    Pin { body: String, other: Option<String>, anchor_in_body_m: DVec3 },
}

impl Document {
    pub fn equalities(&self) -> Result<Vec<EqualityConstraint>, SimError> {
        self.model.equality.iter().map(|element| self.equality(element)).collect()
    }

    fn equality(&self, element: &Element) -> Result<EqualityConstraint, SimError> {
        let (common, kind) = match element {
            Element::Joint(coupling) => {
                let joint = self.known_axis(&coupling.joint1)?;
                let other = coupling.joint2.as_deref().map(|name| self.known_axis(name)).transpose()?;
                let coefficients = coupling.polycoef;
                (&coupling.common, EqualityKind::Coupling { joint, other, coefficients })
            }
            Element::Weld(weld) => {
                let body = self.known_body(&weld.body1)?;
                let other = weld.body2.as_deref().map(|name| self.known_body(name)).transpose()?;
                // MuJoCo's default is a quaternion of 0, which means "as placed".
                let body_from_other = weld.relpose.filter(|pose| pose.rotation.length_squared() > 0.0);
                let body_from_other = body_from_other
                    .map(|pose| DPose3::from_parts(pose.translation, pose.rotation.normalize()));
                (&weld.common, EqualityKind::Weld { body, other, body_from_other })
            }
            Element::Connect(pin) => {
                let body = self.known_body(&pin.body1)?;
                let other = pin.body2.as_deref().map(|name| self.known_body(name)).transpose()?;
                let anchor_in_body_m = DVec3::from_array(pin.anchor);
                (&pin.common, EqualityKind::Pin { body, other, anchor_in_body_m })
            }
            Element::Tendon(_) => {
                let what = "equality of tendons; use joint, weld or connect";
                return Err(self.unsupported(what));
            }
        };
        Ok(EqualityConstraint { name: common.name.clone().unwrap_or_default(), active: common.active, kind })
    }

    /// Returns pairs of bodies that never touch.
    pub fn exclusions(&self) -> Result<Vec<[String; 2]>, SimError> {
        let named = |name: &str| match self.model.body_id_by_name(name) {
            None if name == "world" => Ok(name.to_string()),
            Some(_) => Ok(name.to_string()),
            None => Err(self.unsupported(format!("exclude of `{name}`, which is no body"))),
        };
        let pairs = self.model.contact.excludes.iter();
        pairs.map(|pair| Ok([named(&pair.body1)?, named(&pair.body2)?])).collect()
    }

    fn known_body(&self, name: &str) -> Result<String, SimError> {
        match self.model.body_id_by_name(name) {
            Some(_) => Ok(name.into()),
            None => {
                let have = self.model.bodies_iter().filter_map(|(_, entry)| entry.body.name.as_deref());
                let have = have.collect::<Vec<_>>().join(", ");
                Err(self.unsupported(format!("equality of unknown body `{name}`; have: {have}")))
            }
        }
    }

    fn known_axis(&self, name: &str) -> Result<String, SimError> {
        self.axis_joint(name).map(|_| name.into())
    }
}
