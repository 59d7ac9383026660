//! Lights of a file: its `<light>` elements, and the headlight of `<visual>`.

use rapier3d::math::{Pose, Rotation, Vector};
use roxmltree::Node;

use super::Document;
use super::text::source::MjcfText;
use super::text::stated::Classes;
use crate::SimError;

/// Lights of a file. As in MuJoCo, light colours multiply surface colours directly, without conversion to
/// linear light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileLights {
    pub headlight: Headlight,
    /// At most [`MAX_LIGHTS`]; lights that are not active are left out.
    pub lights: Vec<FileLight>,
}

/// Directional light along the camera's optical axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Headlight {
    pub ambient_rgb: Vector,
    pub diffuse_rgb: Vector,
    pub specular_rgb: Vector,
}

/// A light fixed to a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileLight {
    pub kind: LightKind,
    /// Index of the body; 0 is the world.
    pub(crate) body: usize,
    /// Position in the frame of the body, or of the body that this one is part of.
    pub position_m: Vector,
    /// Unit vector of the light's direction.
    pub direction: Vector,
    pub ambient_rgb: Vector,
    pub diffuse_rgb: Vector,
    pub specular_rgb: Vector,
    /// Constant, linear and quadratic coefficients of the distance (m) in the divisor of the light.
    pub attenuation_values: [f32; 3],
    /// Angle from the direction beyond which a spot emits no light.
    pub cutoff_rad: f32,
    /// Exponent of the cosine of that angle.
    pub exponent_value: f32,
    pub casts_shadow: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightKind {
    Directional,
    Spot,
    /// Shines in all directions.
    Point,
}

/// Maximum number of lights, as in MuJoCo's renderer, whose headlight is one of eight.
pub const MAX_LIGHTS: usize = 7;

impl Default for Headlight {
    /// Returns MuJoCo's default.
    fn default() -> Headlight {
        let grey = Vector::splat;
        Headlight { ambient_rgb: grey(0.1), diffuse_rgb: grey(0.4), specular_rgb: grey(0.5) }
    }
}

impl Headlight {
    const DARK: Headlight =
        Headlight { ambient_rgb: Vector::ZERO, diffuse_rgb: Vector::ZERO, specular_rgb: Vector::ZERO };

    fn of(node: Option<&Node>) -> Headlight {
        let usual = Headlight::default();
        let Some(node) = node else { return usual };
        let is_active = node.attribute("active").is_none_or(|active| active.trim() != "0");
        let stated = |name: &str, usual: Vector| vector(node.attribute(name)).unwrap_or(usual);
        match is_active {
            false => Headlight::DARK,
            true => Headlight {
                ambient_rgb: stated("ambient", usual.ambient_rgb),
                diffuse_rgb: stated("diffuse", usual.diffuse_rgb),
                specular_rgb: stated("specular", usual.specular_rgb),
            },
        }
    }
}

impl FileLight {
    /// Returns the light in another frame, in which the light's present frame has the pose `frame_from_own`.
    pub(crate) fn moved(&self, frame_from_own: &Pose) -> FileLight {
        FileLight {
            position_m: *frame_from_own * self.position_m,
            direction: frame_from_own.rotation * self.direction,
            ..*self
        }
    }

    /// Returns the light aimed at the initial position of a body.
    fn aimed(self, model: &mjcf_rs::Model, target: usize) -> FileLight {
        let own_from_world = world_from_body(model, self.body).inverse();
        let target_m = own_from_world * world_from_body(model, target).translation;
        FileLight { direction: (target_m - self.position_m).normalize_or(self.direction), ..self }
    }

