//! Objects and the fixed parts of a scene.

use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::*;

use crate::mjcf::{Document, Geom, mass_properties, pose};
use crate::{GRAVITY_M_S2, SimError, assets};
use mjcf_rs::body::JointType;

/// An object file put into the world.
#[derive(Clone, Debug)]
pub struct ObjectPlacement {
    /// What tasks call it.
    pub name: String,
    /// Name of the file in `assets/objects`; several objects may share one.
    pub file: String,
    pub world_from_object: Pose,
}

/// Pose and velocity of an object's frame, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectState {
    pub world_from_object: Pose,
    pub velocity_m_s: Vector,
    pub angular_velocity_rad_s: Vector,
}

/// Something named that is not a robot: a free body, or a mark that only is looked at.
pub(super) struct Object {
    pub name: String,
    pub body: Option<RigidBodyHandle>,
    /// Where a mark lies; a body's pose is Rapier's.
    pub world_from_mark: Pose,
    pub colliders: Vec<ColliderHandle>,
    pub geoms: Vec<Geom>,
    /// Deceleration by rolling resistance, rad/s^2; 0 for what does not roll.
    rolling_rad_s2: f32,
}

/// Slower than this, rolling resistance acts as a damper: a fixed torque would turn the ball back.
const SLOWEST_ROLLING_RAD_S: f32 = 0.5;

impl Object {
    /// Rapier has no rolling resistance, without which a ball on a flat base never comes to rest. The damping of one
    /// physics step takes from the measured rate what MuJoCo's rolling friction r (m) would:  I w' = -r m g.
    pub(super) fn resist_rolling(&self, physics: &mut PhysicsWorld) {
        let Some(handle) = self.body.filter(|_| self.rolling_rad_s2 > 0.0) else { return };
        let body = &mut physics.bodies[handle];
        body.set_angular_damping(self.rolling_rad_s2 / body.angvel().length().max(SLOWEST_ROLLING_RAD_S));
    }

    pub(super) fn state(&self, physics: &PhysicsWorld) -> ObjectState {
        match self.body.map(|handle| &physics.bodies[handle]) {
            Some(body) => ObjectState {
                world_from_object: *body.position(),
                velocity_m_s: body.velocity_at_point(body.position().translation),
                angular_velocity_rad_s: body.angvel(),
            },
            None => ObjectState {
                world_from_object: self.world_from_mark,
                velocity_m_s: Vector::ZERO,
                angular_velocity_rad_s: Vector::ZERO,
            },
        }
    }
}

/// Inserts a scene: bodies without a joint stay where they are, bodies with a free joint become objects.
pub(super) fn insert_scene(
    physics: &mut PhysicsWorld,
    scene: &Document,
) -> Result<(Vec<Geom>, Vec<Object>), SimError> {
    let mut fixed = Vec::new();
    let mut objects = Vec::new();
    for body in bodies(scene)? {
        if body.free {
            objects.push(insert_body(physics, scene, body, Pose::IDENTITY)?);
            continue;
        }
        for mut geom in body.geoms {
            geom.body_from_geom = body.world_from_body * geom.body_from_geom;
            if let Some(collider) = collider(&geom) {
                physics.insert_collider(collider, None);
            }
            fixed.push(geom);
        }
    }
    Ok((fixed, objects))
}

/// Inserts an object file: one top-level body, free or a mark.
pub(super) fn insert_object(
    physics: &mut PhysicsWorld,
    placement: &ObjectPlacement,
) -> Result<Object, SimError> {
    let document = Document::parse(&placement.file, assets::object(&placement.file)?)?;
    let mut bodies: Vec<Body> = bodies(&document)?.into_iter().filter(|body| body.id != 0).collect();
    if bodies.len() != 1 {
        return Err(document.unsupported("an object file has one top-level body; its parts have no joints"));
    }
    let mut body = bodies.remove(0);
    body.name = placement.name.clone();
    insert_body(physics, &document, body, placement.world_from_object)
}

/// A top-level body with the geoms of its jointless descendants.
struct Body {
    id: usize,
    name: String,
    free: bool,
    world_from_body: Pose,
    mass: MassProperties,
    has_inertial: bool,
    geoms: Vec<Geom>,
}

