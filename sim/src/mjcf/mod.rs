//! The only reader of MJCF, for robots, scenes and objects. It assembles the text with all includes
//! (`text`), and accepts or refuses every element and attribute by one table (`support`). It parses the text
//! with `mjcf-rs`, and converts it to its own types: bodies in trees, shapes, joints with their actuators,
//! equalities, keys, and the parts that `mjcf-rs` leaves out. Finally, it reads the files that the text
//! names (`assets`).

mod assets;
mod bodies;
mod constraints;
mod frames;
mod geometry;
mod joints;
mod key;
mod lights;
mod robot_file;
mod scene_bodies;
mod spring_dampers;
mod support;
#[cfg(test)]
mod tests;
mod text;

pub use assets::files::Mesh;
pub use assets::gloss::{Gloss, MIN_ROUGHNESS, SHININESS, USUAL_EXPONENT};
pub use assets::looks::SurfacePattern;
pub use assets::surface::{SurfaceImage, TextureMapping};
pub use assets::texture::{Texture, TextureLevel};
pub use bodies::{BodyLink, BodyTree, PlacedBody};
pub use constraints::{EqualityConstraint, EqualityKind, GeomPair};
pub use frames::{MjcfCamera, Site};
pub use geometry::{Geom, Primitive};
pub use joints::{Actuator, ActuatorKind, AxisJoint, LinkJoint};
pub use key::Key;
pub use lights::{FileLight, FileLights, Headlight, LightKind, MAX_LIGHTS};
pub use scene_bodies::SceneBody;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use xxhash_rust::xxh3::xxh3_64;

use crate::SimError;
use crate::user_file::{MAX_TEXT_BYTES, read_text};
use assets::gloss::Glosses;
use assets::kept;
use assets::layers::Layers;
use assets::looks::Looks;
use assets::surface::TextureRepeats;
use joints::UnreadRanges;
use text::check::{self, Checked};
use text::plain::plain;
use text::replicate::written_out;
use text::settings::FileSettings;
use text::source::{self, MjcfText};
use text::split::{Split, split};

/// Excess of a joint position beyond its range above which a note names the joint.
const MIN_EXCESS_RAD_OR_M: f64 = 0.01;

/// Files are equal if their names and contents are.
impl PartialEq for Document {
    fn eq(&self, other: &Document) -> bool {
        self.file == other.file && self.fingerprint() == other.fingerprint()
    }
}

/// A parsed file. All its content has an effect; a file with other content is refused.
#[derive(Clone, Debug)]
pub struct Document {
    pub file: String,
    pub model: mjcf_rs::Model,
    pub cameras: Vec<MjcfCamera>,
    /// Speed limits of the motors, in the order of the actuators; `None` if the file gives none.
    speed_limit_values: Option<Vec<f64>>,
    unread: UnreadRanges,
    source: MjcfText,
    checked: Checked,
    split: Split,
    /// Folder to which the file's references are relative.
    folder: PathBuf,
    /// Contents of the mesh files, by asset name.
    meshes: BTreeMap<String, Arc<Mesh>>,
    textures: BTreeMap<String, Arc<Texture>>,
    /// Textures that MuJoCo draws itself, by name.
    builtins: BTreeMap<String, Arc<Texture>>,
    /// Image of the sky.
    sky: Option<Arc<Texture>>,
    /// Images of materials with layers.
    layers: Layers,
    repeats: TextureRepeats,
    glosses: Glosses,
    lights: Option<FileLights>,
    looks: Looks,
    settings: FileSettings,
    /// Pairs of geoms that touch regardless of their masks.
    pub pairs: Vec<GeomPair>,
    /// All files that were read, each with a hash of its bytes.
    files: Vec<(PathBuf, u64)>,
    /// Fingerprint of a document that was read from a file; see [`Document::fingerprint`].
    known_fingerprint: Option<u64>,
}

impl Document {
    /// Parses MJCF text; `file` is its name in error messages. Files that it names are searched in the
    /// working folder.
    ///
    /// # Errors
    ///
    /// Returns an error if the text is not MJCF, or has elements or attributes that are refused.
    pub fn parse(file: &str, xml: &str) -> Result<Document, SimError> {
        Document::parse_in(file, xml, Path::new("."), &[])
    }

    /// Parses self-contained MJCF text, which may name no other file.
    ///
    /// # Errors
    ///
    /// Returns an error if the text names a file, or as for [`Document::parse`].
    pub fn parse_alone(file: &str, xml: &str) -> Result<Document, SimError> {
        source::refuse_files(file, xml)?;
        Document::parse(file, xml)
    }

    /// Returns true if MJCF text refers to other files. Text that is not XML refers to none.
    pub fn names_files(xml: &str) -> bool {
        source::names_files(xml)
    }

