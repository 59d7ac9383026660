//! Bodies of a file as trees: links, the joints between them, their masses, geoms and sites. Plain data
//! without dynamics.

use std::ops::Range;

use mjcf_rs::body::{GeomType, InertiaSpec, Inertial};
use mjcf_rs::compiler::InertiaFromGeom;
use rapier3d::glamx::DPose3;
use rapier3d::math::{Matrix, Pose, Vector};
use rapier3d::prelude::MassProperties;

use super::{Document, Geom, LinkJoint, Primitive, Site, pose, vector};
use crate::{SimError, mass};

/// Top-level body with all bodies that it carries.
#[derive(Clone, Debug)]
pub struct BodyTree {
    /// Parents before children.
    pub links: Vec<BodyLink>,
}

/// A rigid part of a tree: a body with its joint, and the bodies without a joint that are fixed to it.
#[derive(Clone, Debug)]
pub struct BodyLink {
    /// Name of the body that has the joint; "world" for the world.
    pub name: String,
    /// Index into [`BodyTree::links`]; `None` is the world.
    pub parent: Option<usize>,
    /// Pose with the joint at 0.
    pub parent_from_link: DPose3,
    pub joint: LinkJoint,
    /// True for a link that only carries one of several joints of the next body, and is not a body of the
    /// file.
    pub is_part: bool,
    /// Mass and inertia in the link's frame.
    pub mass: MassProperties,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
    /// Bodies of the file that are part of this link, itself first.
    pub bodies: Vec<PlacedBody>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PlacedBody {
    pub name: String,
    /// Index among the bodies of the file; 0 is the world.
    pub index: usize,
    pub link_from_body: DPose3,
    /// Indices of the body's geoms among the link's.
    pub geoms: Range<usize>,
}

impl BodyTree {
    /// Returns true if no part of the tree can move.
    pub fn is_fixed(&self) -> bool {
        self.links.iter().all(|link| link.joint == LinkJoint::Fixed)
    }

    /// Returns the link that contains a body, and the body's pose in the link's frame.
    pub fn body(&self, name: &str) -> Option<(usize, DPose3)> {
        self.links.iter().enumerate().find_map(|(index, link)| {
            let body = link.bodies.iter().find(|body| body.name == name)?;
            Some((index, body.link_from_body))
        })
    }
}

/// Link of which a body of the file became part.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub tree: usize,
    pub link: usize,
    link_from_body: DPose3,
}

impl Document {
    /// Returns the world itself as a fixed tree, then every top-level body. The coordinates of all links
    /// in this order are MuJoCo's `qpos`.
    pub fn trees(&self) -> Result<Vec<BodyTree>, SimError> {
        let mut trees: Vec<BodyTree> = Vec::new();
        let mut places: Vec<Place> = Vec::new();
        for (id, entry) in self.model.bodies.iter().enumerate() {
            let joint = self.joint(id)?;
            let parent = entry.parent.filter(|parent| *parent != 0).map(|parent| places[parent]);
            let parent_from_body = entry.body.pose;
            let place = match parent {
                Some(parent) if joint == LinkJoint::Fixed => {
                    Place { link_from_body: parent.link_from_body * parent_from_body, ..parent }
                }
                Some(parent) => {
                    let links = &mut trees[parent.tree].links;
                    links.push(new_link(Some(parent.link), parent.link_from_body * parent_from_body, joint));
                    Place { link: links.len() - 1, link_from_body: DPose3::IDENTITY, ..parent }
                }
                None => {
                    trees.push(BodyTree { links: vec![new_link(None, parent_from_body, joint)] });
                    Place { tree: trees.len() - 1, link: 0, link_from_body: DPose3::IDENTITY }
                }
            };
            places.push(place);
            trees[place.tree].links[place.link].is_part |= self.split.is_part[id];
            self.refuse_planes_that_move(id, &trees[place.tree].links, place.link)?;
            self.add_body(id, &mut trees[place.tree].links[place.link], place.link_from_body)?;
        }
        for link in trees.iter_mut().flat_map(|tree| &mut tree.links) {
            link.name = link.bodies[0].name.clone();
        }
        self.set_total_mass(&mut trees);
        self.set_spring_dampers(&mut trees, &places);
        self.check_masses(&trees, &places)?;
        Ok(trees)
    }

    /// Scales all masses to the total mass in the file, if the file gives one. The world has no mass.
    fn set_total_mass(&self, trees: &mut [BodyTree]) {
        let stated_kg = self.model.compiler.set_total_mass as f32;
        let mut links: Vec<_> = trees.iter_mut().skip(1).flat_map(|tree| &mut tree.links).collect();
        let total_kg: f32 = links.iter().map(|link| link.mass.mass()).sum();
        if stated_kg > 0.0 && total_kg > 0.0 {
            for link in links.iter_mut().filter(|link| link.mass.mass() > 0.0) {
                let mass_kg = link.mass.mass() * stated_kg / total_kg;
                link.mass.set_mass(mass_kg, true);
            }
        }
    }

    /// Refuses planes on bodies that a joint moves, as MuJoCo does.
    fn refuse_planes_that_move(&self, id: usize, links: &[BodyLink], link: usize) -> Result<(), SimError> {
        let geoms = &self.model.bodies[id].body.geoms;
        let Some(plane) = geoms.iter().position(|geom| geom.type_ == GeomType::Plane) else { return Ok(()) };
        let mut above = std::iter::successors(Some(link), |link| links[*link].parent);
        if above.all(|link| links[link].joint == LinkJoint::Fixed) {
            return Ok(());
        }
        let what = "a plane has no end; use a box on what moves";
        Err(self.source.refuse_at(self.checked.bodies[id].geoms[plane], what))
    }