    fn of<'a, 'i: 'a>(node: &Node<'a, 'i>, classes: &Classes<'a, 'i>, body: usize) -> FileLight {
        let stated = |name: &str| classes.stated(node, name);
        let rgb = |name: &str, usual: f32| vector(stated(name)).unwrap_or(Vector::splat(usual));
        let number = |name: &str, usual: f32| numbers(stated(name)).first().copied().unwrap_or(usual);
        let kind = match (stated("type"), stated("directional")) {
            (Some("directional"), _) | (None, Some("true")) => LightKind::Directional,
            (Some("point"), _) => LightKind::Point,
            _ => LightKind::Spot,
        };
        let light = FileLight {
            kind,
            body,
            position_m: rgb("pos", 0.0),
            direction: vector(stated("dir")).unwrap_or(Vector::NEG_Z).normalize_or(Vector::NEG_Z),
            ambient_rgb: rgb("ambient", 0.0),
            diffuse_rgb: rgb("diffuse", 0.7),
            specular_rgb: rgb("specular", 0.3),
            attenuation_values: vector(stated("attenuation")).unwrap_or(Vector::X).to_array(),
            cutoff_rad: number("cutoff", 45.0).to_radians(),
            exponent_value: number("exponent", 10.0),
            casts_shadow: stated("castshadow") != Some("false"),
        };
        let is_body = |one: &Node| ["worldbody", "body"].contains(&one.tag_name().name());
        let frames = node.ancestors().skip(1).take_while(|one| !is_body(one));
        frames.fold(light, |light, frame| light.moved(&pose(&frame)))
    }
}

/// Returns the lights of a file. Returns `None` if the file has neither lights nor a headlight. `bodies` has
/// the positions in the text at which the bodies begin. For a body that was split, it is the position of the
/// last part.
pub(super) fn lights(
    source: &MjcfText,
    model: &mjcf_rs::Model,
    bodies: &[usize],
) -> Result<Option<FileLights>, SimError> {
    let xml = source.xml()?;
    let classes = Classes::of(&xml);
    let in_tree = |node: &Node| node.ancestors().any(|one| one.has_tag_name("worldbody"));
    let found: Vec<Node> =
        xml.descendants().filter(|node| node.has_tag_name("light")).filter(in_tree).collect();
    let headlight = xml.descendants().rfind(|node| node.has_tag_name("headlight"));
    if found.is_empty() && headlight.is_none() {
        return Ok(None);
    }
    let is_drawn = |node: &&Node| {
        classes.stated(node, "active") != Some("false") && classes.stated(node, "type") != Some("image")
    };
    let light = |node: &Node| {
        let carrier = node.ancestors().find(|one| one.has_tag_name("body"));
        let starts_there = |body: &Node| bodies.iter().rposition(|byte| *byte == body.range().start);
        let light = FileLight::of(node, &classes, carrier.as_ref().and_then(starts_there).unwrap_or(0));
        let is_aimed = classes.stated(node, "mode").is_some_and(|mode| mode.starts_with("targetbody"));
        let target = classes.stated(node, "target").filter(|_| is_aimed);
        let is_target = |entry: &mjcf_rs::BodyEntry| entry.body.name.as_deref() == target;
        match target.and_then(|_| model.bodies.iter().position(is_target)) {
            Some(target) => light.aimed(model, target),
            None => light,
        }
    };
    let lights = found.iter().filter(is_drawn).take(MAX_LIGHTS).map(light).collect();
    Ok(Some(FileLights { headlight: Headlight::of(headlight.as_ref()), lights }))
}

impl Document {
    /// Returns the lights of the file. Returns `None` if the file has none.
    pub fn lights(&self) -> Option<&FileLights> {
        self.lights.as_ref()
    }
}

/// Returns the pose of a body with all joints at 0.
fn world_from_body(model: &mjcf_rs::Model, body: usize) -> Pose {
    let entry = &model.bodies[body];
    let around = entry.parent.map_or(Pose::IDENTITY, |parent| world_from_body(model, parent));
    around * super::pose(&entry.body.pose)
}

/// Returns the pose of a frame that is stated by `pos` and `quat`.
fn pose(frame: &Node) -> Pose {
    let rotation = match numbers(frame.attribute("quat"))[..] {
        [w, x, y, z] => Rotation::from_xyzw(x, y, z, w).normalize(),
        _ => Rotation::IDENTITY,
    };
    Pose::from_parts(vector(frame.attribute("pos")).unwrap_or(Vector::ZERO), rotation)
}

fn numbers(text: Option<&str>) -> Vec<f32> {
    text.unwrap_or_default().split_ascii_whitespace().filter_map(|word| word.parse().ok()).collect()
}