    /// Reads a file. Its includes, meshes and images are found relative to it.
    ///
    /// # Errors
    ///
    /// Returns an error if a file cannot be read, or as for [`Document::parse`].
    pub fn read(path: &Path) -> Result<Document, SimError> {
        if let Some(kept) = kept::find(path) {
            return Ok(kept);
        }
        let document = Document::read_without(path, &[])?;
        kept::keep(path, &document);
        Ok(document)
    }

    /// Reads a file anew, without refused elements that have a name in `left_out`.
    fn read_without(path: &Path, left_out: &[&str]) -> Result<Document, SimError> {
        let file = path.display().to_string();
        let xml = read_text(path, MAX_TEXT_BYTES)
            .map_err(|source| SimError::Read { path: file.clone(), source })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut document = Document::parse_in(&file, &xml, folder, left_out)?;
        document.files.push((path.into(), xxh3_64(xml.as_bytes())));
        document.known_fingerprint = Some(document.fingerprint());
        Ok(document)
    }

    fn parse_in(file: &str, xml: &str, folder: &Path, left_out: &[&str]) -> Result<Document, SimError> {
        let source = written_out(MjcfText::read(file, xml, folder)?)?;
        let mut checked = check::check(&source, left_out)?;
        let text = plain(&source.text, &source.xml()?);
        let mut model = mjcf_rs::Model::from_str(&text, folder)
            .map_err(|source| SimError::Mjcf { file: file.into(), source })?;
        let split_bodies = split(&mut model, &mut checked.bodies);
        let bodies: Vec<usize> = checked.bodies.iter().map(|one| one.body).collect();
        let lights = lights::lights(&source, &model, &bodies)?;
        let settings = FileSettings::of(&source)?;
        let mut document = Document {
            file: file.into(),
            model,
            cameras: frames::cameras(&source, !left_out.is_empty())?,
            speed_limit_values: joints::speed_limits(&source)?,
            unread: UnreadRanges::of(&source)?,
            lights,
            checked,
            split: split_bodies,
            folder: folder.into(),
            meshes: BTreeMap::new(),
            textures: BTreeMap::new(),
            builtins: BTreeMap::new(),
            sky: None,
            layers: Layers::default(),
            repeats: TextureRepeats::of(&source)?,
            glosses: Glosses::of(&source)?,
            looks: Looks::of(&source)?,
            pairs: GeomPair::all(&source, &settings)?,
            settings,
            files: source.included(),
            known_fingerprint: None,
            source,
        };
        document.read_meshes()?;
        document.read_textures()?;
        document.read_layers()?;
        document.check_bodies()?;
        document.note_joints();
        document.note_concave_meshes();
        Ok(document)
    }

    /// Refuses all joints and geoms that are not supported.
    fn check_bodies(&self) -> Result<(), SimError> {
        let mut refused = Vec::new();
        for (body, entry) in self.model.bodies.iter().enumerate() {
            refused.extend(self.joint(body).err());
            let geoms = 0..entry.body.geoms.len();
            refused.extend(geoms.filter_map(|geom| Geom::read(self, body, geom).err()));
        }
        SimError::of_all(refused).map_or(Ok(()), Err)
    }

    /// Notes ball joints, and free joints with springs, damping, friction or armature of their own or of a
    /// class. Also notes joints that begin beyond their ranges, and `<general>` actuators without effect.
    fn note_joints(&mut self) {
        let bodies = self.model.bodies.iter().zip(&self.checked.bodies);
        let mut joints = bodies.flat_map(|(entry, bytes)| entry.body.joints.iter().zip(&bytes.joints));
        let held = joints.find(|(joint, _)| {
            let states = [joint.stiffness, joint.damping, joint.frictionloss, joint.armature];
            joint.type_ == mjcf_rs::body::JointType::Free && states != [0.0; 4]
        });
        let ball = "a ball is three hinges about x, y and z, which lock where the second is turned by 90 degrees; it has no range";
        let free = "nothing holds or slows a free body: springs, damping, friction and armature are left out";
        let notes = [(self.split.ball, ball), (held.map(|(_, byte)| *byte), free)];
        let idle = "a <general> that is neither a motor nor a position does nothing";
        let idle = self.has_idle_actuators().then(|| format!("`{}`: {idle}", self.file));
        let told = notes
            .into_iter()
            .filter_map(|(byte, what)| Some(format!("`{}`: joint: {what}", self.source.line(byte?))));
        let told: Vec<String> = told.chain(self.beyond_range()).chain(idle).collect();
        self.checked.approximated.extend(told);
    }

