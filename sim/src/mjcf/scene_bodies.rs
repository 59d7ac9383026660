//! Movable bodies of a scene, by name. Tasks can refer to these; all other bodies are part of the room.

use rapier3d::math::Pose;

use super::{BodyLink, BodyTree, Document, pose};
use crate::SimError;

/// Body of a scene that a joint moves, or that carries such a body.
#[derive(Clone, Debug)]
pub struct SceneBody {
    pub link: BodyLink,
    /// Pose as the file places it.
    pub scene_from_body: Pose,
    /// Name of the body that carries this one; `None` for the world.
    pub carrier: Option<String>,
}

impl Document {
    /// Returns the movable bodies of a scene and the bodies that carry them, in file order.
    pub fn scene_bodies(&self) -> Result<Vec<SceneBody>, SimError> {
        let trees = self.trees()?;
        Ok(trees.iter().filter(|tree| !tree.is_fixed()).flat_map(bodies_of).collect())
    }

    /// Returns the movable body of a scene with this name.
    ///
    /// # Errors
    ///
    /// Returns an error with the available names if there is no such body, or several.
    pub fn scene_body(&self, name: &str) -> Result<SceneBody, SimError> {
        let mut bodies = self.scene_bodies()?;
        let named = bodies.iter().filter(|body| body.link.name == name).count();
        let found = bodies.iter().position(|body| body.link.name == name);
        if let (Some(found), 1) = (found, named) {
            return Ok(bodies.swap_remove(found));
        }
        if named > 1 {
            let what = format!("{named} bodies are called {name:?}; give each its own name");
            return Err(self.unsupported(what));
        }
        let is_part = |body: &&SceneBody| body.link.bodies.iter().any(|part| part.name == name);
        let what = if let Some(whole) = bodies.iter().find(is_part) {
            format!("body {name:?} is a part of {:?}, on which no joint moves it; name that", whole.link.name)
        } else if self.model.bodies.iter().any(|entry| entry.body.name.as_deref() == Some(name)) {
            format!(
                "body {name:?} has no joint and never moves; put a fixed mark there, for example `target_pad`"
            )
        } else {
            let have: Vec<&str> = bodies.iter().map(|body| body.link.name.as_str()).collect();
            let have = if have.is_empty() { "none".into() } else { have.join(", ") };
            format!("no body {name:?} that can move; have: {have}")
        };
        Err(self.unsupported(what))
    }
}

fn bodies_of(tree: &BodyTree) -> Vec<SceneBody> {
    let mut placed: Vec<Pose> = Vec::with_capacity(tree.links.len());
    let mut found = Vec::new();
    for link in &tree.links {
        let on_carrier = pose(&link.parent_from_link);
        placed.push(link.parent.map_or(on_carrier, |carrier| placed[carrier] * on_carrier));
        if !link.is_part {
            found.push(SceneBody {
                link: link.clone(),
                scene_from_body: placed[placed.len() - 1],
                carrier: link.parent.map(|carrier| tree.links[carrier].name.clone()),
            });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"<mujoco><worldbody>
        <body name="shelf" pos="0 0 1"><geom type="box" size="1 1 0.1"/></body>
        <body name="chest" pos="2 0 0"><geom type="box" size="0.3 0.3 0.3"/>
          <body name="drawer" pos="0 0.1 0.2"><joint type="slide" axis="0 1 0" range="0 0.3"/>
            <geom type="box" size="0.2 0.2 0.1"/><body name="knob"><geom size="0.02"/></body></body>
        </body>
        <body name="mug" pos="0 0 1.2"><freejoint/><geom type="cylinder" size="0.04 0.05"/></body>
      </worldbody></mujoco>"#;

    #[test]
    fn a_scene_tells_the_bodies_that_can_move() {
        let scene = Document::parse("house.xml", SCENE).expect("a scene");
        let bodies = scene.scene_bodies().expect("bodies");
        let told: Vec<(&str, Option<&str>)> =
            bodies.iter().map(|body| (body.link.name.as_str(), body.carrier.as_deref())).collect();
        assert_eq!(told, [("chest", None), ("drawer", Some("chest")), ("mug", None)]);
        let drawer = scene.scene_body("drawer").expect("a drawer");
        assert_eq!(drawer.scene_from_body.translation.to_array(), [2.0, 0.1, 0.2]);
    }

    #[test]
    fn a_name_without_such_a_body_is_refused_in_words() {
        let scene = Document::parse("house.xml", SCENE).expect("a scene");
        for (name, expected) in [
            ("knob", "body \"knob\" is a part of \"drawer\""),
            ("shelf", "body \"shelf\" has no joint and never moves"),
            ("cup", "no body \"cup\" that can move; have: chest, drawer, mug"),
        ] {
            let text = scene.scene_body(name).expect_err(name).to_string();
            assert!(text.contains("house.xml") && text.contains(expected), "{text}");
        }
        let twice = SCENE.replace("\"drawer\"", "\"mug\"");
        let told = match Document::parse("house.xml", &twice) {
            Ok(scene) => scene.scene_body("mug").expect_err("two mugs").to_string(),
            Err(error) => error.to_string(),
        };
        println!("{told}");
        assert!(told.contains("mug"), "{told}");
    }
}
