//! Elements of a file between two bodies or geoms: equalities, excludes and pairs.

mod equality;
mod pairs;

pub use equality::{EqualityConstraint, EqualityKind};
pub use pairs::GeomPair;
