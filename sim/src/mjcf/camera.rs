//! `<camera>` elements, which `mjcf-rs` skips.

use rapier3d::math::{Matrix, Pose, Rotation, Vector};

use crate::SimError;

/// A camera fixed to a body. Its axes are MuJoCo's and OpenGL's: x right, y up, looking along -z.
#[derive(Clone, Debug)]
pub struct MjcfCamera {
    pub name: String,
    /// Body it is fixed to; `None` is the world.
    pub body: Option<String>,
    pub body_from_camera: Pose,
    pub vertical_fov_rad: f32,
    /// Width and height in pixels.
    pub resolution_px: (u32, u32),
}

impl MjcfCamera {
    /// As seen from a frame in which the file's world lies at `frame_from_file`.
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

pub(super) fn parse(file: &str, xml: &str) -> Result<Vec<MjcfCamera>, SimError> {
    let document =
        roxmltree::Document::parse(xml).map_err(|source| SimError::Xml { file: file.into(), source })?;
    document.descendants().filter(|node| node.has_tag_name("camera")).map(|node| read(file, node)).collect()
}

fn read(file: &str, node: roxmltree::Node) -> Result<MjcfCamera, SimError> {
    let name = node.attribute("name").unwrap_or_default().to_string();
    let numbers = |attribute: &str, count: usize| -> Result<Option<Vec<f32>>, SimError> {
        let Some(text) = node.attribute(attribute) else { return Ok(None) };
        let values: Vec<f32> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        if values.len() != count || values.iter().any(|value| !value.is_finite()) {
            let what = format!("camera `{name}`: {attribute}=\"{text}\" should be {count} numbers");
            return Err(SimError::Unsupported { file: file.into(), what });
        }
        Ok(Some(values))
    };
    let position = numbers("pos", 3)?.map_or(Vector::ZERO, |p| Vector::new(p[0], p[1], p[2]));
    let rotation = match (numbers("quat", 4)?, numbers("xyaxes", 6)?) {
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
    let fovy_deg = numbers("fovy", 1)?.map_or(DEFAULT_FOVY_DEG, |v| v[0]);
    let resolution_px =
        numbers("resolution", 2)?.map_or(DEFAULT_RESOLUTION_PX, |v| (v[0] as u32, v[1] as u32));
    Ok(MjcfCamera {
        name,
        body: body.and_then(|body| body.attribute("name")).map(str::to_string),
        body_from_camera: Pose::from_parts(position, rotation),
        vertical_fov_rad: fovy_deg.to_radians(),
        resolution_px,
    })
}
