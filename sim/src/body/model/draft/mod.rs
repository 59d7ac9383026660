//! Drafts of descriptions of third-party MJCF. The assignment of joints, and the frames of hands and camera,
//! are guessed from the tree, and from the axes and names of its joints.

mod limbs;

use std::fmt::Write;
use std::path::Path;

use rapier3d::math::{Matrix, Rotation, Vector};

use super::fitted::main_tree;
use super::read::PALM_IN_WRIST_M;
use crate::body::layout::joint_names;
use crate::mjcf::{Document, Geom};
use crate::{Side, SimError};
use limbs::Limbs;

/// Draft of a description.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotDraft {
    /// Content of the TOML file.
    pub text: String,
    /// Parts of a robot that were not found.
    pub notes: Vec<String>,
}

/// Minimum cosine between a hand's direction and an axis of the root at which they count as parallel.
const ALONG_COSINE: f32 = 0.9;
/// Minimum length of a forearm that determines the direction of the hand.
const MIN_FOREARM_M: f32 = 0.05;
/// Minimum vertical component of a hanging hand's direction.
const MIN_UPRIGHT: f32 = 0.7;
/// Height of the camera below the top of a trunk, and of a head as a share of its height.
const BELOW_TOP_M: f32 = 0.06;
const HEAD_SHARE: f32 = 0.7;

impl RobotDraft {
    /// Drafts the description of an MJCF file, which it names as `model_name`.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be read, or has no bodies.
    pub fn of(path: &Path, model_name: &str) -> Result<RobotDraft, SimError> {
        let document = Document::read_robot(path)?;
        let trees = document.trees()?;
        let tree = main_tree(&document, &trees)?;
        let limbs = Limbs::find(tree);
        let mut text =
            format!("# Drafted from {model_name}: check which joint is which, hands and camera.\n");
        // Writing to a string cannot fail.
        let _ = writeln!(text, "model = {model_name:?}");
        draft_joints(&mut text, &limbs);
        let mut notes = limbs.notes.clone();
        for side in Side::BOTH {
            draft_wrist(&mut text, &limbs, side, &document);
        }
        if document.cameras.iter().all(|camera| camera.name != "egocentric")
            && !draft_camera(&mut text, &limbs)
        {
            notes.push("no place for a camera was found; state one in [camera]".into());
        }
        Ok(RobotDraft { text, notes })
    }
}

/// Writes the tables of joints that move and of joints that are held.
fn draft_joints(text: &mut String, limbs: &Limbs) {
    let own = |name: &String| limbs.link(*limbs.joints.get(name)?).joint.name();
    let names = joint_names().into_iter().filter_map(|name| Some((own(&name)?, name)));
    let renamed: Vec<String> =
        names.filter(|(own, name)| own != name).map(|(own, name)| format!("{name} = {own:?}")).collect();
    if !renamed.is_empty() {
        let _ = writeln!(text, "\n[joints]\n{}", renamed.join("\n"));
    }
    let held: Vec<String> = limbs
        .others()
        .filter_map(|link| {
            let [low_rad, high_rad] = link.joint.axis()?.range.unwrap_or([0.0, 0.0]);
            let held_rad = 0.0_f64.clamp(low_rad.min(high_rad), high_rad.max(low_rad));
            Some(format!("{:?} = {held_rad:?}", link.joint.name()?))
        })
        .collect();
    if !held.is_empty() {
        let _ = writeln!(text, "\n# Nothing moves these joints.\n[held_rad]\n{}", held.join("\n"));
    }
}