    /// Checks that every joint moves a mass.
    fn check_masses(&self, trees: &[BodyTree], places: &[Place]) -> Result<(), SimError> {
        for (index, tree) in trees.iter().enumerate() {
            let mut carried_kg: Vec<f32> = tree.links.iter().map(|link| link.mass.mass()).collect();
            for (id, link) in tree.links.iter().enumerate().rev() {
                let armature = link.joint.axis().map_or(0.0, |axis| axis.armature);
                if link.joint != LinkJoint::Fixed && carried_kg[id] <= 0.0 && armature <= 0.0 {
                    let body = places.iter().position(|place| (place.tree, place.link) == (index, id));
                    let what =
                        "its joint moves nothing that has mass; give it a mass or the joint an armature";
                    return Err(self.refuse_body(body.unwrap_or(0), what));
                }
                if let Some(parent) = link.parent {
                    carried_kg[parent] += carried_kg[id];
                }
            }
        }
        Ok(())
    }

    /// Returns true if the mass of a body comes from its geoms.
    pub(super) fn takes_mass_of_geoms(&self, body: usize) -> bool {
        match self.model.compiler.inertia_from_geom {
            InertiaFromGeom::True => true,
            InertiaFromGeom::False => false,
            InertiaFromGeom::Auto => self.model.bodies[body].body.inertial.is_none(),
        }
    }

    fn add_body(&self, id: usize, link: &mut BodyLink, link_from_body: DPose3) -> Result<(), SimError> {
        let body = &self.model.bodies[id].body;
        let name = if id == 0 { Some("world") } else { body.name.as_deref() };
        let on_link: Pose = pose(&link_from_body);
        let geoms = self.geoms(id)?;
        link.bodies.push(PlacedBody {
            name: name.unwrap_or_default().into(),
            index: id,
            link_from_body,
            geoms: link.geoms.len()..link.geoms.len() + geoms.len(),
        });
        let mass = match &body.inertial {
            Some(inertial) if !self.takes_mass_of_geoms(id) => stated_mass(inertial),
            None if !self.takes_mass_of_geoms(id) => MassProperties::default(),
            Some(_) | None => {
                let groups = body.geoms.iter().map(|geom| geom.group);
                let weighing = geoms
                    .iter()
                    .zip(groups)
                    .filter(|(_, group)| self.settings.inertia_groups.contains(group));
                let masses = weighing.map(|(geom, _)| mass_of_geom(geom));
                masses.fold(MassProperties::default(), mass::sum)
            }
        };
        link.mass = mass::sum(link.mass, mass.transform_by(&on_link));
        link.geoms.extend(
            geoms.into_iter().map(|geom| Geom { body_from_geom: on_link * geom.body_from_geom, ..geom }),
        );
        link.sites.extend(
            self.sites(id).map(|site| Site { body_from_site: on_link * site.body_from_site, ..site }),
        );
        Ok(())
    }
}

fn new_link(parent: Option<usize>, parent_from_link: DPose3, joint: LinkJoint) -> BodyLink {
    BodyLink {
        name: String::new(),
        parent,
        parent_from_link,
        joint,
        is_part: false,
        mass: MassProperties::default(),
        geoms: Vec::new(),
        sites: Vec::new(),
        bodies: Vec::new(),
    }
}

/// Returns the mass properties of an `<inertial>`, in the body's frame.
fn stated_mass(inertial: &Inertial) -> MassProperties {
    let inertia = match inertial.inertia {
        InertiaSpec::Diagonal(d) => Matrix::from_diagonal(vector(d)),
        InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
            Matrix::from_cols(vector([xx, xy, xz]), vector([xy, yy, yz]), vector([xz, yz, zz]))
        }
    };
    mass::with_inertia(inertial.mass as f32, inertia).transform_by(&pose(&inertial.pose))
}

/// Returns the mass properties of a uniformly filled geom, in its body's frame. As in MuJoCo, a geom has
/// mass whether or not it collides, unless its mass is 0. A plane has no mass.
fn mass_of_geom(geom: &Geom) -> MassProperties {
    let Some((body_from_shape, shape)) = geom.collider() else { return MassProperties::default() };
    let of_unit_density = match geom.primitive {
        Primitive::Plane { .. } => return MassProperties::default(),
        // The collision shape is a hull with flat faces.
        Primitive::Ellipsoid { radii_m } => ellipsoid(radii_m).transform_by(&geom.body_from_geom),
        Primitive::Sphere { .. }
        | Primitive::Capsule { .. }
        | Primitive::Cylinder { .. }
        | Primitive::Box { .. }
        | Primitive::Convex { .. } => {
            mass::at_unit_density(|density| shape.mass_properties(density)).transform_by(&body_from_shape)
        }
        Primitive::Mesh(ref mesh) => {
            mesh.mass_properties().unwrap_or_default().transform_by(&geom.body_from_geom)
        }
    };
    let mass_kg = geom.mass_kg.unwrap_or(geom.density_kg_m3 * of_unit_density.mass());
    let mut mass = of_unit_density;
    mass.set_mass(mass_kg, true);
    mass
}

/// Computes m = 4/3 pi a b c,  I_xx = m (b^2 + c^2) / 5.
fn ellipsoid(radii_m: Vector) -> MassProperties {
    let mass = 4.0 / 3.0 * std::f32::consts::PI * radii_m.x * radii_m.y * radii_m.z;
    let s = radii_m * radii_m * (mass / 5.0);
    MassProperties::new(Vector::ZERO, mass, Vector::new(s.y + s.z, s.x + s.z, s.x + s.y))
}