fn vector(text: Option<&str>) -> Option<Vector> {
    match numbers(text)[..] {
        [x, y, z] => Some(Vector::new(x, y, z)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lights_of(inside: &str) -> Option<FileLights> {
        let document = Document::parse("room.xml", &format!("<mujoco>{inside}</mujoco>"));
        document.expect("a room").lights().cloned()
    }

    #[test]
    fn a_light_is_a_spot_unless_the_file_says_otherwise() {
        assert_eq!(lights_of("<worldbody><geom size=\"1\"/></worldbody>"), None);
        let found = lights_of(
            r#"<default><light diffuse="1 1 1"/><default class="sun"><light directional="true"/></default>
               </default><worldbody><light pos="0 0 3"/><light class="sun" castshadow="false" dir="0 3 -4"/>
               <light active="false"/><light type="point" pos="1 0 0"/></worldbody>"#,
        )
        .expect("lights");
        assert_eq!(found.headlight, Headlight::default());
        let [spot, sun, point] = found.lights[..] else { panic!("{} lights", found.lights.len()) };
        assert_eq!((spot.kind, sun.kind, point.kind), {
            (LightKind::Spot, LightKind::Directional, LightKind::Point)
        });
        assert_eq!(spot.position_m.to_array(), [0.0, 0.0, 3.0]);
        assert_eq!((spot.direction.to_array(), spot.exponent_value), ([0.0, 0.0, -1.0], 10.0));
        assert!((spot.cutoff_rad - std::f32::consts::FRAC_PI_4).abs() < 1e-6);
        assert_eq!((sun.diffuse_rgb, sun.casts_shadow), (Vector::ONE, false));
        assert!((sun.direction - Vector::new(0.0, 0.6, -0.8)).length() < 1e-6);
    }

    #[test]
    fn a_light_shines_at_the_first_place_of_its_target() {
        let light = r#"<light mode="targetbody" target="cup" pos="0 0 2" dir="1 0 0"/>"#;
        let bodies = r#"<body pos="3 0 0"><geom size="1"/><body name="cup" pos="1 0 2"><geom size="1"/></body></body>"#;
        let body = |inside: &str| {
            format!("<worldbody><body pos=\"1 0 0\"><geom size=\"1\"/>{inside}</body>{bodies}</worldbody>")
        };
        let direction = |light: &str| lights_of(&body(light)).expect("lights").lights[0].direction;
        assert_eq!(direction(light), Vector::X);
        let steep = direction(&light.replace("0 0 2", "0 0 5"));
        assert!((steep - Vector::new(1.0, 0.0, -1.0).normalize()).length() < 1e-6, "{steep}");
        assert_eq!(direction(&light.replace("cup", "nobody").replace("1 0 0", "0 1 0")), Vector::Y);
    }

    #[test]
    fn a_headlight_alone_is_light_of_the_file() {
        let head = |attributes: &str| {
            lights_of(&format!("<visual><headlight {attributes}/><quality shadowsize=\"1\"/></visual>"))
        };
        let found = head(r#"diffuse="0.6 0.5 0.4""#).expect("a headlight");
        assert_eq!(found.headlight.diffuse_rgb.to_array(), [0.6, 0.5, 0.4]);
        assert_eq!(found.headlight.ambient_rgb, Headlight::default().ambient_rgb);
        assert_eq!(head(r#"active="0""#).expect("a headlight").headlight, Headlight::DARK);
    }

    #[test]
    fn a_light_is_in_the_frame_of_its_body() {
        let found = lights_of(
            r#"<worldbody><body pos="5 0 0"><geom size="1"/><frame pos="0 0 2" quat="0 1 0 0">
               <light pos="0 0 1"/></frame></body></worldbody>"#,
        )
        .expect("lights");
        let light = found.lights[0];
        assert_eq!(light.body, 1);
        assert!((light.position_m - Vector::Z).length() < 1e-6, "turned about x: {}", light.position_m);
        assert!((light.direction - Vector::Z).length() < 1e-6, "{}", light.direction);
    }
}
