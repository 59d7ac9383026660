//! Named frames of a file, which other code refers to: sites, which are points or regions, and cameras.

use rapier3d::math::{Matrix, Pose, Rotation, Vector};

use super::text::source::MjcfText;
use super::{pose, vector};
use crate::SimError;

/// A named point of a body, or a region around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    pub name: String,
    pub body_from_site: Pose,
    /// MJCF's `size`: the radius of a sphere; the radius and half the length of a cylinder (along z);
    /// half the extents of a box.
    pub size_m: Vector,
}

impl Site {
    pub(crate) fn read(site: &mjcf_rs::body::Site) -> Site {
        Site {
            name: site.name.clone().unwrap_or_default(),
            body_from_site: pose(&site.pose),
            size_m: vector(site.size),
        }
    }

    /// Returns the point in the body's frame.
    pub fn position_m(&self) -> Vector {
        self.body_from_site.translation
    }

    /// Returns the radius of a sphere or a cylinder.
    pub fn radius_m(&self) -> f32 {
        self.size_m.x
    }

    /// Returns the smallest and largest corner, in the body's frame, of a box aligned with its axes.
    pub fn corners_m(&self) -> [Vector; 2] {
        [self.position_m() - self.size_m, self.position_m() + self.size_m]
    }
}

/// A camera fixed to a body. Its axes are MuJoCo's and OpenGL's: x right, y up, looking along -z.
#[derive(Clone, Debug)]
pub struct MjcfCamera {
    pub name: String,
    /// Body that the camera is fixed to; `None` is the world.
    pub body: Option<String>,
    pub body_from_camera: Pose,
    pub vertical_fov_rad: f32,
    /// Width and height in pixels.
    pub resolution_px: (u32, u32),
}

impl MjcfCamera {
    /// Returns the same camera in a frame in which the file's world has the pose `frame_from_file`.
    pub fn moved(&self, frame_from_file: &Pose) -> MjcfCamera {
        let body_from_camera = match self.body {
            Some(_) => self.body_from_camera,
            None => *frame_from_file * self.body_from_camera,
        };
        MjcfCamera { body_from_camera, ..self.clone() }
    }
}

/// MuJoCo's default `fovy`.
const DEFAULT_FOVY_DEG: f32 = 45.0;
const DEFAULT_RESOLUTION_PX: (u32, u32) = (320, 240);

/// Reads the cameras. A camera that the program uses is refused if it cannot be read, unless `may_lack`.
pub(super) fn cameras(source: &MjcfText, may_lack: bool) -> Result<Vec<MjcfCamera>, SimError> {
    let xml = source.xml()?;
    let mut found = Vec::new();
    for node in xml.descendants().filter(|node| node.has_tag_name("camera")) {
        let is_used = node.attribute("name").is_some_and(|name| USED.contains(&name));
        match unreadable(&node) {
            Some(what) if is_used && !may_lack => return Err(source.refuse(&node, what)),
            Some(_) => {}
            None => found.push(camera(&node)),
        }
    }
    Ok(found)
}

/// Names of the cameras that the program uses.
const USED: [&str; 2] = ["third_person", "egocentric"];

/// Returns the advice for a camera that cannot be read. Returns `None` for a readable camera.
fn unreadable(node: &roxmltree::Node) -> Option<&'static str> {
    let has = |names: &[&str]| names.iter().any(|name| node.has_attribute(*name));
    let parent = node.parent()?;
    if !parent.has_tag_name("body") && !parent.has_tag_name("worldbody") {
        return Some("state everything on the camera itself, outside of frames and classes");
    }
    if parent.has_tag_name("body") && !parent.has_attribute("name") {
        return Some("name the body that carries it");
    }
    if has(&["axisangle", "euler", "zaxis"]) {
        return Some("use quat or xyaxes");
    }
    has(&["focal", "focalpixel", "principal", "principalpixel", "sensorsize"]).then_some("use fovy")
}

fn camera(node: &roxmltree::Node) -> MjcfCamera {
    // The number of values and their finiteness have been checked.
    let numbers = |attribute: &str| -> Option<Vec<f32>> {
        let words = node.attribute(attribute)?.split_whitespace();
        Some(words.filter_map(|word| word.parse().ok()).collect())
    };
    let position = numbers("pos").map_or(Vector::ZERO, |p| Vector::new(p[0], p[1], p[2]));
    let rotation = match (numbers("quat"), numbers("xyaxes")) {
        (Some(q), _) => Rotation::from_xyzw(q[1], q[2], q[3], q[0]).normalize(),
        (None, Some(a)) => {
            let x = Vector::new(a[0], a[1], a[2]).normalize();
            let y = Vector::new(a[3], a[4], a[5]);
            let y = (y - x * x.dot(y)).normalize();
            Rotation::from_mat3(&Matrix::from_cols(x, y, x.cross(y)))
        }
        (None, None) => Rotation::IDENTITY,
    };
    let body = node.parent().filter(|parent| parent.has_tag_name("body"));
    let fovy_deg = numbers("fovy").map_or(DEFAULT_FOVY_DEG, |v| v[0]);
    let resolution_px = numbers("resolution").map_or(DEFAULT_RESOLUTION_PX, |v| (v[0] as u32, v[1] as u32));
    MjcfCamera {
        name: node.attribute("name").unwrap_or_default().to_string(),
        body: body.and_then(|body| body.attribute("name")).map(str::to_string),
        body_from_camera: Pose::from_parts(position, rotation),
        vertical_fov_rad: fovy_deg.to_radians(),
        resolution_px,
    }
}