fn bodies(document: &Document) -> Result<Vec<Body>, SimError> {
    let mut bodies: Vec<Body> = Vec::new();
    // Index into `bodies` and pose in it, per MJCF body.
    let mut owner: Vec<(usize, Pose)> = Vec::new();
    for (id, entry) in document.model.bodies.iter().enumerate() {
        let free = match entry.body.joints.as_slice() {
            [] => false,
            [joint] if joint.type_ == JointType::Free => true,
            _ => return Err(document.unsupported("joints in scenes and objects: only a free joint is read")),
        };
        let parent_from_body = pose(&entry.body.pose);
        let parent = entry.parent.map(|parent| owner[parent]);
        let (index, top_from_body) = match parent {
            Some((index, top_from_parent)) if !free && entry.parent != Some(0) => {
                (index, top_from_parent * parent_from_body)
            }
            Some(_) if free && entry.parent != Some(0) => {
                return Err(document.unsupported("a free joint below another body"));
            }
            _ => {
                bodies.push(Body {
                    id,
                    name: entry.body.name.clone().unwrap_or_default(),
                    free,
                    world_from_body: parent_from_body,
                    mass: MassProperties::default(),
                    has_inertial: false,
                    geoms: Vec::new(),
                });
                (bodies.len() - 1, Pose::IDENTITY)
            }
        };
        owner.push((index, top_from_body));
        let body = &mut bodies[index];
        if let Some(inertial) = &entry.body.inertial {
            body.mass += mass_properties(inertial).transform_by(&top_from_body);
            body.has_inertial = true;
        }
        for mut geom in document.geoms(id)? {
            geom.body_from_geom = top_from_body * geom.body_from_geom;
            body.geoms.push(geom);
        }
    }
    Ok(bodies)
}

fn insert_body(
    physics: &mut PhysicsWorld,
    document: &Document,
    body: Body,
    placed: Pose,
) -> Result<Object, SimError> {
    let world_from_body = placed * body.world_from_body;
    let mut object = Object {
        name: body.name,
        body: None,
        world_from_mark: world_from_body,
        colliders: Vec::new(),
        rolling_rad_s2: rolling_rad_s2(&body.geoms, &body.mass),
        geoms: body.geoms,
    };
    if body.free {
        let builder = RigidBodyBuilder::dynamic()
            .pose(world_from_body)
            .additional_mass_properties(body.mass)
            .can_sleep(false);
        object.body = Some(physics.insert_body(builder));
    }
    for geom in &object.geoms {
        let Some(mut builder) = collider(geom) else { continue };
        if object.body.is_none() {
            let world_from_shape = world_from_body * builder.position;
            builder = builder.position(world_from_shape);
        } else if !body.has_inertial {
            builder = match geom.mass_kg {
                Some(mass_kg) => builder.mass(mass_kg),
                None => builder.density(geom.density_kg_m3),
            };
        }
        object.colliders.push(physics.insert_collider(builder, object.body));
    }
    if body.free && object.colliders.is_empty() {
        return Err(document.unsupported(format!("free body `{}` has no geom that collides", object.name)));
    }
    Ok(object)
}

/// r m g / I of the geom with the largest rolling friction r.
fn rolling_rad_s2(geoms: &[Geom], mass: &MassProperties) -> f32 {
    let rolling_m = geoms.iter().map(|geom| geom.rolling_friction_m).fold(0.0, f32::max);
    let inertia_kg_m2 = mass.principal_inertia().max_element();
    if inertia_kg_m2 == 0.0 { 0.0 } else { rolling_m * mass.mass() * GRAVITY_M_S2 / inertia_kg_m2 }
}

fn collider(geom: &Geom) -> Option<ColliderBuilder> {
    if !geom.collides {
        return None;
    }
    let (body_from_shape, shape) = geom.collider()?;
    let builder = ColliderBuilder::new(shape)
        .position(body_from_shape)
        .density(0.0)
        .friction(geom.friction)
        .friction_combine_rule(CoefficientCombineRule::Max);
    Some(builder)
}
