//! An articulated tree: links, their state, and the working memory of a step.

use rapier3d::glamx::{DMat3, DPose3, DVec3};
use thiserror::Error;

use super::factor::Factor;
use super::layout::Layout;
use super::link::{Drive, DriveLaw, Joint, Link, Mass};
use super::spatial::{ForceVector, Inertia, MotionVector, Symmetric};
use crate::dynamics::rest::Rest;

/// Tree of links that joints connect. A robot is a tree with a free first link, a door a tree with a fixed
/// first link, and a lone object a tree of one free link.
///
/// The degrees of freedom are in the order of the links. A free joint has the velocity of the link's
/// centre of mass and its angular velocity, both in world axes; a hinge or slide has one. The centre of
/// mass is used rather than the origin, because then a lone body's mass matrix has no coupling and its
/// centre flies straight.
pub struct Tree {
    pub name: String,
    pub(in crate::dynamics) links: Vec<Link>,
    pub(in crate::dynamics) layout: Layout,
    /// Pose of a free first link in the world.
    pub(in crate::dynamics) base: DPose3,
    /// Joint positions, by link; 0 if the joint has none.
    pub(in crate::dynamics) q: Vec<f64>,
    pub(in crate::dynamics) v: Vec<f64>,
    /// Setpoint of each link's drive, by link.
    pub(in crate::dynamics) drives: Vec<Drive>,
    /// Resulting law of each drive in this step, by link.
    pub(in crate::dynamics) laws: Vec<DriveLaw>,
    /// True if a link's drive is a row of the solver in this step, by link.
    pub(in crate::dynamics) bounded: Vec<bool>,
    /// True if a joint would leave its range in this step although it was not near either end, by link.
    pub(in crate::dynamics) overrun: Vec<bool>,
    /// External forces, by link, about the reference; they act only in the next step.
    pub(in crate::dynamics) external: Vec<ForceVector>,
    /// Efforts of the drives in the last step, by link.
    pub(in crate::dynamics) effort: Vec<f64>,
    /// Impulses of dry friction in the last step, by link. The next step begins with them.
    pub(in crate::dynamics) dry_friction: Vec<f64>,
    /// State of a body that may sleep; `None` for all other trees.
    pub(in crate::dynamics) rest: Option<Rest>,
    /// Velocities at the end of an unconstrained step, by degree of freedom.
    pub(in crate::dynamics) unconstrained: Vec<f64>,
    /// Origin of the spatial vectors, world frame: the centre of mass of a free first link, or the origin of
    /// a fixed one.
    pub(in crate::dynamics) reference_m: DVec3,
    /// Rotation of each link in its parent with the joint at 0.
    pub(in crate::dynamics) parent_from_link_rotation: Vec<DMat3>,
    pub(in crate::dynamics) rotation: Vec<DMat3>,
    /// Origins of the links relative to the reference.
    pub(in crate::dynamics) position_m: Vec<DVec3>,
    /// Joint axes S, by degree of freedom.
    pub(in crate::dynamics) axis: Vec<MotionVector>,
    pub(in crate::dynamics) velocity: Vec<MotionVector>,
    pub(in crate::dynamics) acceleration: Vec<MotionVector>,
    pub(in crate::dynamics) force: Vec<ForceVector>,
    /// Composite inertias, by link.
    pub(in crate::dynamics) inertia: Vec<Inertia>,
    /// Inertia of each link about its centre of mass, link axes.
    pub(in crate::dynamics) own_inertia: Vec<Symmetric>,
    /// Terms that springs, dampers and drives add to the diagonal of the mass matrix.
    pub(in crate::dynamics) implicit: Vec<f64>,
    pub(in crate::dynamics) rhs: Vec<f64>,
    pub(in crate::dynamics) factor: Factor,
    /// Half of the change in angular velocity by [`Tree::spin_freely`].
    pub(in crate::dynamics) half_gyration_rad_s: DVec3,
}