    /// Returns a note on the joints that begin beyond their ranges, with the first of them.
    fn beyond_range(&self) -> Option<String> {
        let bodies = self.checked.bodies.iter().enumerate();
        let mut beyond = bodies.filter_map(|(body, bytes)| {
            let joint = self.joint(body).ok()?;
            let [low, high] = joint.axis()?.range?;
            let excess = low.max(-high);
            (excess > MIN_EXCESS_RAD_OR_M).then_some((*bytes.joints.first()?, excess, joint))
        });
        let (byte, excess, joint) = beyond.next()?;
        let amount = match joint {
            LinkJoint::Slide(_) => format!("{excess:.3} m"),
            _ => format!("{:.0} degrees", excess.to_degrees()),
        };
        let others = match beyond.count() {
            0 => String::new(),
            count => format!(" (and {count} more joints do)"),
        };
        let place = self.source.line(byte);
        Some(format!(
            "`{place}`: joint: it begins {amount} beyond its range{others} and is pushed back at another speed than by MuJoCo's soft limits"
        ))
    }

    /// Returns the elements of the file that only approximate MuJoCo, one per line with its first position.
    pub fn approximations(&self) -> &[String] {
        &self.checked.approximated
    }

    /// Returns the gravity of a scene in m/s^2, in the frame of the file.
    pub(crate) fn gravity_m_s2(&self) -> [f64; 3] {
        if self.settings.falls { self.model.option.gravity } else { [0.0; 3] }
    }

    /// Returns a hash of the content, including all files that it includes and names. Comments do not count.
    /// For a document that was read from a file, it is the hash of the file, even if the document has been
    /// changed since.
    pub fn fingerprint(&self) -> u64 {
        if let Some(known) = self.known_fingerprint {
            return known;
        }
        let texture_rgb: BTreeMap<_, _> =
            self.textures.iter().map(|(name, texture)| (name, texture.mean_rgb)).collect();
        let read = (&self.model, &self.cameras, &self.meshes, texture_rgb, &self.speed_limit_values);
        let mut content = format!("{read:?}");
        // Fields that older versions did not read leave the hash unchanged if a file does not use them.
        if self.unread != UnreadRanges::default() {
            content += &format!("{:?}", self.unread);
        }
        if self.looks != Looks::default() {
            content += &format!("{:?}", self.looks);
        }
        if self.repeats != TextureRepeats::default() {
            content += &format!("{:?}", self.repeats);
        }
        if self.layers != Layers::default() {
            content += &format!("{:?}", self.layers.names());
        }
        if self.settings != FileSettings::default() {
            content += &format!("{:?}", self.settings);
        }
        xxh3_64(content.as_bytes())
    }

    /// Returns the image of the sky, or six images of a cube around the camera, from the first texture of
    /// type `skybox`.
    pub fn sky(&self) -> Option<&Arc<Texture>> {
        self.sky.as_ref()
    }

    /// Returns the texture with this name, if it has an image.
    fn texture(&self, name: &str) -> Option<&Arc<Texture>> {
        self.textures.get(name).or_else(|| self.builtins.get(name))
    }

    pub(crate) fn unsupported(&self, what: impl Into<String>) -> SimError {
        SimError::Unsupported { file: self.file.clone(), what: what.into() }
    }

    /// Returns the error that refuses a body, with its line and the names around it.
    pub(crate) fn refuse_body(&self, body: usize, what: &str) -> SimError {
        self.source.refuse_at(self.checked.bodies[body].body, what)
    }

    /// Returns the geoms of a body, in that body's frame.
    fn geoms(&self, body: usize) -> Result<Vec<Geom>, SimError> {
        (0..self.model.bodies[body].body.geoms.len()).map(|index| Geom::read(self, body, index)).collect()
    }

    /// Returns the sites of fixed trees, in the frame of the file.
    pub fn room_sites(&self) -> Result<Vec<Site>, SimError> {
        let trees = self.trees()?;
        let links = trees.iter().filter(|tree| tree.is_fixed()).flat_map(|tree| &tree.links);
        let placed = |link: &BodyLink| {
            let file_from_link = pose(&link.parent_from_link);
            let site = move |site: &Site| Site {
                body_from_site: file_from_link * site.body_from_site,
                ..site.clone()
            };
            link.sites.iter().map(site).collect::<Vec<_>>()
        };
        Ok(links.flat_map(placed).collect())
    }

    /// Returns the sites of a body, in that body's frame.
    fn sites(&self, body: usize) -> impl Iterator<Item = Site> {
        self.model.bodies[body].body.sites.iter().map(Site::read)
    }
}

/// Converts an MJCF pose (f64) to a Rapier pose (f32).
pub(crate) fn pose(p: &mjcf_rs::Pose) -> Pose {
    let (t, r) = (p.translation, p.rotation);
    Pose::from_parts(
        Vector::new(t.x as f32, t.y as f32, t.z as f32),
        Rotation::from_xyzw(r.x as f32, r.y as f32, r.z as f32, r.w as f32).normalize(),
    )
}

fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x as f32, y as f32, z as f32)
}
