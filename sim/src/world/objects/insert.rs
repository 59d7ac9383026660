//! Puts scenes and objects into a physics world.

use rapier3d::math::Pose;
use rapier3d::prelude::*;

use super::model::top_level;
use super::rolling::rolling_rad_s2;
use super::{Object, ObjectModel, ObjectPlacement};
use crate::SimError;
use crate::mjcf::{Document, Geom};

/// Inserts a scene: bodies without a joint stay where they are, bodies with a free joint become objects.
pub(in crate::world) fn insert_scene(
    physics: &mut PhysicsWorld,
    scene: &Document,
) -> Result<(Vec<Geom>, Vec<Object>), SimError> {
    let mut fixed = Vec::new();
    let mut objects = Vec::new();
    for model in top_level(scene)? {
        if model.free {
            objects.push(insert(physics, model.name.clone(), model, Pose::IDENTITY));
            continue;
        }
        for mut geom in model.geoms {
            geom.body_from_geom = model.world_from_body * geom.body_from_geom;
            if let Some(collider) = collider(&geom) {
                physics.insert_collider(collider, None);
            }
            fixed.push(geom);
        }
    }
    Ok((fixed, objects))
}

/// Inserts an object file: one top-level body, free or a mark.
pub(in crate::world) fn insert_object(
    physics: &mut PhysicsWorld,
    placement: &ObjectPlacement,
) -> Result<Object, SimError> {
    let model = ObjectModel::load(&placement.file)?;
    Ok(insert(physics, placement.name.clone(), model, placement.world_from_object))
}

fn insert(physics: &mut PhysicsWorld, name: String, model: ObjectModel, placed: Pose) -> Object {
    let world_from_body = placed * model.world_from_body;
    let body = model.free.then(|| {
        let builder = RigidBodyBuilder::dynamic()
            .pose(world_from_body)
            .additional_mass_properties(model.mass)
            .can_sleep(false);
        physics.insert_body(builder)
    });
    let mut colliders = Vec::new();
    for geom in &model.geoms {
        let Some(mut builder) = collider(geom) else { continue };
        if body.is_none() {
            let world_from_shape = world_from_body * builder.position;
            builder = builder.position(world_from_shape);
        } else if !model.has_inertial {
            builder = match geom.mass_kg {
                Some(mass_kg) => builder.mass(mass_kg),
                None => builder.density(geom.density_kg_m3),
            };
        }
        colliders.push(physics.insert_collider(builder, body));
    }
    let rolling_rad_s2 = rolling_rad_s2(&model);
    Object { name, model, body, world_from_mark: world_from_body, colliders, rolling_rad_s2 }
}

fn collider(geom: &Geom) -> Option<ColliderBuilder> {
    if !geom.collides {
        return None;
    }
    let (body_from_shape, shape) = geom.collider()?;
    let builder = ColliderBuilder::new(shape)
        .position(body_from_shape)
        .density(0.0)
        .friction(geom.surface.coefficients.slide)
        .friction_combine_rule(CoefficientCombineRule::Max);
    Some(builder)
}