impl Tree {
    /// Builds a tree at rest from its links, parents first.
    ///
    /// # Errors
    ///
    /// Returns a [`TreeError`] if the links do not form a tree or a joint moves no inertia.
    pub fn new(name: &str, links: Vec<Link>) -> Result<Tree, TreeError> {
        check(name, &links)?;
        let layout = Layout::of(&links);
        let (count, dofs) = (links.len(), layout.dofs());
        let mut tree = Tree {
            name: name.into(),
            base: links[0].parent_from_link,
            q: vec![0.0; count],
            v: vec![0.0; dofs],
            drives: vec![Drive::NONE; count],
            laws: vec![DriveLaw::default(); count],
            bounded: vec![false; count],
            overrun: vec![false; count],
            external: vec![ForceVector::default(); count],
            effort: vec![0.0; count],
            dry_friction: vec![0.0; count],
            rest: None,
            unconstrained: vec![0.0; dofs],
            reference_m: DVec3::ZERO,
            parent_from_link_rotation: links
                .iter()
                .map(|link| DMat3::from_quat(link.parent_from_link.rotation))
                .collect(),
            rotation: vec![DMat3::IDENTITY; count],
            position_m: vec![DVec3::ZERO; count],
            axis: vec![MotionVector::default(); dofs],
            velocity: vec![MotionVector::default(); count],
            acceleration: vec![MotionVector::default(); count],
            force: vec![ForceVector::default(); count],
            inertia: vec![Inertia::default(); count],
            own_inertia: links.iter().map(|link| Symmetric::of(&link.mass.inertia_kg_m2)).collect(),
            implicit: vec![0.0; dofs],
            rhs: vec![0.0; dofs],
            factor: Factor::sized(&layout),
            half_gyration_rad_s: DVec3::ZERO,
            layout,
            links,
        };
        tree.kinematics();
        tree.bias(DVec3::ZERO);
        tree.composite_mass_matrix();
        tree.factor.factorise(&tree.layout);
        match (0..dofs).find(|dof| !tree.factor.is_positive(*dof)) {
            None => Ok(tree),
            Some(dof) => Err(TreeError::Massless {
                tree: name.into(),
                link: tree.links[tree.layout.link_of[dof]].name.clone(),
            }),
        }
    }

    pub fn links(&self) -> &[Link] {
        &self.links
    }

    pub fn dofs(&self) -> usize {
        self.v.len()
    }

    /// Returns true if the tree is one free body. Its mass matrix is block diagonal, and its gyroscopic
    /// motion is integrated separately.
    pub(in crate::dynamics) fn is_lone(&self) -> bool {
        self.links.len() == 1 && matches!(self.links[0].joint, Joint::Free)
    }

    /// Returns true if steps leave the tree out.
    #[inline]
    pub(in crate::dynamics) fn is_asleep(&self) -> bool {
        self.rest.is_some_and(|rest| rest.is_asleep)
    }

    /// Replaces the mass of a link, from the next step on. The mass is part of the set-up, not of the state.
    pub fn set_mass(&mut self, link: usize, mass: Mass) {
        self.own_inertia[link] = Symmetric::of(&mass.inertia_kg_m2);
        self.links[link].mass = mass;
        self.kinematics();
    }

    pub fn mass_kg(&self) -> f64 {
        self.links.iter().map(|link| link.mass.mass_kg).sum()
    }
}

/// Error of building a tree.
#[derive(Debug, Error, PartialEq)]
pub enum TreeError {
    #[error("tree `{tree}` has no link")]
    Empty { tree: String },
    #[error(
        "link `{link}` of tree `{tree}`: its parent must be an earlier link; only the first link hangs on \
         the world"
    )]
    Parent { tree: String, link: String },
    #[error("link `{link}` of tree `{tree}` has a free joint; only the first link of a tree may be free")]
    Free { tree: String, link: String },
    #[error(
        "the joint of link `{link}` of tree `{tree}` moves nothing that has inertia; give the link a mass or \
         the joint an armature"
    )]
    Massless { tree: String, link: String },
}

fn check(tree: &str, links: &[Link]) -> Result<(), TreeError> {
    if links.is_empty() {
        return Err(TreeError::Empty { tree: tree.into() });
    }
    for (index, link) in links.iter().enumerate() {
        if link.parent.is_none() != (index == 0) || link.parent.is_some_and(|parent| parent >= index) {
            return Err(TreeError::Parent { tree: tree.into(), link: link.name.clone() });
        }
        if index > 0 && matches!(link.joint, Joint::Free) {
            return Err(TreeError::Free { tree: tree.into(), link: link.name.clone() });
        }
    }
    Ok(())
}
