//! What can be wrong with a tree, and with a step.

use thiserror::Error;

/// A tree that cannot be built.
#[derive(Debug, Error, PartialEq)]
pub enum TreeError {
    #[error("tree `{tree}` has no link")]
    Empty { tree: String },
    #[error(
        "link `{link}` of tree `{tree}`: its parent must be an earlier link; only the first link hangs on the world"
    )]
    Parent { tree: String, link: String },
    #[error("link `{link}` of tree `{tree}` has a free joint; only the first link of a tree may be free")]
    Free { tree: String, link: String },
    #[error(
        "the joint of link `{link}` of tree `{tree}` moves nothing that has inertia; give the link a mass or the joint an armature"
    )]
    Massless { tree: String, link: String },
}

/// The step gave a number that is not finite; the state is that before the step.
#[derive(Debug, Error, PartialEq)]
#[error(
    "physics diverged at link `{link}` of `{tree}`: a velocity or position is not finite; command less effort or slower motion"
)]
pub struct Diverged {
    pub tree: String,
    pub link: String,
}

/// A state that belongs to another world.
#[derive(Debug, Error, PartialEq)]
#[error(
    "the state has other trees or equalities than this world; one taken from a world of the same making would fit"
)]
pub struct OtherWorld;
