//! The scene and the objects of a task file: built-in ones, MJCF in the file or beside it, and bodies of the
//! scene.

use std::sync::Arc;

use tandem_sim::mjcf::{Document, LinkJoint, SceneBody};
use tandem_sim::{ObjectFile, ObjectModel, Rotation, SimError, assets};
use toml::Spanned;

use super::build::{FARTHEST_M, angle_rad, is_file};
use super::reading::{Reading, place_in_file};
use super::table::{ObjectTable, TaskTable};
use crate::conditions::Names;
use crate::tasks::ObjectSpot;

const MAX_OBJECTS: usize = 64;
/// Maximum length of the name of a scene's body.
const LONGEST_NAME: usize = 100;

/// The scene's display name for messages, and its content unless the scene is built in.
pub(super) type Scene = (String, Option<Arc<Document>>);

impl Reading<'_> {
    /// Returns the scene; `None` if it has mistakes.
    pub fn scene(&mut self, table: &TaskTable) -> Option<Scene> {
        let (at, file) = match (&table.scene, &table.scene_mjcf) {
            (Some(name), None) => (name.span(), self.named(name, assets::scene)?),
            (None, Some(text)) => (text.span(), self.inline(text)),
            (Some(_), Some(both)) => {
                self.wrong(both.span(), "the scene is given twice; give scene or scene_mjcf");
                return None;
            }
            (None, None) => {
                let have = assets::scene("").err().map(|error| error.to_string()).unwrap_or_default();
                let have = have.split_once("have: ").map_or("", |(_, have)| have);
                let what = format!(
                    "no scene; give scene = \"floor\" above the first [...], or scene = \"my_room.xml\", or scene_mjcf; \
                     rooms that there are: {have}"
                );
                self.wrong(0..0, what);
                return None;
            }
        };
        match file {
            ObjectFile::Embedded(name) => Some((name, None)),
            ObjectFile::Read(document) | ObjectFile::OfScene { scene: document, .. } => {
                let name = table.scene.as_ref().map_or(&document.file, Spanned::get_ref);
                Some((name.clone(), Some(document)))
            }
            ObjectFile::Text { name, mjcf } => match Document::parse_alone(&name, &mjcf) {
                Ok(document) => Some((name, Some(document.into()))),
                Err(error) => {
                    self.wrong_mjcf(at, error.to_string());
                    None
                }
            },
        }
    }

    /// Resolves the name of a scene or an object: a file beside the task file, or one embedded in the binary.
    fn named(
        &mut self,
        name: &Spanned<String>,
        embedded: impl Fn(&str) -> Result<&'static str, SimError>,
    ) -> Option<ObjectFile> {
        let text = name.as_ref().as_str();
        if let Some(file) = self.source.by_hash.get(text) {
            return match file.load() {
                Ok(document) => Some(ObjectFile::Read(document.into())),
                Err(error) => {
                    self.wrong(name.span(), error.to_string());
                    None
                }
            };
        }
        if is_file(text) {
            return match self.source.beside.get(text) {
                Some(mjcf) => Some(ObjectFile::Text { name: text.to_owned(), mjcf: mjcf.clone() }),
                None => {
                    self.wrong(name.span(), format!("there is no {text} beside the task's file"));
                    None
                }
            };
        }
        match embedded(text) {
            Ok(_) => Some(ObjectFile::Embedded(text.to_owned())),
            Err(error) => {
                let what = format!("{error}; or a file beside this one, whose name ends in .xml");
                self.wrong(name.span(), what);
                None
            }
        }
    }

    /// Returns inline MJCF from the task file. Padding lines before it make its mistakes carry the task
    /// file's line numbers.
    fn inline(&self, text: &Spanned<String>) -> ObjectFile {
        let mjcf = text.as_ref();
        let at = place_in_file(&self.source.text, text);
        let lines = self.source.text[..at].matches('\n').count();
        let padding = if mjcf.starts_with("<?xml") { 0 } else { lines };
        ObjectFile::Text { name: self.source.name.clone(), mjcf: "\n".repeat(padding) + mjcf }
    }

    /// Returns the objects, and adds them to `names`. `scene` is `None` if the scene has mistakes.
    pub fn objects(
        &mut self,
        tables: &[ObjectTable],
        scene: Option<&Scene>,
        names: &mut Names,
    ) -> Vec<ObjectSpot> {
        let mut found: Vec<ObjectSpot> = Vec::new();
        if let Some(beyond) = tables.get(MAX_OBJECTS) {
            self.wrong(beyond.name.span(), format!("a task has at most {MAX_OBJECTS} objects"));
        }
        for table in tables.iter().take(MAX_OBJECTS) {
            let name = table.name.as_ref().as_str();
            if found.iter().any(|spot| spot.name == name) {
                self.wrong(
                    table.name.span(),
                    format!("there is an object {name:?} already; give each its own name"),
                );
                continue;
            }
            let spot = match table.in_scene {
                true => self.body_of_scene(table, scene),
                false => self.own_object(table, scene),
            };
            let Some(spot) = spot else {
                names.mistaken_objects.insert(name.to_owned());
                continue;
            };
            match ObjectModel::parts(&spot.source, name) {
                Ok(parts) => {
                    names.objects.extend(parts.into_iter().map(|part| (part.name, Arc::new(part.model))));
                }
                Err(error) => {
                    let given = table.mjcf.as_ref().or(table.file.as_ref()).unwrap_or(&table.name);
                    self.wrong_mjcf(given.span(), error.to_string());
                    names.mistaken_objects.insert(name.to_owned());
                }
            }
            found.push(spot);
        }
        found
    }

    /// Returns an object that the file places.
    fn own_object(&mut self, table: &ObjectTable, scene: Option<&Scene>) -> Option<ObjectSpot> {
        self.id(&table.name, "an object");
        let name = table.name.as_ref().as_str();
        let of_file = scene.and_then(|(_, document)| document.as_ref());
        let bodies = of_file.and_then(|document| document.scene_bodies().ok()).unwrap_or_default();
        if bodies.iter().any(|body| body.link.name == name) {
            let what = format!(
                "the scene has a body {name:?}; in_scene = true in place of position_m makes it an object of the task, \
                 and another object has another name"
            );
            self.wrong(table.name.span(), what);
            return None;
        }
        let Some(position_m) = &table.position_m else {
            let what =
                "no place; give position_m = [x, y, z], or in_scene = true if it is a body of the scene";
            self.wrong(table.name.span(), what);
            return None;
        };
        self.finite(position_m, position_m.as_ref(), FARTHEST_M);
        let source = match (&table.file, &table.mjcf) {
            (Some(_), Some(both)) => {
                self.wrong(both.span(), "the object is given twice; give file or mjcf");
                return None;
            }
            (None, Some(text)) => self.inline(text),
            (file, None) => self.named(file.as_ref().unwrap_or(&table.name), assets::object)?,
        };
        let inline = table.mjcf.as_ref().map(|_| &self.source.name);
        Some(ObjectSpot {
            name: name.to_owned(),
            file: inline
                .or(table.file.as_ref().map(Spanned::get_ref))
                .unwrap_or(table.name.get_ref())
                .clone(),
            position_m: position_m.as_ref().map(|value| value as f32),
            yaw_rad: angle_rad(table.yaw_deg.as_ref()),
            turn: Rotation::IDENTITY,
            source,
        })
    }

    /// Returns a body of the scene as an object of the task.
    fn body_of_scene(&mut self, table: &ObjectTable, scene: Option<&Scene>) -> Option<ObjectSpot> {
        let name = table.name.as_ref();
        let odd = |letter: char| letter.is_whitespace() || letter.is_control() || "\"'\\{}".contains(letter);
        if name.is_empty() || name.len() > LONGEST_NAME || name.contains(odd) {
            let what = format!(
                "an object's name has 1 to {LONGEST_NAME} letters and no blanks, quotes and brackets; rename the body in the scene"
            );
            self.wrong(table.name.span(), what);
            return None;
        }
        let places =
            [table.position_m.as_ref().map(Spanned::span), table.yaw_deg.as_ref().map(Spanned::span)];
        let files = [table.file.as_ref().map(Spanned::span), table.mjcf.as_ref().map(Spanned::span)];
        for at in places.into_iter().chain(files).flatten() {
            let what = "the scene has this body and its place; leave this out, and let [[randomize]] move a free body";
            self.wrong(at, what);
        }
        let (file, document) = scene?;
        let found = match document {
            Some(document) => document.scene_body(name).map(|body| (document.clone(), body)),
            None => body_of_room(file, name),
        };
        match found {
            Ok((scene, SceneBody { scene_from_body, .. })) => Some(ObjectSpot {
                name: name.clone(),
                file: file.clone(),
                position_m: scene_from_body.translation.to_array(),
                yaw_rad: 0.0,
                turn: scene_from_body.rotation,
                source: ObjectFile::OfScene { scene, body: name.clone() },
            }),
            Err(error) => {
                self.wrong(table.name.span(), error.to_string());
                None
            }
        }
    }

    /// Checks that `[[randomize]]` can move an object, which it names.
    pub fn can_be_moved(&mut self, spot: &ObjectSpot, named: &Spanned<String>) {
        let ObjectFile::OfScene { scene, body } = &spot.source else { return };
        if !scene.scene_body(body).is_ok_and(|found| matches!(found.link.joint, LinkJoint::Free { .. })) {
            let what =
                format!("{body} is not free, and moves by its joint alone; free bodies of a scene are moved");
            self.wrong(named.span(), what);
        }
    }
}

/// Returns a body of a built-in room, and that room.
fn body_of_room(room: &str, body: &str) -> Result<(Arc<Document>, SceneBody), SimError> {
    let document = Document::parse(room, assets::scene(room)?)?;
    let found = document.scene_body(body)?;
    Ok((document.into(), found))
}