/// Writes the frame of a hand: its x axis points along the forearm, its z axis up or ahead.
fn draft_wrist(text: &mut String, limbs: &Limbs, side: Side, document: &Document) {
    let name = format!("{}_wrist", side.name());
    let bodies = &document.model.bodies;
    let is_given = |site: &mjcf_rs::body::Site| site.name.as_deref() == Some(&name);
    let Some(last) = limbs.arms[side].last().copied() else { return };
    if bodies.iter().any(|entry| entry.body.sites.iter().any(is_given)) {
        return;
    }
    let link = limbs.link(last);
    let root_from_link = limbs.root_from_link(last);
    let elbow = limbs.joints.get(&format!("{}_elbow_joint", side.name())).copied().unwrap_or(last);
    let forearm_m = root_from_link.translation - limbs.root_from_link(elbow).translation;
    let corners_m = bounds_m(limbs, last).unwrap_or([root_from_link.translation; 2]);
    let middle_m = (corners_m[0] + corners_m[1]) * 0.5 - root_from_link.translation;
    let along = if forearm_m.length() > MIN_FOREARM_M { forearm_m } else { middle_m };
    let along = snapped(along.normalize_or(Vector::X));
    let up = if along.z.abs() < MIN_UPRIGHT { Vector::Z } else { Vector::X * -along.z.signum() };
    let across = up.cross(along).normalize();
    let root_from_wrist = Rotation::from_mat3(&Matrix::from_cols(along, across, along.cross(across)));
    let link_from_wrist = root_from_link.rotation.inverse() * root_from_wrist;
    let [low_m, high_m] = corners_m.map(|corner_m| corner_m - root_from_link.translation);
    let tip_m = (low_m * along).max(high_m * along).element_sum();
    let beyond_m = (tip_m - PALM_IN_WRIST_M.x).max(0.0);
    let position_m = root_from_link.rotation.inverse() * (along * beyond_m);
    let [x, y, z, w] = link_from_wrist.to_array();
    let _ = writeln!(text, "\n[{name}]\nbody = {:?}", link.name);
    let _ = writeln!(text, "position_m = {}", numbers(&position_m.to_array()));
    if w.abs() < 1.0 - 1e-5 {
        let _ = writeln!(text, "quaternion_wxyz = {}", numbers(&[w, x, y, z]));
    }
}

/// Writes a camera at the front of the head, or else of the trunk. Returns false if neither has a shape.
fn draft_camera(text: &mut String, limbs: &Limbs) -> bool {
    // The camera looks along the x axis of its body.
    let is_straight = |link: &usize| (limbs.root_from_link(*link).rotation * Vector::X).x > ALONG_COSINE;
    let carriers = [limbs.head.filter(is_straight), Some(limbs.trunk)];
    let place = |link: usize| Some((link, bounds_m(limbs, link)?));
    let Some((link, [low_m, high_m])) = carriers.into_iter().flatten().find_map(place) else { return false };
    let height_m = match Some(link) == limbs.head {
        true => low_m.z + HEAD_SHARE * (high_m.z - low_m.z),
        false => high_m.z - BELOW_TOP_M,
    };
    let position_m = limbs.root_from_link(link).inverse() * Vector::new(high_m.x, 0.0, height_m);
    let _ = writeln!(text, "\n[camera]\nbody = {:?}", limbs.link(link).name);
    let _ = writeln!(text, "position_m = {}\ndown_deg = 25", numbers(&position_m.to_array()));
    true
}

/// Returns the smallest and the largest corner of a link's shapes, in the root's frame with all joints at 0.
fn bounds_m(limbs: &Limbs, link: usize) -> Option<[Vector; 2]> {
    let colliders = limbs.link(link).geoms.iter().filter_map(Geom::collider);
    let bounds = colliders.map(|(link_from_shape, shape)| {
        let bounds = shape.compute_aabb(&(limbs.root_from_link(link) * link_from_shape));
        [bounds.mins, bounds.maxs]
    });
    bounds.reduce(|[low, high], [lower, higher]| [low.min(lower), high.max(higher)])
}

/// Returns the nearest axis of the root if the direction is almost parallel to it.
fn snapped(direction: Vector) -> Vector {
    let axes = [Vector::X, Vector::Y, Vector::Z].into_iter().flat_map(|axis| [axis, -axis]);
    axes.into_iter().find(|axis| axis.dot(direction) > ALONG_COSINE).unwrap_or(direction)
}

fn numbers(values: &[f32]) -> String {
    // Zeros are written without a sign.
    let rounded = values.iter().map(|value| format!("{}", (f64::from(*value) * 1e4).round() / 1e4 + 0.0));
    format!("[{}]", rounded.collect::<Vec<_>>().join(", "))
}
